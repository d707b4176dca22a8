"""Thin callers of the cell's services, for people: `arm`, `show` and `cell`.

Exit codes: 0 done, 1 it did not come about, 2 wrong usage, 3 the service is not there, 130 Ctrl-C.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import Annotated, Any, NamedTuple

import rclpy
import typer
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_srvs.srv import Trigger

from likeme_bringup.start_cell import Domain
from likeme_msgs.msg import ObjectState, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

# Seconds to wait for a service or for the first table state: with the start of Python, a caller
# without a cell says so within 10.
PATIENCE = 8.0
# No motion takes longer, s: whoever served it was replaced by another meanwhile.
LONGEST = 180.0
# How often a pending call looks whether its server is still alive, s.
GLANCE = 0.5


class State(StrEnum):
    """Where an object can be put; the names are ObjectState constants in lower case."""

    LEFT = 'left'
    RIGHT = 'right'
    OFFTABLE = 'offtable'

    @property
    def number(self) -> int:
        """The constant of ObjectState."""
        return int(getattr(ObjectState, self.name))


class Manner(StrEnum):
    """How an object is moved."""

    PLACE = 'place'
    PUSH = 'push'


class Action(StrEnum):
    """The six actions; the names are ExecuteAction constants in lower case."""

    PLACE_LEFT = 'place_left'
    PLACE_RIGHT = 'place_right'
    PLACE_OFFTABLE = 'place_offtable'
    PUSH_LEFT = 'push_left'
    PUSH_RIGHT = 'push_right'
    PUSH_OFFTABLE = 'push_offtable'

    @property
    def number(self) -> int:
        """The constant of ExecuteAction."""
        return int(getattr(ExecuteAction.Request, self.name))


class Verdict(NamedTuple):
    """What to tell the caller, and the exit code."""

    code: int
    sentence: str


Network = Annotated[
    bool, typer.Option('--network', help='Look for the cell on other machines of the subnet too.')
]
STATE_NAMES = {state.number: state.value for state in State}


@contextmanager
def caller(network: bool, domain: int) -> Iterator[Node]:
    """A short-lived node."""
    if network:
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET'
    rclpy.init(domain_id=domain)
    node = Node(f'caller_{os.getpid()}')
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def call(node: Node, kind: Any, name: str, request: Any) -> Verdict:
    """Call a service whose answer has `success` and `message`."""
    client = node.create_client(kind, name)
    if not client.wait_for_service(timeout_sec=PATIENCE):
        return Verdict(
            3, f'Nobody serves {name} on ROS domain {domain_of(node)}: is the cell running?'
        )
    future = client.call_async(request)
    try:
        return answer_of(node, client, future)
    except (KeyboardInterrupt, ExternalShutdownException):
        return Verdict(
            130, f'No longer waiting for {name}. What it began goes on; `cell.sh hold` stops it.'
        )


def answer_of(node: Node, client: Any, future: Any) -> Verdict:
    """Wait for an answer as long as there is hope for one."""
    deadline = time.monotonic() + LONGEST
    while not future.done():
        rclpy.spin_until_future_complete(node, future, timeout_sec=GLANCE)
        if not future.done() and not client.service_is_ready():
            return Verdict(3, f'{client.srv_name} went away before it answered.')
        if not future.done() and time.monotonic() > deadline:
            return Verdict(3, f'{client.srv_name} gave no answer within {LONGEST:g} s.')
    answer = future.result()
    return Verdict(0 if answer.success else 1, answer.message)


def next_table_state(node: Node) -> TableState | None:
    """The next table state, or None when none comes in time."""
    seen: list[TableState] = []
    subscription = node.create_subscription(TableState, 'table_state', seen.append, 1)
    deadline = time.monotonic() + PATIENCE
    while not seen and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=GLANCE)
    node.destroy_subscription(subscription)
    return seen[0] if seen else None


def check_start(table: TableState | None, name: str, start: State) -> Verdict:
    """Whether the camera sees the object where the demonstration is to begin."""
    if table is None:
        return Verdict(
            3, 'Nobody publishes table_state: is perception running? (--force goes on unseen.)'
        )
    states = {item.name: item.state for item in table.objects}
    if name not in states:
        return Verdict(1, f'The camera knows {", ".join(sorted(states))}, not {name}.')
    if states[name] != start.number:
        seen = STATE_NAMES.get(states[name], 'in an unknown place')
        return Verdict(
            1,
            f'The camera sees the {name} {seen}, not {start.value}; --force goes on all the same.',
        )
    return Verdict(0, '')


def arm_command(
    action: Annotated[Action, typer.Argument(help='What to do.')],
    object_name: Annotated[str, typer.Argument(metavar='OBJECT', help='pear, lemon or chicken.')],
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Let the robot do one action, e.g. `arm push_left pear`."""
    with caller(network, domain) as node:
        request = ExecuteAction.Request(object=object_name, action=action.number)
        end(call(node, ExecuteAction, 'arm/execute_action', request))


def show_command(
    object_name: Annotated[str, typer.Argument(metavar='OBJECT', help='pear, lemon or chicken.')],
    start: Annotated[State, typer.Argument(metavar='FROM', help='Where it is now.')],
    target: Annotated[State, typer.Argument(metavar='TO', help='Where to move it.')],
    by: Annotated[Manner, typer.Option(help='Lift it or push it.')] = Manner.PLACE,
    force: Annotated[
        bool, typer.Option('--force', help='Go on even if the camera sees it elsewhere.')
    ] = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Let the simulated person show an act, e.g. `show pear left right --by push`."""
    if start == target:
        raise typer.BadParameter(f'expected two different states, got {start.value} twice.')
    with caller(network, domain) as node:
        if not force:
            verdict = check_start(next_table_state(node), object_name, start)
            if verdict.code:
                end(verdict)
        action = Action[f'{by.name}_{target.name}']
        request = ExecuteAction.Request(object=object_name, action=action.number)
        end(call(node, ExecuteAction, 'human/execute_action', request))


def reset_command(
    places: Annotated[
        list[str] | None,
        typer.Argument(metavar='[OBJECT=STATE]...', help='e.g. pear=left lemon=right.'),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help='Draws the exact places.')] = 0,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Set the table up anew; without places, as this run of the cell had it first."""
    pairs = [parse_place(text) for text in places or ()]
    request = ResetCell.Request(
        objects=[name for name, _ in pairs], states=[state.number for _, state in pairs], seed=seed
    )
    with caller(network, domain) as node:
        end(call(node, ResetCell, 'cell/reset', request))


def parse_place(text: str) -> tuple[str, State]:
    """`pear=left` as a name and a state."""
    name, _, state = text.partition('=')
    if not name or state not in tuple(State):
        raise typer.BadParameter(f'expected OBJECT=left, right or offtable, got "{text}".')
    return name, State(state)


def hold_command(network: Network = False, domain: Domain = 0) -> None:
    """Stop every motion at once; an interrupted action reports so."""
    with caller(network, domain) as node:
        end(call(node, Trigger, 'cell/hold', Trigger.Request()))


def resume_command(network: Network = False, domain: Domain = 0) -> None:
    """Go on after a hold."""
    with caller(network, domain) as node:
        end(call(node, Trigger, 'cell/resume', Trigger.Request()))


def end(verdict: Verdict) -> None:
    """Say it and leave with its code."""
    print(verdict.sentence, file=sys.stderr if verdict.code else sys.stdout)
    raise typer.Exit(verdict.code)


def domain_of(node: Node) -> int:
    """The ROS domain a node is in."""
    return int(node.context.get_domain_id())


def application(*commands: tuple[str, Callable[..., None]]) -> typer.Typer:
    """A command line of one command, or of several by name."""
    app = typer.Typer(add_completion=False, rich_markup_mode=None, no_args_is_help=True)
    for name, command in commands:
        app.command(name, no_args_is_help=len(commands) == 1)(command)
    return app


def arm() -> None:
    """Entry point of `arm`."""
    application(('arm', arm_command))(prog_name='arm')


def show() -> None:
    """Entry point of `show`."""
    application(('show', show_command))(prog_name='show')


def cell() -> None:
    """Entry point of `cell`."""
    application(('reset', reset_command), ('hold', hold_command), ('resume', resume_command))(
        prog_name='cell'
    )


if __name__ == '__main__':
    {'arm': arm, 'show': show, 'cell': cell}[sys.argv.pop(1)]()
