"""The line on the state of a cell, from what was heard."""

from __future__ import annotations

from likeme_bringup.cell_status import (
    EXPECTED,
    CellStatus,
    MotionPermission,
    Question,
    node_statuses,
)
from likeme_core.heartbeats import NodeRecord, NodeState

ALLOWED = MotionPermission(True)
QUESTION = Question(3, 'pear', 'Shall I?')


def heard(
    silence: float = 0.0, **changes: NodeRecord
) -> tuple[dict[str, NodeRecord], dict[str, float]]:
    """All expected nodes READY, except for some; the last one silent for a while."""
    nodes = {
        f'/{name}': changes.get(name, NodeRecord('r', 0.0, NodeState.READY, '', '0.1.0'))
        for name in (*EXPECTED, *changes)
    }
    return nodes, dict.fromkeys(nodes, 0.0) | {f'/{EXPECTED[-1]}': silence}


def status(
    motion: MotionPermission = ALLOWED,
    questions: tuple[Question, ...] = (),
    silence: float = 0.0,
    **changes: NodeRecord,
) -> CellStatus:
    return CellStatus(motion, node_statuses(*heard(silence, **changes), 0.25), questions)


def test_a_cell_in_service() -> None:
    cell = status()
    assert cell.in_service
    assert cell.line == (
        'motion allowed | hold_keeper ready | arm_driver ready | perception_node ready | '
        'inference_node ready | 0.1.0'
    )


def test_a_hold_takes_it_out_of_service() -> None:
    cell = status(MotionPermission(False, 'held by anna: a hand is in the way'))
    assert not cell.in_service
    assert cell.line.startswith('motion held by anna: a hand is in the way | ')


def test_a_node_that_is_not_ready_says_why() -> None:
    learning = NodeRecord('r', 0.0, NodeState.STARTING, 'the background is learned', '0.1.0', 1)
    cell = status(perception_node=learning)
    assert not cell.in_service
    assert 'perception_node starting: the background is learned, restarted |' in cell.line


def test_open_questions_are_counted() -> None:
    assert 'inference_node ready, 1 question open |' in status(questions=(QUESTION,)).line
    assert 'inference_node ready, 2 questions open |' in status(questions=(QUESTION,) * 2).line


def test_silent_absent_and_further_nodes() -> None:
    cell = status(silence=0.6)
    assert not cell.in_service
    assert 'inference_node silent: not heard for 0.6 s |' in cell.line
    nothing = CellStatus(MotionPermission(True), node_statuses({}, {}, 0.25))
    assert not nothing.in_service
    assert nothing.line == (
        'motion allowed | hold_keeper absent | arm_driver absent | perception_node absent | '
        'inference_node absent | version unknown'
    )
    degraded = NodeRecord('r', 0.0, NodeState.DEGRADED, 'inputs were refused', '0.1.0')
    further = status(gaze_node=degraded)
    assert not further.in_service
    assert 'gaze_node degraded: inputs were refused | 0.1.0' in further.line


def test_different_versions_are_told() -> None:
    cell = status(arm_driver=NodeRecord('r', 0.0, NodeState.READY, '', '0.2.0'))
    assert cell.line.endswith(
        'versions differ: hold_keeper 0.1.0, arm_driver 0.2.0, perception_node 0.1.0, '
        'inference_node 0.1.0'
    )


def test_json_has_all_of_it() -> None:
    document = status(questions=(QUESTION,)).as_json()
    assert document['in_service'] is True
    assert document['motion'] == {'allowed': True, 'why': ''}
    assert document['nodes']['arm_driver'] == {
        'state': 'ready', 'message': '', 'version': '0.1.0', 'restarts': 0,
    }  # fmt: skip
    assert document['questions'] == [{'id': 3, 'object': 'pear', 'question': 'Shall I?'}]
