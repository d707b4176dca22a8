"""Executed imitations are experience too: with their outcomes the model improves at work."""

from __future__ import annotations

from likeme_core.outcomes import Actor
from likeme_inference.experience.model_view import model_of_rows, rows_of, source_of
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import COUNTED, Pair, Trial, TrialKey
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.values import Decision, Outcome

#: The campaign of what was done in earnest.
IMITATION = 'imitation'


def trial_of_outcome(
    robot: str, version: str, decision: Decision, outcome: Outcome
) -> Trial | None:
    """The trial that an executed decision was; None if it says nothing about the robot's skill.

    That is when a person acted or nobody, when the motion was stopped or never begun, and when the
    camera did not see the end.

    Raises:
        ValueError: the outcome is another decision's.
    """
    if outcome.decision_id != decision.id:
        raise ValueError(
            f'Expected the outcome of decision {decision.id}, got that of {outcome.decision_id}.'
        )
    action, x_f, motion = outcome.action, outcome.x_f, outcome.motion
    if outcome.actor is not Actor.ROBOT or action is None or x_f is None or motion not in COUNTED:
        return None
    # Decisions are numbered anew at each start; their stamps tell those of two starts apart.
    pair, repetition = Pair(decision.object, decision.x_i, action), decision.stamp + decision.id
    key = TrialKey(robot, IMITATION, pair, repetition)
    assert motion is not None, 'A motion that counts is one.'
    return Trial(key, x_f, motion, 0, version, outcome.stamp)


class Experience:
    """What a working robot knows: the model it started with, and all it did in earnest since."""

    def __init__(
        self, store: ExperienceStore, robot: str, version: str, learned: RobotModel
    ) -> None:
        """learned: from before, e.g. of a model file."""
        self._store, self._robot, self._version = store, robot, version
        self._learned = learned
        self.model = self._with_imitations()

    def record_outcome(self, decision: Decision, outcome: Outcome) -> RobotModel | None:
        """Keep what an executed decision led to; the model with it, None if it was no trial.

        Raises:
            ValueError: the outcome is another decision's.
            StoreError: it cannot be kept; the model stays as it is.
        """
        trial = trial_of_outcome(self._robot, self._version, decision, outcome)
        if trial is None:
            return None
        self._store.record([trial])
        self.model = self._with_imitations()
        return self.model

    def _with_imitations(self) -> RobotModel:
        """Learned rows and those of imitations; of a source that is in both, the store's."""
        tallies = self._store.tallies([self._robot], [IMITATION])
        fresh = {source_of(tally) for tally in tallies}
        kept = tuple(row for row in self._learned.rows if row.source not in fresh)
        rows = rows_of(tallies)
        if not rows:
            return self._learned
        added = model_of_rows(self._learned.name, rows)
        used = {row.source for row in kept}
        sources = {key: text for key, text in self._learned.sources.items() if key in used}
        version = f'{self._learned.version}+{added.version}'
        return RobotModel(self._learned.name, version, {**sources, **added.sources}, kept + rows)
