"""Learning from executed imitations: their outcomes are recorded as trials."""

from __future__ import annotations

from likeme_core.outcomes import Actor
from likeme_inference.experience.model_from_trials import model_of_rows, rows_of, source_of
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import COUNTED, Pair, Trial, TrialKey, check_name
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.values import Decision, Outcome

#: Campaign name of executed imitations.
IMITATION = 'imitation'


def trial_of_outcome(
    robot: str, version: str, decision: Decision, outcome: Outcome
) -> Trial | None:
    """The trial of an executed decision; None if it does not count as one.

    It does not count if the robot did not act, if the motion was stopped or not started, or if the
    camera did not observe the final state.

    Raises:
        ValueError: the outcome of another decision.
    """
    if outcome.decision_id != decision.id:
        raise ValueError(
            f'Expected the outcome of decision {decision.id}, got that of {outcome.decision_id}.'
        )
    action, x_f, motion = outcome.action, outcome.x_f, outcome.motion
    if outcome.actor is not Actor.ROBOT or action is None or x_f is None or motion not in COUNTED:
        return None
    # Decision numbers restart with the node; the stamp makes the key unique.
    pair, repetition = Pair(decision.object, decision.x_i, action), decision.stamp + decision.id
    key = TrialKey(robot, IMITATION, pair, repetition)
    assert motion is not None, 'Counted motions have an outcome.'
    return Trial(key, x_f, motion, 0, version, outcome.stamp)


class ImitationExperience:
    """A model that is extended by the recorded executed imitations of one robot."""

    def __init__(
        self, store: ExperienceStore, robot: str, version: str, learned: RobotModel
    ) -> None:
        """learned: the model at the start, e.g. of a model file.

        Raises:
            ValueError: the robot or an object has a name that no trial can have.
            StoreError: the store cannot be read.
        """
        for name in (robot, *learned.objects):
            check_name(name)
        self._store, self._robot, self._version = store, robot, version
        self._learned = learned
        self.model = self._with_imitations()

    def record_outcome(self, decision: Decision, outcome: Outcome) -> RobotModel | None:
        """Record the outcome of a decision; the extended model, None if it does not count.

        Raises:
            ValueError: the outcome of another decision.
            StoreError: it cannot be recorded; the model is unchanged.
        """
        trial = trial_of_outcome(self._robot, self._version, decision, outcome)
        if trial is None:
            return None
        self._store.record([trial])
        self.model = self._with_imitations()
        return self.model

    def _with_imitations(self) -> RobotModel:
        """The model with the recorded imitations, which replace its rows of the same source."""
        tallies = self._store.tallies([self._robot], [IMITATION])
        fresh = {source_of(tally) for tally in tallies}
        kept = tuple(row for row in self._learned.rows if row.source not in fresh)
        rows = rows_of(tallies, self._store.world)
        if not rows:
            return self._learned
        added = model_of_rows(self._learned.name, rows, self._store.world)
        used = {row.source for row in kept}
        sources = {key: text for key, text in self._learned.sources.items() if key in used}
        version = f'{self._learned.version}+{added.version}'
        sources |= added.sources
        return RobotModel(
            self._learned.name, version, sources, kept + rows, added.domain, self._learned.left_out
        )
