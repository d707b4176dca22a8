"""Joint goals from pixels: people who fail, in recordings and through the graph of the cell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graph import HOLD_KEEPER, LATCHED, Graph
from likeme_core.observations import ObservedAttempt
from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_core.tabletop import Manner, State
from likeme_inference.joint_belief import JointBelief
from likeme_inference.joint_observer import SURE_MANNER, JointObserver, JointSettings
from likeme_inference.tabletop.attempts import Attempt as Event
from likeme_inference.tabletop.attempts import Stopped
from likeme_inference.tabletop.joint_goals import JointGoals
from likeme_inference.tabletop.model_file import shipped
from likeme_msgs.msg import Attempt, Demonstration, JointGoalBelief, TableState
from likeme_msgs.srv import ExecuteAction
from likeme_replay import offline_replay
from likeme_replay.in_process import InProcessGraph
from likeme_replay.input_scheduler import FrameAck
from likeme_replay.recorded_inputs import RecordedFrame

BAGS = Path(__file__).parents[1] / 'bags'


class Observed(InProcessGraph):
    """A replay that watches for joint goals, too."""

    def __init__(self, *parameters: Any) -> None:
        super().__init__(*parameters)
        self.observer = JointObserver(WORLD, shipped(), JointSettings())
        self.attempts: list[ObservedAttempt] = []
        self.beliefs: list[JointBelief] = []

    def show_frame(self, frame: RecordedFrame) -> FrameAck:
        told = super().show_frame(frame)
        if told.table_state and self.table is not None:
            self.attempts += self.table.attempts
            self.beliefs += self.observer.look(self.table.snapshot)
            for attempt in self.table.attempts:
                self.beliefs += self.observer.see(attempt)
        return told


@pytest.mark.parametrize(
    ('name', 'ends'),
    [
        ('lifted', [('pear', RIGHT, RIGHT, None)]),
        ('dropped_short', [('pear', RIGHT, OFFTABLE, LEFT)]),
    ],
)
def test_the_attempts_of_a_recording(
    name: str, ends: list[tuple[str, State, State, State | None]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    made: list[Observed] = []

    def make(*parameters: Any) -> Observed:
        made.append(Observed(*parameters))
        return made[-1]

    monkeypatch.setattr(offline_replay, 'InProcessGraph', make)
    assert offline_replay.replay_offline(BAGS / name).complete
    (watched,) = made
    ended = [a for a in watched.attempts if not a.under_way]
    assert [(a.object, a.x_i, a.x_f, a.direction) for a in ended] == ends
    assert {a.manner for a in ended} <= {Manner.PLACE}
    if name == 'dropped_short':
        # That it was carried towards LEFT speaks for LEFT, wherever it rolled afterwards.
        lifted, carried, _ = watched.beliefs
        pear = lifted.objects.index('pear')
        assert carried.marginals[pear, LEFT] > 2 * lifted.marginals[pear, LEFT]


@pytest.mark.graph
def test_what_is_lifted_and_set_down_where_it_was_moves_the_belief(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        attempts = graph.collect(Attempt, 'attempt')
        acts = graph.collect(Demonstration, 'demonstration')
        beliefs = graph.collect(JointGoalBelief, 'joint_goal_belief', LATCHED)
        tables = graph.collect(TableState, 'table_state')
        graph.start('likeme_inference.inference_node', stop_delay=2.0)
        graph.start('likeme_perception.perception_node')
        graph.start(HOLD_KEEPER)
        graph.start('likeme_arm_sim.arm_driver_node', seed=3)
        graph.until(lambda: tables and tables[-1].settled, 60, 'a settled table')
        states = {o.name: o.state for o in tables[-1].objects}
        assert states['pear'] == RIGHT
        place = ExecuteAction.Request(object='pear', action='place_right')
        graph.call(ExecuteAction, 'human/execute_action', place, 60)
        graph.until(lambda: attempts and not attempts[-1].under_way, 30, 'the end of the attempt')
        graph.until(lambda: beliefs and beliefs[-1].stopped, 30, 'the stop')
    begun, ended = attempts[0], attempts[-1]
    assert (begun.object, begun.under_way, begun.x_f) == ('pear', True, Attempt.UNKNOWN)
    assert (ended.object, ended.x_i, ended.x_f) == ('pear', RIGHT, RIGHT)
    assert (ended.manner, ended.direction) == (Manner.PLACE, Attempt.UNKNOWN)
    assert ended.world == WORLD.label
    assert acts == []
    last, goals = beliefs[-1], JointGoals.of(WORLD, shipped())
    watcher = goals.watch(states)
    before = watcher.marginal('pear')
    # On a slow machine frames are missing, and the manner is less sure.
    manner = Manner.PLACE if ended.manner_probability >= SURE_MANNER else None
    for event in (Event('pear', RIGHT, RIGHT, manner), Stopped()):
        watcher.see(event)
    believed = np.reshape(last.marginals, (len(goals.objects), len(before)))
    expected = [watcher.marginal(name) for name in goals.objects]
    np.testing.assert_allclose(believed, expected, atol=1e-3)
    assert abs(believed[goals.objects.index('pear')] - before).max() > 0.1
    assert last.unexplained == 0
    assert last.sentence.startswith('The person has stopped: I ')
