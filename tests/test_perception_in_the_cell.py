"""Perception before the simulated cell: what it says, held against what is truly there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from likeme_arm.motion import ObjectView
from likeme_arm_sim.cell import Cell
from likeme_core.observations import Demonstration, ObservedAttempt
from likeme_core.outcomes import Actor
from likeme_core.paper_world import LEFT, PLACE_LEFT, PUSH_LEFT, RIGHT, WORLD
from likeme_core.tabletop import Action, Manner
from likeme_experiments.learning.cell_perception import CellPerception, object_view
from likeme_inference.joint_observer import JointObserver, JointSettings
from likeme_inference.tabletop.model_file import shipped
from likeme_perception.catalogue import world_catalogue
from likeme_perception.config import world_config
from likeme_perception.observation import TableObservation

FRAME_RATE = 15.0


class Watched:
    """A cell under perception's eyes."""

    def __init__(self, seed: int) -> None:
        self.cell = Cell(WORLD, seed)
        config = replace(world_config(WORLD), background_frames=10)
        self._eyes = CellPerception(self.cell, config, world_catalogue(WORLD), None)
        self.table: TableObservation | None = None
        self.acts: list[Demonstration] = []
        self.attempts: list[ObservedAttempt] = []
        self.seen_while: set[str] = set()
        self._due = 0.0

    def tick(self) -> None:
        """Look when a frame is due."""
        if self.cell.time < self._due:
            return
        self._due = self.cell.time + 1 / FRAME_RATE
        self.table = self._eyes.process_frame()
        self.acts += self.table.demonstrations
        self.attempts += self.table.attempts
        if self.table.hand_in_view:
            self.seen_while.add('hand')
        if self.table.arm_in_view:
            self.seen_while.add('arm')

    def look(self, name: str) -> ObjectView | None:
        """What the robot is told about an object."""
        return None if self.table is None else object_view(self.table.object(name))

    def do(self, actor: Actor, name: str, action: Action, share: float = 1.0) -> None:
        """Act, and let everything come to rest."""
        self.seen_while.clear()
        self.cell.run_action(actor, name, action, self.look, self.tick, share=share)
        self.cell.step(2.0, self.tick)

    def agrees(self) -> bool:
        """Whether every state perceived is the true one."""
        assert self.table is not None
        truth = self.cell.true_states()
        return all(int(o.state) == truth[o.name].state for o in self.table.objects)


@pytest.fixture
def watched() -> Watched:
    made = Watched(seed=4)
    made.cell.step(2.0, made.tick)
    return made


def test_the_settings_are_the_cells_numbers() -> None:
    config = world_config(WORLD)
    pose = config.camera_pose()
    assert pose is not None
    np.testing.assert_allclose(pose, WORLD.camera.pose(), atol=1e-5)
    assert (config.table, config.fallen_depth) == (WORLD.table.top, WORLD.table.thickness)
    assert tuple(o.name for o in world_catalogue(WORLD).objects) == WORLD.objects


def test_states_and_places_at_rest_are_the_true_ones(watched: Watched) -> None:
    assert watched.table is not None
    assert watched.table.settled
    assert watched.agrees()
    truth = watched.cell.true_states()
    for seen in watched.table.objects:
        there = truth[seen.name]
        assert np.hypot(seen.centroid[0] - there.x, seen.centroid[1] - there.y) < 0.008
        assert seen.identity_probability > 0.95


def test_a_persons_place_and_push_are_demonstrations(watched: Watched) -> None:
    watched.do(Actor.HUMAN, 'chicken', PLACE_LEFT)
    watched.do(Actor.HUMAN, 'pear', PUSH_LEFT)
    assert watched.agrees()
    assert watched.seen_while == {'hand'}
    found = [(a.object, a.x_i, a.x_f, a.manner) for a in watched.acts]
    assert found == [
        ('chicken', RIGHT, LEFT, Manner.PLACE),
        ('pear', RIGHT, LEFT, Manner.PUSH),
    ]


def test_the_robots_push_is_followed_and_is_no_demonstration(watched: Watched) -> None:
    watched.do(Actor.ROBOT, 'chicken', PUSH_LEFT)
    assert watched.agrees()
    assert watched.seen_while == {'arm'}
    assert watched.acts == watched.attempts == []
    assert watched.table is not None
    assert watched.table.settled


def test_a_person_who_fails_tells_what_was_meant(watched: Watched) -> None:
    """Meltzoff's failed attempt: pushed a part of the way and left there."""
    observer = JointObserver(WORLD, shipped(WORLD), JointSettings())
    assert watched.table is not None
    observer.look(watched.table.snapshot)
    watched.do(Actor.HUMAN, 'chicken', PUSH_LEFT, share=0.4)
    assert watched.agrees()
    assert watched.acts == []
    *begun, ended = watched.attempts
    assert {(a.object, a.x_i, a.x_f, a.under_way) for a in begun} == {
        ('chicken', RIGHT, None, True)
    }
    assert (ended.object, ended.x_i, ended.x_f, ended.manner, ended.direction) == (
        'chicken', RIGHT, RIGHT, Manner.PUSH, LEFT
    )  # fmt: skip
    waiting = [belief for a in watched.attempts for belief in observer.see(a)]
    beliefs = observer.look(watched.table.snapshot)
    assert waiting == []
    chicken = beliefs[0].objects.index('chicken')
    assert beliefs[-1].marginals[chicken, LEFT] > 0.8
    assert beliefs[-1].unexplained == 0
