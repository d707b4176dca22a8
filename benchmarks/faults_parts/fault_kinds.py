"""The faults: what each does to a cell in simulated time, and at which moment of a story."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from faults_parts.sim_cell import ARM, CAMERA, INFERENCE, KEEPER, Cell
from faults_parts.sim_graph import Process
from faults_parts.sim_time import SECOND, SIM_TIME

#: Moments of a story: events that often come, and those that come once, by when they do.
OFTEN = (
    'publish table_state', 'publish heard', 'publish cell/hold_state', 'request ask_human',
    'response ask_human',
)  # fmt: skip
FIRST = (
    'publish demonstration', 'before demonstration', 'after demonstration', 'publish goal_belief',
    'before decision', 'after decision', 'publish decision',
)  # fmt: skip
ASKED = ('before answer', 'after answer')
MOVED = (
    'before motion_requested', 'after motion_requested', 'request arm/execute_action',
    'motion accepted', 'motion begins', 'motion ends', 'publish motion',
    'response arm/execute_action', 'before motion_report', 'after motion_report',
)  # fmt: skip
LAST = ('before outcome', 'after outcome', 'publish outcome')
MOMENTS = (*OFTEN, *FIRST, *ASKED, *MOVED, *LAST)
#: Topics that are late or doubled, and those of which messages can be lost: what is sent
#: reliably is sent again while its network is whole.
CARRIED = (
    'table_state', 'demonstration', 'cell/hold_state', 'cell/holds', 'motion', 'heartbeat',
    'request arm/execute_action', 'response arm/execute_action', 'request ask_human',
    'response ask_human', 'request arm/motion_status', 'response arm/motion_status',
)  # fmt: skip
LOSABLE = tuple(
    topic for topic in CARRIED if topic not in ('demonstration', 'motion', 'cell/holds')
)


class Fault(NamedTuple):
    """A fault of a story.

    Attributes:
        kind: of KINDS.
        moment, skip: the event at which it comes, and how many of them are let pass.
        node, topic: which it is about, where it is about one.
        duration: s.
        amount: meaning depends on the kind.
    """

    kind: str
    moment: str
    skip: int
    node: str
    topic: str
    duration: float
    amount: float


def draw(rng: np.random.Generator) -> Fault:
    """Any fault at any moment."""
    kind = str(rng.choice(list(KINDS)))
    topics = LOSABLE if kind == 'lose' else CARRIED
    moment = str(rng.choice(MOMENTS))
    return Fault(
        kind,
        moment,
        int(rng.integers(0, 15 if moment in OFTEN else 1)),
        str(rng.choice([INFERENCE, INFERENCE, ARM, KEEPER, CAMERA])),
        str(rng.choice(topics)),
        float(rng.uniform(0.1, 3.0)),
        float(rng.uniform(-1.0, 1.0)),
    )


def _kill(cell: Cell, fault: Fault) -> None:
    cell.kill(fault.node, 0.2 + fault.duration / 3)


def _kill_twice(cell: Cell, fault: Fault) -> None:
    cell.graph.after(1.0, lambda: cell.kill(fault.node))
    cell.kill(fault.node)


def _kill_both(cell: Cell, fault: Fault) -> None:
    cell.graph.after(0.0, lambda: cell.kill(ARM))
    cell.kill(INFERENCE, 0.2 + fault.duration / 3)


def _pause(cell: Cell, fault: Fault) -> None:
    process = cell.processes[fault.node]
    process.pause()
    cell.graph.after(fault.duration, process.resume)


def _slow(cell: Cell, fault: Fault) -> None:
    process = cell.processes[fault.node]
    process.delay = 0.01 + 0.03 * abs(fault.amount)

    def end() -> None:
        process.delay = 0.0

    cell.graph.after(fault.duration, end)


def _route(change: Callable[[Any], list[tuple[float, Any]]]) -> Callable[[Cell, Fault], None]:
    """A fault of the transport: how a topic's messages arrive for a while."""

    def begin(cell: Cell, fault: Fault) -> None:
        def route(topic: str, message: Any, _: Process) -> list[tuple[float, Any]] | None:
            return change(message) if topic == fault.topic else None

        cell.graph.routes.append(route)
        cell.graph.after(fault.duration, lambda: cell.graph.routes.remove(route))

    return begin


def _out_of_order(cell: Cell, fault: Fault) -> None:
    late = [0.0]

    def change(message: Any) -> list[tuple[float, Any]]:
        late[0] = 0.35 - late[0]
        return [(late[0], message)]

    _route(change)(cell, fault)


def _corrupt(message: Any) -> list[tuple[float, Any]]:
    """The message, and beside it ones that nobody may believe."""
    arrivals = [(0.0, message)]
    if isinstance(message, SimpleNamespace):
        wrong: list[dict[str, Any]] = [{'world': 'another@world'}]
        if hasattr(message, 'x_i'):
            wrong += [{'x_i': 77}, {'x_f': message.x_i}, {'x_f_probability': [0.1, 0.1, 0.1]}]
            wrong += [{'x_i_probability': [float('nan')] * 3}, {'object': 'no toy'}]
        else:
            bad = copy(message.objects[0])
            bad.state = 99
            wrong.append({'objects': [bad, *message.objects[1:]]})
        for fields in wrong:
            changed = copy(message)
            changed.__dict__.update(fields)
            arrivals.append((0.001, changed))
    return arrivals


def _ros_clock_jumps(cell: Cell, fault: Fault) -> None:
    cell.table.jump += round(fault.amount * 3600 * SECOND)


def _system_clock_jumps(_: Cell, fault: Fault) -> None:
    SIM_TIME.jump += round(fault.amount * 3600 * SECOND)


def _store(problem: str, full: bool = False) -> Callable[[Cell, Fault], None]:
    def begin(cell: Cell, fault: Fault) -> None:
        stores = cell.stores
        stores.problem, stores.full = problem, full

        def end() -> None:
            stores.problem, stores.full = '', False

        cell.graph.after(fault.duration, end)

    return begin


def _hold(cell: Cell, fault: Fault) -> None:
    cell.hold()
    cell.graph.after(fault.duration, cell.resume)


def _hold_and_kill(cell: Cell, fault: Fault) -> None:
    """A hold; once it holds, a node dies, and comes back held."""
    _hold(cell, fault)
    cell.graph.after(0.05, lambda: cell.kill(fault.node))


def _unplug(cell: Cell, fault: Fault) -> None:
    process = cell.processes[CAMERA]
    process.pause()
    # Also for longer than the session waits for an outcome.
    cell.graph.after(5 * fault.duration, process.resume)


def _operator(**manner: Any) -> Callable[[Cell, Fault], None]:
    def begin(cell: Cell, fault: Fault) -> None:
        for name, value in manner.items():
            setattr(cell.operator.manner, name, value)
        if 'away_until' in manner:
            cell.operator.manner.away_until = SIM_TIME.seconds + 3 * fault.duration

    return begin


def _operator_away_and_kill(cell: Cell, fault: Fault) -> None:
    _operator(away_until=0.0)(cell, fault)
    cell.graph.after(fault.duration, lambda: cell.kill(INFERENCE))


KINDS: dict[str, Callable[[Cell, Fault], None]] = {
    'kill': _kill,
    'kill twice': _kill_twice,
    'kill both': _kill_both,
    'pause': _pause,
    'slow': _slow,
    'lose': _route(lambda message: []),
    'double': _route(lambda message: [(0.0, message), (0.002, message)]),
    'double late': _route(lambda message: [(0.0, message), (0.6, message), (2.5, message)]),
    'late': _route(lambda message: [(0.4, message)]),
    'out of order': _out_of_order,
    'corrupt': _route(_corrupt),
    'ROS clock jumps': _ros_clock_jumps,
    'system clock jumps': _system_clock_jumps,
    'store locked': _store('database is locked'),
    'store read-only': _store('attempt to write a readonly database'),
    'disk full': _store('database or disk is full', full=True),
    'hold': _hold,
    'hold and kill': _hold_and_kill,
    'camera unplugged': _unplug,
    'operator vanishes': _operator(away_until=0.0),
    'operator vanishes, node dies': _operator_away_and_kill,
    'operator answers twice': _operator(copies=2),
    'two operators': _operator(rival=0),
    'wrong answers': _operator(wrong=True),
}
