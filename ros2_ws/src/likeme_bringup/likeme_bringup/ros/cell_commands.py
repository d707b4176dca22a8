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
from likeme_bringup.ros.service_client import CallResult, call, client_node, next_table_state
from likeme_core.cli import Domain
from likeme_core.tabletop import Action, Manner, State
from likeme_msgs.msg import TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

Network = Annotated[
    bool, typer.Option('--network', help='Look for the cell on other machines of the subnet too.')
]


def state_name(state: int) -> str:
    """The name of a state on the command line."""
    return State(state).name.lower() if state in tuple(State) else 'in an unknown state'


def check_start(table: TableState | None, name: str, start: State) -> CallResult:
    """Whether the camera sees the object where the demonstration is to begin."""
    if table is None:
        return CallResult(
            3, 'Nobody publishes table_state: is perception running? (--force does without.)'
        )
    states = {item.name: item.state for item in table.objects}
    if name not in states:
        return CallResult(1, f'The camera knows {", ".join(sorted(states))}, not {name}.')
    if states[name] != start:
        seen, expected = state_name(states[name]), state_name(start)
        return CallResult(
            1, f'The camera sees the {name} {seen}, not {expected}; --force shows it anyway.'
        )
    return CallResult(0, '')


def arm_command(
    action: Annotated[str, typer.Argument(metavar='ACTION', help=f'{choices(Action)}.')],
    object_name: Annotated[str, typer.Argument(metavar='OBJECT', help='pear, lemon or chicken.')],
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Let the robot do one action, e.g. `arm push_left pear`."""
    request = ExecuteAction.Request(object=object_name, action=int(member(Action, action)))
    with client_node(network, domain) as node:
        report(call(node, ExecuteAction, 'arm/execute_action', request))


def show_command(
    object_name: Annotated[str, typer.Argument(metavar='OBJECT', help='pear, lemon or chicken.')],
    start: Annotated[
        str, typer.Argument(metavar='FROM', help=f'Where it is now: {choices(State)}.')
    ],
    target: Annotated[str, typer.Argument(metavar='TO', help='Where to move it.')],
    by: Annotated[str, typer.Option(help=f'How to move it: {choices(Manner)}.')] = 'place',
    force: Annotated[
        bool, typer.Option('--force', help='Show it even if the camera sees it elsewhere.')
    ] = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Let the simulated person move an object, e.g. `show pear left right --by push`."""
    x_i, x_f = member(State, start), member(State, target)
    if x_i is x_f:
        raise typer.BadParameter(f'expected two different states, got {start} twice.')
    action = Action.of(member(Manner, by), x_f)
    with client_node(network, domain) as node:
        if not force:
            seen = check_start(next_table_state(node), object_name, x_i)
            if seen.code:
                report(seen)
        request = ExecuteAction.Request(object=object_name, action=int(action))
        report(call(node, ExecuteAction, 'human/execute_action', request))


def reset_command(
    places: Annotated[
        list[str] | None,
        typer.Argument(metavar='[OBJECT=STATE]...', help='e.g. pear=left lemon=right.'),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help='Draws the exact places.')] = 0,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Set the table up; without places, as at the start of this run of the cell."""
    pairs = [parse_place(text) for text in places or ()]
    request = ResetCell.Request(
        objects=[name for name, _ in pairs], states=[int(state) for _, state in pairs], seed=seed
    )
    with client_node(network, domain) as node:
        report(call(node, ResetCell, 'cell/reset', request))


def parse_place(text: str) -> tuple[str, State]:
    """`pear=left` as a name and a state."""
    name, _, state = text.partition('=')
    if not name or not state:
        raise typer.BadParameter(f'expected OBJECT=STATE, got {text!r}.')
    return name, member(State, state)


def hold_command(network: Network = False, domain: Domain = 0) -> None:
    """Stop every motion at once; the action in progress ends as HELD."""
    with client_node(network, domain) as node:
        report(call(node, Trigger, 'cell/hold', Trigger.Request()))


def resume_command(network: Network = False, domain: Domain = 0) -> None:
    """Allow motion again after a hold."""
    with client_node(network, domain) as node:
        report(call(node, Trigger, 'cell/resume', Trigger.Request()))


def report(result: CallResult) -> NoReturn:
    """Print the message and exit with the code."""
    print(result.message, file=sys.stderr if result.code else sys.stdout)
    raise typer.Exit(result.code)


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
