"""One trial of self-experience without nodes and without images: for searches and benchmarks.

The camera is replaced by an error like perception's; what the gripper hides, it does not see.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from likeme_arm.motion import ObjectView
from likeme_arm_sim.cell import Cell, CellSettings, MotionResult
from likeme_arm_sim.physics import (
    TOY_PHYSICS,
    ArmAccuracy,
    GripperPhysics,
    Physics,
    fitted_fields,
    fitted_primitives,
)
from likeme_arm_sim.scene import Scene
from likeme_core.outcomes import Actor
from likeme_core.tabletop import Action, State

# Keeps the camera's chance apart from the cell's, which is drawn from the bare seed.
EYE_STREAM = 2
# After the motion: how long to wait at most for what rolls, s, and what counts as rest, m/s.
REST, STILL = 4.0, 0.002
CHECK = 0.1


@dataclass(frozen=True)
class PerceptionNoise:
    """Perceived minus true pose: as measured with the whole perception in the cell.

    Attributes:
        bias: of the centroid, x and y, m.
        noise: its standard deviation, m, drawn once a trial.
        turn: standard deviation of the axis, rad, drawn once a trial.
    """

    bias: tuple[float, float] = (0.0, 0.0015)
    noise: float = 0.002
    turn: float = 0.05


# The hand as the camera sees it, in its own frame, m: half extents along and across its flat axis,
# and how far above the grasp point it begins and ends.
HAND_HALF = (0.032, 0.104)
HAND_SPAN = (0.045, 0.20)
# At how many heights it is cut, and the height of a toy's middle, m.
HAND_SLICES, TOY_MIDDLE = 6, 0.025


class SimulatedPerception:
    """What perception would say about an object during one trial."""

    def __init__(self, cell: Cell, seed: int, error: PerceptionNoise | None = None) -> None:
        error = error or PerceptionNoise()
        rng = np.random.default_rng([seed, EYE_STREAM])
        self._cell = cell
        self._shift = rng.normal(0.0, error.noise, 2) + error.bias
        self._turn = float(rng.normal(0.0, error.turn))

    def look(self, name: str) -> ObjectView:
        """The perceived pose; its state None while the gripper hides the middle."""
        true = self._cell.true_states()[name]
        x, y = true.x + float(self._shift[0]), true.y + float(self._shift[1])
        seen = State.OFFTABLE
        if true.state is not State.OFFTABLE:
            seen = self._cell.scene.table.state_of(x, y)
        state = None if self._hidden(true) else seen
        return ObjectView(x, y, true.yaw + self._turn, state)

    def _hidden(self, toy: ObjectView) -> bool:
        """Whether the hand crosses the ray from the camera to the toy's middle."""
        tool, camera = self._cell.arm.tool, self._cell.scene.camera.position
        cos, sin = math.cos(tool.yaw), math.sin(tool.yaw)
        for share in range(HAND_SLICES):
            z = tool.z + HAND_SPAN[0] + share / (HAND_SLICES - 1) * (HAND_SPAN[1] - HAND_SPAN[0])
            up = (z - TOY_MIDDLE) / (camera[2] - TOY_MIDDLE)
            x = toy.x + up * (camera[0] - toy.x) - tool.x
            y = toy.y + up * (camera[1] - toy.y) - tool.y
            if abs(x * cos + y * sin) < HAND_HALF[0] and abs(y * cos - x * sin) < HAND_HALF[1]:
                return True
        return False


def settings_from_parameters(values: Mapping[str, float]) -> CellSettings:
    """A cell's settings with values of its own for all parameters of `fitted.py`."""
    toys = {name: replace(toy, **fitted_fields(name, values)) for name, toy in TOY_PHYSICS.items()}
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


def single_object_cell(name: str, settings: CellSettings | None = None) -> Cell:
    """A cell for fast trials: one object, and an arm that skips motion through free space."""
    settings = replace(settings or CellSettings(), initial_states={})
    cell = Cell(Scene(objects=(name,)), 0, settings)
    cell.arm.skip_free_space = True
    return cell


def run_trial(
    cell: Cell, name: str, x_i: State, action: Action, seed: int,
    on_tick: Callable[[], None] | None = None, error: PerceptionNoise | None = None,
) -> tuple[State, MotionResult]:  # fmt: skip
    """Put an object into `x_i` by seed, act, wait until it rests; its true state then."""
    cell.reset([name], [x_i], seed)
    eye = SimulatedPerception(cell, seed, error)
    result = cell.run_action(Actor.ROBOT, name, action, eye.look, on_tick)
    wait_until_at_rest(cell, name, on_tick)
    state = cell.true_states()[name].state
    assert state is not None, 'The truth is never covered.'
    return state, result


def wait_until_at_rest(cell: Cell, name: str, on_tick: Callable[[], None] | None = None) -> None:
    """Let time pass until a toy has come to rest, or for REST s."""
    for _ in range(round(REST / CHECK)):
        cell.step(CHECK, on_tick)
        if cell.world.toy_speed(name) < STILL:
            break


def count_final_states(
    cell: Cell, name: str, x_i: State, action: Action, seeds: range
) -> tuple[int, int, int]:
    """How often the object ended LEFT, RIGHT, OFFTABLE."""
    ends = [run_trial(cell, name, x_i, action, seed)[0] for seed in seeds]
    return ends.count(State.LEFT), ends.count(State.RIGHT), ends.count(State.OFFTABLE)
