from __future__ import annotations

from likeme_core.paper_world import LEFT, RIGHT, WORLD
from likeme_core.ros.world import WorldNames
from likeme_msgs.msg import JointGoalBelief, World
from likeme_operator.ros.cell_events import joint_belief_event
from likeme_operator.ros.views_of_messages import table_belief


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


def test_the_desk_shows_where_each_object_is_wanted() -> None:
    names = WorldNames(World(regions=[state.name for state in WORLD.states]))
    msg = JointGoalBelief(
        objects=['pear'], marginals=[0.7, 0.1, 0.0, 0.2], probability=[0.7],
        description=['pear LEFT'], events=1,
    )  # fmt: skip
    belief = table_belief(msg, names, 2.0)
    assert belief.goals == (('pear LEFT', 0.7),)
    assert [region for region, _ in belief.wanted[0][1]] == [
        'LEFT',
        'anywhere',
        'RIGHT',
        'OFFTABLE',
    ]
    msg.marginals = [0.7, 0.3]
    assert table_belief(msg, names, 2.0).wanted == ()
