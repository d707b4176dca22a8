"""The simulated cell: physics, arm, person, objects and camera."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from likeme_arm.hold_monitor import Block
from likeme_arm.motion import ObjectView, OthersOf, PrimitiveResult, ViewOf, no_others
from likeme_arm.primitive_poses import PrimitiveSettings
from likeme_arm.primitives import check_names, check_target, execute_action, retreat
from likeme_arm_sim.arm import Arm
from likeme_arm_sim.calibration_error import MiscalibratedMotion, draw_calibration_offset
from likeme_arm_sim.camera import CellCamera
from likeme_arm_sim.hand_shapes import Side
from likeme_arm_sim.human_hand import HumanHand
from likeme_arm_sim.kinect import RgbdImages
from likeme_arm_sim.kinect_noise import KinectNoise
from likeme_arm_sim.kinematics import Kinematics
from likeme_arm_sim.layout import Placement, checked_states, draw_layout
from likeme_arm_sim.motion_control import MotionController, OnTick
from likeme_arm_sim.physics import Physics, fitted_primitives
from likeme_arm_sim.physics_world import TIME_STEP, PhysicsWorld
from likeme_arm_sim.renderer import PaintedPlane
from likeme_arm_sim.simulated_person import PersonSettings, SimulatedPerson
from likeme_arm_sim.toys import toys_of
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Action, State
from likeme_core.world import World

# For objects to come to rest after they were put down, s.
SETTLING_TIME = 0.6
# Separates the arm's random stream from the layout's, which is drawn from the seed alone.
ARM_STREAM = 1


class MotionResult(NamedTuple):
    """How a motion ended; its start and end in simulated s (None: nothing moved)."""

    outcome: MotionOutcome
    message: str
    started: float | None = None
    finished: float | None = None


@dataclass(frozen=True)
class CellSettings:
    """Settings of a cell.

    Attributes:
        arm_speed, human_speed: factors on the default speeds.
        noise: of the camera; None: the published model.
        initial_states: of objects, in the last reachable region if not named; None: the world's.
        primitives: parameters of the robot's actions.
        physics: masses, frictions and forces.
    """

    arm_speed: float = 1.0
    human_speed: float = 1.0
    noise: KinectNoise | None = None
    initial_states: Mapping[str, State] | None = None
    primitives: PrimitiveSettings = field(default_factory=fitted_primitives)
    physics: Physics = field(default_factory=Physics)


class Cell:
    """One table with one robot and one person. Only `hold`, `resume`, `block` are thread-safe."""

    def __init__(
        self,
        world: World,
        seed: int,
        settings: CellSettings | None = None,
        arm_visible: bool = True,
        block: Callable[[], Block | None] = lambda: None,
        lying: Sequence[PaintedPlane] = (),
        person: bool = True,
        change: Callable[[], int] = lambda: 0,
    ) -> None:
        """Build the cell.

        Args:
            world: its table, objects, regions and actions.
            seed: of places, camera noise, arm and person.
            settings: None: the defaults.
            arm_visible: whether the camera sees the arm; a real one stands elsewhere.
            block: why nothing may move, see MotionController.
            change: number of the last hold or resume, see MotionController.
            lying: sheets on the table that the camera sees.
            person: whether there is one; physics without the person's hands is faster.
        """
        self.world, self.settings = world, settings or CellSettings()
        self._rng = np.random.default_rng(seed)
        self._arm_rng = np.random.default_rng([seed, ARM_STREAM])
        physics, speed = self.settings.physics, self.settings.arm_speed
        kinematics = Kinematics(physics.arm.reach)
        self.physics_world = PhysicsWorld(world.table, toys_of(world), physics)
        self._controller = MotionController(self.physics_world, block, change)
        tick = self._controller.tick
        self.arm = Arm(self.physics_world.client, kinematics, tick, speed, physics.gripper)
        self.hand = HumanHand(self.physics_world, tick, Side if person else ())
        pace = PersonSettings(speed=self.settings.human_speed)
        self._person = SimulatedPerson(self.physics_world, self.hand, world, pace)
        self._camera_seed, self._arm_visible, self._lying = seed, arm_visible, lying
        self._initial_layout = draw_layout(world, self._initial_states(), [], self._rng)
        self._apply_layout(self._initial_layout)
        self._initial_state = self.physics_world.save()

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.physics_world.time

    @property
    def block(self) -> Block | None:
        """Why nothing may move; None: motion is allowed."""
        return self._controller.block

    @property
    def change(self) -> int:
        """Number of the last hold or resume that was heard."""
        return self._controller.change

    def hold(self) -> None:
        """Stop all motion before the next control step; may be called from any thread."""
        self._controller.hold()

    def resume(self) -> None:
        """Allow motion again; may be called from any thread."""
        self._controller.resume()

    def step(self, seconds: float = TIME_STEP, on_tick: OnTick | None = None) -> None:
        """Step the physics without a motion of arm or person."""
        for _ in range(max(1, round(seconds / TIME_STEP))):
            self.physics_world.step()
            if on_tick is not None:
                on_tick()

    def run_action(
        self,
        actor: Actor,
        name: str,
        action: int | str,
        look: ViewOf,
        on_tick: OnTick | None = None,
        budget: float = np.inf,
        cancelled: Callable[[], bool] = lambda: False,
        others: OthersOf = no_others,
        share: float = 1.0,
    ) -> MotionResult:
        """Execute an action on an object; returns when the motion has ended.

        Args:
            actor: the robot, which uses `look`, or the person, who uses the true poses.
            name: an object of the world.
            action: the number or the name of an action of the world.
            look: the perceived view of an object, called repeatedly while pushing.
            on_tick: called after every physics step of the motion.
            budget: simulated seconds after which the motion is stopped.
            cancelled: whether this motion is to stop, asked at every control step.
            others: the perceived views of all other objects, of which the robot stays clear.
            share: of the way, after which the person gives up.
        """
        refused = self._refused(actor, name, action, look)
        if refused is not None:
            return MotionResult(*refused)
        started = self.time
        ending = self._controller.run(
            lambda: self._act(actor, name, self.world.action(action), look, others, share),
            self._halt,
            on_tick,
            budget,
            cancelled,
        )
        moved = self.time > started
        return MotionResult(*ending, *((started, self.time) if moved else (None, None)))

    def clear_table(self, on_tick: OnTick | None = None) -> PrimitiveResult:
        """Move hand and arm off the table, as after a held motion."""

        def leave() -> PrimitiveResult:
            self._retract(Actor.HUMAN)
            self._retract(Actor.ROBOT)
            return PrimitiveResult(MotionOutcome.COMPLETED, 'Hand and arm have left the table.')

        return self._controller.run(leave, self._halt, on_tick)

    def reset(self, objects: Sequence[str], states: Sequence[int | str], seed: int) -> None:
        """Put objects into states at places drawn by `seed`; both empty: the initial layout.

        Raises:
            ValueError: unknown objects or states, or not one state an object.
        """
        wanted = checked_states(self.world, objects, states)
        self._arm_rng = np.random.default_rng([seed, ARM_STREAM])
        self.arm.reset()
        self.hand.reset()
        if not wanted:
            self._apply_layout(self._initial_layout)
            return
        rest = [name for name in self.world.objects if name not in wanted]
        occupied = [self.physics_world.toy_pose(name).position[:2] for name in rest]
        self._apply_layout(draw_layout(self.world, wanted, occupied, np.random.default_rng(seed)))

    def restart(self, seed: int) -> None:
        """Return to the initial state; what follows depends on `seed` alone.

        Two cells made with the same arguments then behave identically to the last bit, whatever
        the robot did before. A person's grip adds and removes a constraint, after which bullet
        solves the others in another order: after a grip they are identical except for rounding.
        """
        self._controller.resume()
        # A grip is a constraint that the saved state does not have.
        self.hand.reset()
        self.physics_world.restart(self._initial_state)
        self.arm.reset()
        self.hand.reset()
        self._rng = np.random.default_rng(seed)
        self._arm_rng = np.random.default_rng([seed, ARM_STREAM])
        self._camera.restart(seed)

    def frame(self) -> RgbdImages:
        """The present frame of the Kinect."""
        return self._camera.frame()

    @cached_property
    def _camera(self) -> CellCamera:
        """Built on first use: headless trials do not need it."""
        noise, seed = self.settings.noise, self._camera_seed
        arm = self.arm if self._arm_visible else None
        return CellCamera(self.world, self.physics_world, arm, self.hand, noise, seed, self._lying)

    def true_states(self) -> dict[str, ObjectView]:
        """The true poses of the objects: for tests and benchmarks, never for a decision."""
        return {name: self._true_view(name) for name in self.world.objects}

    def _true_view(self, name: str) -> ObjectView:
        pose = self.physics_world.toy_pose(name)
        x, y, z = map(float, pose.position)
        axis = pose.matrix()[:2, 0]
        yaw = float(np.arctan2(axis[1], axis[0]))
        return ObjectView(x, y, yaw, self.world.regions.state_of(x, y, z))

    def _halt(self) -> None:
        self.arm.halt()
        self.hand.halt()

    def _refused(
        self, actor: Actor, name: str, action: int | str, look: ViewOf
    ) -> PrimitiveResult | None:
        refused = check_names(self.world, name, action)
        if refused is not None:
            return refused
        block = self.block
        if block is not None:
            return PrimitiveResult(MotionOutcome.HELD, block.sentence)
        return check_target(self.world, name, look(name)) if actor is Actor.ROBOT else None

    def _act(
        self, actor: Actor, name: str, action: Action, look: ViewOf, others: OthersOf,
        share: float,
    ) -> PrimitiveResult:  # fmt: skip
        self._retract(Actor.ROBOT)
        self._retract(Actor.HUMAN)
        if actor is Actor.HUMAN:
            return self._person.perform(name, action, self._rng, share)
        accuracy = self.settings.physics.arm
        offset, centre = (
            draw_calibration_offset(accuracy, self._arm_rng),
            self.world.regions.work_area.centre,
        )
        arm = MiscalibratedMotion(self.arm, offset, accuracy.skew, centre)
        settings = self.settings.primitives
        return execute_action(arm, look, self.world, name, action, settings, others)

    def _retract(self, actor: Actor) -> None:
        if actor is Actor.HUMAN and not self.hand.away:
            self._person.withdraw()
        if actor is Actor.ROBOT and not self.arm.at_home:
            retreat(self.arm, self.world.table, self.settings.primitives)

    def _initial_states(self) -> dict[str, State]:
        world, given = self.world, self.settings.initial_states
        last = [state for state in world.states if state not in world.out_of_reach][-1]
        states = dict.fromkeys(world.objects, last)
        if given is None:
            own = {item.name: item.start for item in world.object_entries}
            return states | {name: state for name, state in own.items() if state is not None}
        return states | checked_states(world, list(given), list(given.values()))

    def _apply_layout(self, layout: Mapping[str, Placement]) -> None:
        for name, place in layout.items():
            self.physics_world.put_toy(name, place.x, place.y, place.ground, place.yaw)
        self.step(SETTLING_TIME)
