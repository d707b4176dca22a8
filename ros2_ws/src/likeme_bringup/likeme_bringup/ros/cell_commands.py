"""Thin callers of the cell's services, for people: `arm`, `show` and `cell`.

Exit codes: 0 done, 1 it did not come about, 2 wrong usage, 3 the service is not there, 130 Ctrl-C.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from enum import StrEnum
from typing import Annotated

import typer
from std_srvs.srv import Trigger

from likeme_bringup.ros.service_client import Verdict, call, caller, next_table_state
from likeme_core.cli import Domain
from likeme_msgs.msg import ObjectState, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell


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


Network = Annotated[
    bool, typer.Option('--network', help='Look for the cell on other machines of the subnet too.')
]
STATE_NAMES = {state.number: state.value for state in State}


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
