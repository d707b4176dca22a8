"""What is wrong with a cell, a sentence each."""

from __future__ import annotations

from collections.abc import Mapping

from likeme_bringup.cell_status import MotionPermission, NodeStatus
from likeme_operator.desk_view import SeenTable

#: s without a table state after which the picture counts as old.
OLD_FRAME = 1.0
#: What follows from a node that is not ready.
FOLLOWS = {
    'inference_node': 'nothing is decided, and no answer is taken',
    'arm_driver': 'the arm does not move',
    'perception_node': 'nothing new is seen',
    'hold_keeper': 'nothing moves',
}


def problems_of(
    reached: bool,
    nodes: Mapping[str, NodeStatus],
    motion: MotionPermission,
    table: SeenTable | None,
) -> tuple[str, ...]:
    """The sentences, the most urgent first; empty: all is well.

    Args:
        reached: whether any node was heard so far.
        nodes: by name.
        motion: whether it is allowed. A hold is no problem: somebody wanted it.
        table: the newest one.
    """
    if not reached:
        return ('No node of a cell is heard: ./scripts/start_cell.sh starts one.',)
    problems = [
        f'{name} is {node.state}' + (f', {FOLLOWS[name]}' if name in FOLLOWS else '') + '.'
        # What has died before what was never there.
        for name, node in sorted(nodes.items(), key=lambda each: each[1].state != 'silent')
        if node.state not in ('ready', 'ending')
    ]
    keeper = nodes.get('hold_keeper')
    if 'keeper' in motion.why and keeper is not None and keeper.state == 'ready':
        problems.append('The hold keeper tells nothing of the hold: nothing moves.')
    perceived = nodes.get('perception_node')
    if table is not None and perceived is not None and perceived.state == 'ready':
        if table.age > OLD_FRAME:
            problems.append(f'The picture is {table.age:.0f} s old.')
        elif table.reason:
            problems.append(f'The camera tells nothing: {table.reason}.')
    return tuple(problems)
