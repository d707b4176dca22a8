"""One trial of the robot without nodes and images: for parameter searches and benchmarks.

Perception is replaced by true poses with an error and with occlusion by the gripper.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from likeme_arm.motion import ObjectView
from likeme_arm_sim.cell import Cell, CellSettings, MotionResult
from likeme_arm_sim.physics import (
    ArmAccuracy,
    GripperPhysics,
    Physics,
    fitted_fields,
    fitted_primitives,
)
from likeme_arm_sim.toys import toys_of
from likeme_core.geometry import Rectangle
from likeme_core.outcomes import Actor
from likeme_core.tabletop import Action, State
from likeme_core.world import World
from likeme_core.world.values import Heading, PushTarget, RegionEntry

# Separates the random stream of perception from the cell's, which is drawn from the seed alone.
PERCEPTION_STREAM = 2
# After the motion: greatest time to wait for rest, s, speed at rest, m/s, and time between two
# checks, s.
REST_TIMEOUT, REST_SPEED, REST_PERIOD = 4.0, 0.002, 0.1


@dataclass(frozen=True)
class PerceptionNoise:
    """Perceived minus true pose, as measured with perception in the cell.

    Attributes:
        bias: of the centroid, x and y, m.
        noise: its standard deviation, m, drawn once a trial.
        turn: standard deviation of the axis, rad, drawn once a trial.
    """

    bias: tuple[float, float] = (0.0, 0.0015)
    noise: float = 0.002
    turn: float = 0.05


# The gripper in its own frame, m: half extents along and across its flat axis, and the heights
# above the grasp point where it begins and ends.
HAND_HALF = (0.032, 0.104)
HAND_SPAN = (0.045, 0.20)
# Number of heights at which occlusion is tested, and the height of a toy's centre, m.
HAND_SLICES, TOY_MIDDLE = 6, 0.025


class SimulatedPerception:
    """Views of objects during one trial, with a constant error."""

    def __init__(self, cell: Cell, seed: int, error: PerceptionNoise | None = None) -> None:
        error = error or PerceptionNoise()
        rng = np.random.default_rng([seed, PERCEPTION_STREAM])
        self._cell, self._toys = cell, toys_of(cell.world)
        self._shift = rng.normal(0.0, error.noise, 2) + error.bias
        self._turn = float(rng.normal(0.0, error.turn))

    def look(self, name: str) -> ObjectView:
        """The perceived view; its state is None while the gripper occludes the centre."""
        true = self._cell.true_states()[name]
        x, y = true.x + float(self._shift[0]), true.y + float(self._shift[1])
        regions = self._cell.world.regions
        fallen = true.state == regions.elsewhere
        seen = regions.elsewhere if fallen else regions.state_of(x, y)
        state = None if self._hidden(true) else seen
        return ObjectView(x, y, true.yaw + self._turn, state, *self._extents(name, true.yaw))

    def others(self, name: str) -> dict[str, ObjectView]:
        """The perceived views of all objects but one."""
        return {other: self.look(other) for other in self._cell.world.objects if other != name}

    def _extents(self, name: str, yaw: float) -> tuple[float, float, float]:
        """Length and width along and across an axis, and height above the table, m."""
        pose = self._cell.physics_world.toy_pose(name).matrix()
        cloud = np.concatenate([part.vertices for part in self._toys[name].parts])
        x, y, z = pose[:3, :3] @ cloud.T + pose[:3, 3:]
        along, across = (
            math.cos(yaw) * x + math.sin(yaw) * y,
            math.cos(yaw) * y - math.sin(yaw) * x,
        )
        return float(np.ptp(along)), float(np.ptp(across)), float(z.max())

    def _hidden(self, toy: ObjectView) -> bool:
        """Whether the gripper intersects the ray from the camera to the toy's centre."""
        tool, camera = self._cell.arm.tool, self._cell.world.camera.position
        cos, sin = math.cos(tool.yaw), math.sin(tool.yaw)
        for share in range(HAND_SLICES):
            z = tool.z + HAND_SPAN[0] + share / (HAND_SLICES - 1) * (HAND_SPAN[1] - HAND_SPAN[0])
            up = (z - TOY_MIDDLE) / (camera[2] - TOY_MIDDLE)
            x = toy.x + up * (camera[0] - toy.x) - tool.x
            y = toy.y + up * (camera[1] - toy.y) - tool.y
            if abs(x * cos + y * sin) < HAND_HALF[0] and abs(y * cos - x * sin) < HAND_HALF[1]:
                return True
        return False


def world_from_parameters(world: World, values: Mapping[str, float]) -> World:
    """A world whose places and pushes follow from the fitted parameters."""
    return replace(
        world, region_entries=tuple(_region_from(entry, values) for entry in world.region_entries)
    )


def _region_from(entry: RegionEntry, values: Mapping[str, float]) -> RegionEntry:
    """place_share: of the way from an area's inner border to its outer one, along y."""
    if entry.area is None:
        angle = values['push_off_heading']
        push = PushTarget(entry.push.aim, (Heading(math.cos(angle), math.sin(angle), angle),))
        return replace(entry, push=push)
    bounds: Rectangle = entry.area.bounds
    inner, outer = sorted((bounds.y_min, bounds.y_max), key=abs)
    y = inner + (outer - inner) * values['place_share']
    return replace(entry, place=(entry.place[0], y))


def settings_from_parameters(world: World, values: Mapping[str, float]) -> CellSettings:
    """A cell's settings from values of all fitted parameters."""
    toys = {
        name: replace(toy.physics, **fitted_fields(name, values))
        for name, toy in toys_of(world).items()
    }
    arm = ArmAccuracy(
        bias_x=values['arm_bias_x'],
        skew=values['arm_skew'],
        noise=values['arm_noise'],
        reach=values['reach'],
    )
    gripper = GripperPhysics(force=values['grip_force'])
    return CellSettings(
        primitives=fitted_primitives(values),
        physics=Physics(toys=toys, gripper=gripper, arm=arm),
    )


def single_object_cell(world: World, name: str, settings: CellSettings | None = None) -> Cell:
    """A cell for fast trials: one object, no person, and an arm that skips free space."""
    settings = replace(settings or CellSettings(), initial_states={})
    cell = Cell(world.only(name), 0, settings, person=False)
    cell.arm.skip_free_space = True
    return cell


def fitted_cell(world: World, name: str, values: Mapping[str, float]) -> Cell:
    """A cell for fast trials with values of all fitted parameters."""
    settings = settings_from_parameters(world, values)
    return single_object_cell(world_from_parameters(world, values), name, settings)


def run_trial(
    cell: Cell, name: str, x_i: State, action: Action, seed: int,
    on_tick: Callable[[], None] | None = None, error: PerceptionNoise | None = None,
) -> tuple[State, MotionResult]:  # fmt: skip
    """Reset by seed, execute an action, wait for rest; the true final state and the result."""
    cell.reset([name], [x_i], seed)
    perception = SimulatedPerception(cell, seed, error)
    result = cell.run_action(Actor.ROBOT, name, action, perception.look, on_tick)
    wait_until_at_rest(cell, name, on_tick)
    state = cell.true_states()[name].state
    assert state is not None, 'The true state is always known.'
    return state, result


def wait_until_at_rest(cell: Cell, name: str, on_tick: Callable[[], None] | None = None) -> None:
    """Step until a toy has come to rest, or for REST_TIMEOUT."""
    for _ in range(round(REST_TIMEOUT / REST_PERIOD)):
        cell.step(REST_PERIOD, on_tick)
        if cell.physics_world.toy_speed(name) < REST_SPEED:
            break


def count_final_states(
    cell: Cell, name: str, x_i: State, action: Action, seeds: range
) -> tuple[int, ...]:
    """Number of trials that ended in each state."""
    ends = [run_trial(cell, name, x_i, action, seed)[0] for seed in seeds]
    return tuple(ends.count(state) for state in cell.world.states)
