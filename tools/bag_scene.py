"""Runs a bag recipe in the simulated cell and records its camera, without a network.

Perception and inference run as in the real graph, because the robot decides its own actions; the
reports of arm and operator go into the recording.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import camera_messages
from bag_recipes import Deed, Help, Mishap, Recipe, Robot, Set, Show, Wait
from likeme_arm.motion import ObjectView
from likeme_arm_sim.cell import Cell, CellSettings
from likeme_arm_sim.kinect_noise import KinectNoise
from likeme_bags.values import Record
from likeme_core.outcomes import Actor
from likeme_core.world import load_world
from likeme_experiments.learning.cell_perception import object_view
from likeme_inference.session_inputs import InputKind, SessionInput
from likeme_inference.tabletop.values import Reply
from likeme_replay.decision_log import LogEntry
from likeme_replay.in_process import InProcessGraph
from likeme_replay.input_scheduler import InputScheduler
from likeme_replay.recorded_inputs import HEARD, RecordedFrame

#: 2015-11-04, the day the paper was published: the clock of every recording begins then, ns.
EPOCH = 1_446_595_200_000_000_000
#: Physics steps between frames: 12 Hz.
STEPS_PER_FRAME = 20
#: The published depth noise, in turns of two patterns, and colours without grain: nearly all bytes
#: of a Kinect's recording are its noise.
NOISE = KinectNoise(colour=0.0, patterns=2)


class SuiteScene:
    """One recipe being run; `write` gets every record in order.

    Attributes:
        entries: demonstrations, beliefs, decisions and outcomes.
    """

    def __init__(self, recipe: Recipe, write: Callable[[Record], None]) -> None:
        pace = CellSettings(
            arm_speed=1.5, human_speed=1.3, noise=NOISE, initial_states=recipe.states
        )
        self._world = load_world(recipe.world)
        self.cell = Cell(self._world, recipe.seed, pace)
        self.entries: list[LogEntry] = []
        self._recipe, self._write = recipe, write
        world = {'world': recipe.world}
        self._graph, self._scheduler = InProcessGraph(world, world), InputScheduler(recorded=False)
        self._inputs = 0
        self._has_reports = any(isinstance(deed, Robot | Help) for deed in recipe.deeds)

    def play(self) -> None:
        """Do all deeds, one after another."""
        for deed in self._recipe.deeds:
            self._do(deed)

    def _do(self, deed: Deed) -> None:
        if isinstance(deed, Wait):
            self.cell.step(deed.seconds, self._tick)
        elif isinstance(deed, Show):
            self._show(deed)
        elif isinstance(deed, Set):
            self.cell.reset([deed.object], [int(deed.state)], self._recipe.seed)
        elif isinstance(deed, Robot):
            self._act()
        else:
            self._help(deed)

    @property
    def now(self) -> int:
        """The recording's clock, ns."""
        return EPOCH + round(self.cell.time * 1e9)

    def _show(self, deed: Show) -> None:
        def tick() -> None:
            if self._breaks_off(deed):
                self.cell.hold()
            self._tick()

        self.cell.run_action(Actor.HUMAN, deed.object, deed.action, self._look, tick)
        if self.cell.block is not None:
            self.cell.resume()
            self.cell.clear_table(self._tick)

    def _breaks_off(self, deed: Show) -> bool:
        x, y, z = self.cell.physics_world.toy_pose(deed.object).position
        hand = self.cell.hand.position
        over = abs(hand[0] - x) < 0.03 and abs(hand[1] - y) < 0.03
        breaks = {
            Mishap.NONE: False,
            Mishap.PASSES: over and hand[2] < 0.12,
            Mishap.LIFTS: z > 0.07,
            Mishap.DROPS_SHORT: z > 0.07 and -0.09 < y < 0.0,
            Mishap.DROPS_ACROSS: z > 0.07 and y > 0.09,
        }
        return bool(breaks[deed.mishap])

    def _act(self) -> None:
        decision = self._graph.session.decision
        assert decision is not None, 'The robot has no turn.'
        assert decision.action is not None, 'The robot has no action.'
        action = int(decision.action)
        ended = self.cell.run_action(Actor.ROBOT, decision.object, action, self._look, self._tick)
        finished = self.now if ended.finished is not None else 0
        self._report(
            InputKind.MOTION, motion_outcome=int(ended.outcome),
            finished=camera_messages.time_of(finished), message=ended.message,
        )  # fmt: skip

    def _help(self, deed: Help) -> None:
        decision = self._graph.session.decision
        assert decision is not None, 'The robot did not ask.'
        self._show(Show(decision.object, self._world.action_to(decision.goal)))
        self.cell.step(1.0, self._tick)
        self._report(InputKind.ANSWER, answer=int(Reply.DONE_BY_HAND), message=deed.name)

    def _tick(self) -> None:
        if self.cell.physics_world.steps % STEPS_PER_FRAME:
            return
        images, stamp = self.cell.frame(), self.now
        camera = self._world.camera
        records = camera_messages.frame_records(stamp, images.rgb, images.depth_mm, camera)
        info, colour, depth = records
        for record in records:
            self._write(record)
        ack = self._graph.show_frame(RecordedFrame(stamp, info, colour, depth))
        self.entries += ack.demonstrations
        self._scheduler.add_frame(stamp, ack)
        for item in self._scheduler.ready():
            self._apply(item)

    def _report(self, kind: InputKind, **fields: Any) -> None:
        message = SimpleNamespace(**fields)
        self._apply(SessionInput(kind, self._graph.session.last_view, message))

    def _apply(self, item: SessionInput) -> None:
        self.entries += self._graph.apply_input(item)
        self._inputs += 1
        if self._has_reports:
            data = camera_messages.heard(item, self._inputs)
            self._write(Record(HEARD, 'likeme_msgs/msg/Heard', self.now, data))

    def _look(self, name: str) -> ObjectView | None:
        table = self._graph.table
        return object_view(table.object(name)) if table is not None and table.learned else None
