"""Goals over all objects of a world, inferred while a person acts."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.typing import ArrayLike

from likeme_core.world import World
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.dirichlet import CONCENTRATION
from likeme_inference.tabletop.goal_space import GoalSpace
from likeme_inference.tabletop.joint_watcher import Watcher
from likeme_inference.tabletop.robot_model import RobotModel


def learned_transitions(
    world: World, model: RobotModel, concentration: float = CONCENTRATION
) -> dict[str, FloatArray]:
    """The robot's p(X_f | X_i, A) of each object of a world that it knows, shape [x_i, a, x_f].

    concentration: pseudo-count of every final state.
    """
    names = [name for name in world.objects if name in model.objects]
    return {name: model.counted(name, concentration).transition for name in names}


class JointGoals(GoalSpace):
    """The hypothesis space of goal_space.py, of which demonstrations are watched."""

    @classmethod
    def of(
        cls,
        world: World,
        model: RobotModel,
        concentration: float = CONCENTRATION,
        **options: object,
    ) -> JointGoals:
        """From a robot's trials; `options` as of the class.

        concentration: pseudo-count of every final state; with 0 an outcome that never occurred is
        impossible.
        """
        return cls(world, learned_transitions(world, model, concentration), **options)  # type: ignore[arg-type]

    def watch(self, start: Mapping[str, ArrayLike], person: ArrayLike | None = None) -> Watcher:
        """Begin to watch a demonstration.

        Args:
            start: state of each object: its number, or a distribution, shape [x].
            person: probability of each kind of people, shape [person]: the `person` of an earlier
                demonstration's watcher; None: `people_prior`.
        """
        return Watcher(self, start, person)
