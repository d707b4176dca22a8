from __future__ import annotations

from likeme_core.paper_world import LEFT, RIGHT, WORLD
from likeme_core.ros.world import WorldNames
from likeme_msgs.msg import JointGoalBelief, World
from likeme_operator.ros.cell_events import joint_belief_event


def test_a_joint_belief_names_its_goals() -> None:
    unknown = JointGoalBelief.UNKNOWN
    msg = JointGoalBelief(
        objects=['pear', 'lemon'], probability=[0.7, 0.2], sentence='The person has stopped.',
        changes=[unknown, int(RIGHT), int(LEFT), unknown], stopped=True, events=3,
    )  # fmt: skip
    names = WorldNames(World(regions=[state.name for state in WORLD.states]))
    event = joint_belief_event(msg, names)
    assert event.line == 'joint_belief  The person has stopped.'
    assert event.data['changes'] == [
        {'p': 0.7, 'goals': {'lemon': 'RIGHT'}}, {'p': 0.2, 'goals': {'pear': 'LEFT'}},
    ]  # fmt: skip
    assert (event.data['stopped'], event.data['events']) == (True, 3)
