"""CLI clients of the cell's services: `arm`, `show` and `cell`.

Exit codes: 0 done, 1 refused or failed, 2 wrong usage, 3 the service is not there, 130 Ctrl-C.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Annotated, NoReturn

import typer
from std_srvs.srv import Trigger

from likeme_bringup.enum_choice import choices, member
from likeme_bringup.ros.service_client import (
    DISCOVERY_TIMEOUT,
    CallResult,
    call,
    client_node,
    next_table_state,
)
from likeme_bringup.ros.status_command import status_command
from likeme_core.cli import MAX_SEED, Domain, Network
from likeme_core.ros.world import WorldNames, WorldSubscriber
from likeme_core.tabletop import Manner
from likeme_core.typer_app import App
from likeme_msgs.msg import ObjectState, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell


def state_name(names: WorldNames, state: int) -> str:
    """The name of a state on the command line."""
    unknown = state == ObjectState.UNKNOWN
    return 'in an unknown state' if unknown else names.state(state).lower()


def check_start(names: WorldNames, table: TableState | None, name: str, start: str) -> CallResult:
    """Whether the camera sees the object where the demonstration is to begin."""
    if table is None:
        return CallResult(
            3, 'Nobody publishes table_state: is perception running? (--force does without.)'
        )
    states = {item.name: item.state for item in table.objects}
    if name not in states:
        return CallResult(1, f'The camera knows {", ".join(sorted(states))}, not {name}.')
    seen = state_name(names, states[name])
    if seen != start.lower():
        return CallResult(
            1, f'The camera sees the {name} {seen}, not {start}; --force shows it anyway.'
        )
    return CallResult(0, '')


def arm_command(
    action: Annotated[str, typer.Argument(metavar='ACTION', help='e.g. push_left.')],
    object_name: Annotated[str, typer.Argument(metavar='OBJECT', help='e.g. pear.')],
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Let the robot do one action, e.g. `arm push_left pear`."""
    request = ExecuteAction.Request(object=object_name, action=action)
    with client_node(network, domain) as node:
        report(call(node, ExecuteAction, 'arm/execute_action', request))


def show_command(
    object_name: Annotated[str, typer.Argument(metavar='OBJECT', help='e.g. pear.')],
    start: Annotated[str, typer.Argument(metavar='FROM', help='Where it is now, e.g. left.')],
    target: Annotated[str, typer.Argument(metavar='TO', help='Where to move it.')],
    by: Annotated[str, typer.Option(help=f'How to move it: {choices(Manner)}.')] = 'place',
    force: Annotated[
        bool, typer.Option('--force', help='Show it even if the camera sees it elsewhere.')
    ] = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Let the simulated person move an object, e.g. `show pear left right --by push`."""
    manner = member(Manner, by).name.lower()
    if start.lower() == target.lower():
        raise typer.BadParameter(f'expected two different states, got {start} twice.')
    with client_node(network, domain) as node:
        names = WorldSubscriber(node).wait(DISCOVERY_TIMEOUT)
        if names.message is None:
            report(CallResult(3, 'Nobody publishes world: is the cell running?'))
        try:
            names.check_state(start)
            action = names.action_of(manner, target)
        except ValueError as error:
            report(CallResult(2, str(error)))
        if not force:
            seen = check_start(names, next_table_state(node), object_name, start)
            if seen.code:
                report(seen)
        request = ExecuteAction.Request(object=object_name, action=action)
        report(call(node, ExecuteAction, 'human/execute_action', request))


def reset_command(
    places: Annotated[
        list[str] | None,
        typer.Argument(metavar='[OBJECT=STATE]...', help='e.g. pear=left lemon=right.'),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=MAX_SEED, help='Draws the exact places.')] = 0,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Set the table up; without places, as at the start of this run of the cell."""
    pairs = [parse_place(text) for text in places or ()]
    request = ResetCell.Request(
        objects=[name for name, _ in pairs], states=[state for _, state in pairs], seed=seed
    )
    with client_node(network, domain) as node:
        report(call(node, ResetCell, 'cell/reset', request))


def parse_place(text: str) -> tuple[str, str]:
    """`pear=left` as the names of an object and a state."""
    name, _, state = text.partition('=')
    if not name or not state:
        raise typer.BadParameter(f'expected OBJECT=STATE, got {text!r}.')
    return name, state


def hold_command(network: Network = False, domain: Domain = 0) -> None:
    """Hold every motion until it is resumed; the action in progress ends as HELD."""
    with client_node(network, domain) as node:
        report(call(node, Trigger, 'cell/hold', Trigger.Request(), repeated=True))


def resume_command(network: Network = False, domain: Domain = 0) -> None:
    """Allow motion again after a hold."""
    with client_node(network, domain) as node:
        report(call(node, Trigger, 'cell/resume', Trigger.Request(), repeated=True))


def report(result: CallResult) -> NoReturn:
    """Print the message and exit with the code."""
    print(result.message, file=sys.stderr if result.code else sys.stdout)
    raise typer.Exit(result.code)


def application(*commands: tuple[str, Callable[..., None]]) -> typer.Typer:
    """A command line of one command, or of several by name."""
    app = App(add_completion=False, rich_markup_mode=None, no_args_is_help=True)
    for name, command in commands:
        app.command(name, no_args_is_help=len(commands) == 1)(command)
    return app


def arm() -> None:
    """Entry point of `arm`."""
    application(('arm', arm_command))()


def show() -> None:
    """Entry point of `show`."""
    application(('show', show_command))()


def cell() -> None:
    """Entry point of `cell`."""
    application(
        ('reset', reset_command),
        ('hold', hold_command),
        ('resume', resume_command),
        ('status', status_command),
    )()


if __name__ == '__main__':
    {'arm': arm, 'show': show, 'cell': cell}[sys.argv.pop(1)]()
