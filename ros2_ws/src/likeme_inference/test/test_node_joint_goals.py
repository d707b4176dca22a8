"""The inference node and goals over all objects: attempts in, beliefs out."""

from __future__ import annotations

import signal
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from fakes import TICK, Arm, Camera
from test_node import answer

from graph import LATCHED, Graph
from likeme_core.paper_world import LEFT, RIGHT, WORLD
from likeme_core.ros.time import time_msg
from likeme_core.tabletop import Manner
from likeme_inference.experience.decision_log import LOG_FILE, DecisionLog
from likeme_inference.log_story import DecisionStory
from likeme_inference.session_inputs import InputKind, read_attempt, read_heard
from likeme_inference.tabletop.attempts import Attempt as Event
from likeme_inference.tabletop.attempts import Stopped
from likeme_inference.tabletop.joint_goals import JointGoals
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.values import TableGoal
from likeme_msgs.msg import Attempt, Decision, Heard, JointGoalBelief, Outcome
from likeme_msgs.srv import AskHuman

UNKNOWN = Attempt.UNKNOWN


def attempt(stamp: int, under_way: bool = False, **changes: object) -> Attempt:
    """The lemon is pushed to RIGHT, and stays LEFT."""
    fields = {
        'object': 'lemon', 'manner': Manner.PUSH, 'manner_probability': 0.98, 'direction': RIGHT,
        'x_i': LEFT, 'x_f': UNKNOWN if under_way else LEFT, 'x_i_probability': [1.0, 0.0, 0.0],
        'x_f_probability': [] if under_way else [1.0, 0.0, 0.0], 'world': WORLD.label,
        'start': time_msg(stamp - TICK), 'end': time_msg(stamp), 'under_way': under_way,
    } | changes  # fmt: skip
    msg = Attempt(**{name: int(v) if isinstance(v, int) else v for name, v in fields.items()
                     if name != 'under_way'}, under_way=under_way)  # fmt: skip
    msg.header.stamp, msg.header.frame_id = time_msg(stamp), 'camera'
    return msg


@pytest.mark.graph
def test_a_belief_follows_each_attempt_and_the_stop(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node', stop_delay=2.0)
        beliefs = graph.collect(JointGoalBelief, 'joint_goal_belief', 10)
        camera = Camera(graph, lemon=LEFT)
        diagnostics = graph.collect(DiagnosticArray, '/diagnostics')
        attempts = graph.publisher(Attempt, 'attempt')
        graph.until(
            lambda: graph.node.count_publishers('joint_goal_belief'), 10, 'a publisher of beliefs'
        )
        first = camera.stamp
        graph.until(lambda: camera.stamp > first + 5 * TICK, 10, 'table states')
        camera.stop()
        stamp = camera.stamp + 5 * TICK
        for msg in (
            attempt(stamp, object='plum'), attempt(stamp, x_f=7), attempt(stamp, under_way=True),
            attempt(stamp + 5 * TICK),
        ):  # fmt: skip
            attempts.publish(msg)
        graph.until(
            lambda: any(
                {'attempts dropped': '2', 'attempts': '2'}.items()
                <= {i.key: i.value for i in array.status[0].values}.items()
                for array in diagnostics
            ),
            10, 'diagnostics',
        )  # fmt: skip
        assert beliefs == []  # No table state has come yet.
        for _ in range(10):
            camera.publish()
        graph.until(lambda: beliefs and beliefs[-1].events == 2, 10, 'both attempts')
        camera.stamp += 30 * TICK
        camera.publish()
        graph.until(lambda: beliefs[-1].stopped, 10, 'the stop')
        latest = graph.collect(JointGoalBelief, 'joint_goal_belief', LATCHED)
        graph.until(lambda: latest, 10, 'the latest belief for a late subscriber')
    assert latest == beliefs[-1:]
    goals = JointGoals.of(WORLD, shipped())
    watcher = goals.watch({'pear': RIGHT, 'lemon': LEFT, 'chicken': RIGHT})
    for event in (Event('lemon', LEFT, LEFT, Manner.PUSH, RIGHT), Stopped()):
        watcher.see(event)
    last = beliefs[-1]
    assert list(last.objects) == list(goals.objects)
    expected = [watcher.marginal(name) for name in goals.objects]
    np.testing.assert_allclose(np.reshape(last.marginals, (3, 4)), expected, atol=1e-9)
    best, p = max(watcher.changes().items(), key=lambda item: item[1])
    assert last.probability[0] == pytest.approx(p)
    assert [None if c == UNKNOWN else c for c in last.changes[:3]] == list(best)
    assert last.description[0] == goals.describe(best)
    assert last.p_value == pytest.approx(watcher.p_value)
    assert last.world == WORLD.label
    assert last.sentence.startswith('The person has stopped: I believe ')


@pytest.mark.parametrize(
    ('changes', 'part'),
    [
        ({'x_i': UNKNOWN}, 'x_i from 0 to 2'),
        ({'direction': 9}, 'direction from 0 to 2'),
        ({'manner': 9}, 'manner from 0 to 2'),
        ({'manner_probability': 1.5}, 'p(manner) from 0 to 1'),
        ({'x_f_probability': [0.5, 0.0, 0.0]}, 'to sum to 1'),
        ({'under_way': True, 'x_f': int(LEFT)}, 'no x_f of an act under way'),
        ({'end': time_msg(1)}, 'an end after the start'),
        ({'world': 'other@000000000000'}, 'Expected the world chung2015'),
    ],
)
def test_bad_attempts_are_refused(changes: dict[str, object], part: str) -> None:
    msg = attempt(100 * TICK)
    for name, value in changes.items():
        setattr(msg, name, value)
    with pytest.raises(ValueError) as error:  # noqa: PT011
        read_attempt(msg, WORLD)
    assert part in str(error.value)


@pytest.mark.graph
def test_a_joint_goal_is_imitated_act_by_act(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start(
            'likeme_inference.inference_node', goals='joint', stop_delay=1.0, help_threshold=0.65
        )
        camera = Camera(graph)
        arm = Arm(graph, camera)
        attempts = graph.publisher(Attempt, 'attempt')
        beliefs = graph.collect(JointGoalBelief, 'joint_goal_belief', LATCHED)
        decisions = graph.collect(Decision, 'decision', LATCHED)
        outcomes = graph.collect(Outcome, 'outcome', 10)
        heard = graph.collect(Heard, 'heard', 100)
        graph.until(lambda: len(heard) > 5, 20, 'a node that hears')
        # The person stops when both acts have been taken in, however late that is.
        camera.stop()
        for name in ('lemon', 'chicken'):
            camera.states[name] = int(LEFT)
            certain = {'x_i_probability': [0.0, 1.0, 0.0], 'x_f_probability': [1.0, 0.0, 0.0]}
            attempts.publish(
                attempt(
                    camera.stamp, object=name, manner=Manner.PLACE, direction=LEFT, x_i=RIGHT,
                    x_f=LEFT, **certain,
                )
            )  # fmt: skip
        graph.until(lambda: beliefs and beliefs[-1].events == 2, 20, 'a belief after both')
        camera.go_on()
        graph.until(lambda: beliefs[-1].stopped, 20, 'the stop')
        assert decisions == []
        camera.states |= {'lemon': int(RIGHT), 'chicken': int(RIGHT)}
        graph.until(lambda: len(outcomes) == 1, 20, 'the outcome of the first act')
        graph.until(lambda: decisions[-1].kind == Decision.ASK_HUMAN, 20, 'a question')
        camera.states['lemon'] = int(LEFT)
        done = answer(graph, decisions[-1].id, AskHuman.Request.DONE_BY_HAND)
        graph.until(lambda: len(outcomes) == 2, 20, 'the outcome of the help')

    push, asking = decisions
    assert (push.object, push.kind, push.goal) == ('chicken', Decision.EXECUTE, LEFT)
    assert 0.5 < push.goal_posterior[LEFT] < 1
    assert (asking.object, asking.goal) == ('lemon', LEFT)
    assert [request.object for request in arm.requests] == ['chicken']
    assert done.success, done.message
    assert [outcome.result for outcome in outcomes] == [Outcome.REACHED, Outcome.REACHED]
    (told,) = (each for each in heard if each.kind == Heard.TABLE_GOAL)
    goal = read_heard(InputKind.TABLE_GOAL, told, WORLD)
    assert isinstance(goal, TableGoal)
    assert [each.object for each in goal.goals] == ['lemon', 'chicken']
    assert time_msg(goal.demonstration) == push.demonstration == beliefs[-1].demonstration
    place = tmp_path / 'state' / f'domain_{graph.domain}' / LOG_FILE
    with closing(DecisionLog(str(place), create=False)) as log:
        written = [entry.data for entry in log.entries(['joint_belief'])]
        kinds = [entry.kind for entry in log.entries(['joint_belief', 'table_goal', 'decision'])]
        story = [entry.kind for entry in DecisionStory(log, push.id).entries()]
        assert not log.verify().problem
    assert [each['stopped'] for each in written] == [False, False, True]
    np.testing.assert_array_equal(np.ravel(written[-1]['marginals']), beliefs[-1].marginals)
    assert [each['sentence'] for each in written][-1] == beliefs[-1].sentence
    assert kinds[:5] == ['joint_belief'] * 3 + ['table_goal', 'decision']
    assert story[:5] == kinds[:5]


@pytest.mark.graph
def test_a_demonstration_goes_on_after_the_node_is_killed(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        first = graph.start('likeme_inference.inference_node', stop_delay=30.0)
        beliefs = graph.collect(JointGoalBelief, 'joint_goal_belief', LATCHED)
        attempts = graph.publisher(Attempt, 'attempt')
        camera = Camera(graph, lemon=LEFT)
        heard = graph.collect(Heard, 'heard', 100)
        graph.until(lambda: len(heard) > 5, 20, 'a node that hears')
        camera.stop()
        attempts.publish(attempt(camera.stamp))
        graph.until(lambda: len(beliefs) == 1, 20, 'a belief')
        first.signal(signal.SIGKILL)
        graph.start('likeme_inference.inference_node', stop_delay=30.0)
        graph.until(lambda: len(beliefs) == 2, 20, 'the belief of the node that was restarted')
        heard.clear()
        camera.go_on()
        graph.until(lambda: len(heard) > 5, 20, 'a node that hears')
        camera.stop()
        attempts.publish(attempt(camera.stamp))
        graph.until(lambda: len(beliefs) == 3, 20, 'a belief after the second act')
        camera.stamp += 330 * TICK
        camera.publish()
        graph.until(lambda: beliefs[-1].stopped, 20, 'the stop')
    before, after, both, stop = beliefs
    assert before == after
    assert [belief.events for belief in (after, both, stop)] == [1, 2, 2]
    assert stop.demonstration == before.demonstration
