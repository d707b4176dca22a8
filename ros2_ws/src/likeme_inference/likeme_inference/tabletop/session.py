"""The imitation session: the state machine from a demonstration to its outcome.

    IDLE --demonstration--> TURN --object settled off the goal--> ACTING or ASKING
    ACTING --motion ended--> CONFIRMING --settled view--> IDLE
    ASKING --try--> ACTING;  --done by hand--> CONFIRMING;  --skip--> IDLE
    CONFIRMING --missed, in sequential mode--> TURN, with one action less

In TURN an object at its goal gives one AT_GOAL decision; the session then waits until the object
is put back, by the person or a reset. A demonstration that moves the same object back is taken as
that, not as a new goal; any other demonstration replaces the belief. While a decision is under way
(ACTING, ASKING, CONFIRMING) demonstrations are ignored, with a Remark: those of an object the
robot asked about are the requested help, others have to be repeated. TURN ends after
`turn_timeout`.

In sequential mode a miss is followed by another decision with the actions left, until the goal is
reached or the robot asks; not after an answer, a hold, or a motion of unknown outcome.

Time is the stamps (ns) of the table states. No ROS, no clock, no thread.
"""

from __future__ import annotations

import math

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Mode, State
from likeme_inference.tabletop import sentences
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import (
    ImitationSettings,
    believe,
    can_infer,
    decide,
    no_trials,
)
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.session_state import Phase, SessionState
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    MotionReport,
    Outcome,
    Remark,
    Reply,
    Result,
)

SECOND = 1_000_000_000
#: A stamp older than the last by more is not a late frame: time restarted (a bag, a new cell).
TIME_JUMP = 1 * SECOND
#: Motions after which the sequential mode does not go on by itself.
STOPPED = (MotionOutcome.HELD, MotionOutcome.FAILED, MotionOutcome.LOST)


class ImitationSession:
    """One robot that imitates one demonstration at a time.

    Attributes:
        settings: used from the next decision on.
        model: the robot's own experience; used from the next decision on.
        state: where it is; may be kept, and set to go on from there.
    """

    def __init__(
        self,
        model: RobotModel,
        settings: ImitationSettings | None = None,
        state: SessionState | None = None,
    ) -> None:
        self.settings = settings or ImitationSettings()
        self.model = model
        self.state = state or SessionState()

    @property
    def phase(self) -> Phase:
        """The current phase."""
        return self.state.phase

    @property
    def decision(self) -> Decision | None:
        """The last decision, and the one under way while ACTING, ASKING or CONFIRMING."""
        return self.state.decision

    @property
    def last_view(self) -> int:
        """Stamp of the latest table state, ns."""
        return self.state.last_view

    def observe_demonstration(self, demo: Demonstration) -> GoalBelief | Decision | Remark:
        """Process a demonstration: a new goal, or part of the current decision.

        An object without trials leads to a decision for no action, unless a prior is set.
        """
        if self.state.phase in (Phase.ACTING, Phase.ASKING, Phase.CONFIRMING):
            return self._ignore(demo)
        if self.state.closed is not None:
            name, until = self.state.closed
            if demo.object == name and demo.start <= until:
                return Remark(f'{_change(demo)} belongs to the decision that is over.')
        if self.state.phase is Phase.TURN and self._is_put_back(demo):
            self.state.put_back, self.state.turn_from = True, demo.stamp
            return Remark(f'{demo.object} was put back to {demo.x_f.name}: my turn.')
        if not can_infer(self.model, self.settings, demo.object):
            number = self.state.decisions + 1
            return self._begin(no_trials(self.model, self.settings, demo, number), Phase.IDLE)
        belief = believe(self.model, self.settings, demo)
        here = self.state
        here.phase, here.demonstration, here.turn_from = Phase.TURN, demo, demo.stamp
        here.at_goal_reported, here.put_back, here.off_goal_since = False, False, None
        here.spent = 0
        return belief

    def look(self, view: TableSnapshot) -> Decision | Outcome | Remark | None:
        """Process a table state; older ones than the last are dropped."""
        age = self.state.last_view - view.stamp
        if age > 0:
            return self._time_jumped(view) if age > TIME_JUMP else None
        self.state.latest, self.state.last_view = view, view.stamp
        if self.state.resumed_at is None:
            self.state.resumed_at = view.stamp
        if self.state.phase is Phase.TURN:
            return self._take_turn(view)
        if self.state.phase is Phase.CONFIRMING:
            return self._confirm(view)
        return None

    def look_again(self) -> Decision | Outcome | Remark | None:
        """Process the latest table state again, after a demonstration of the same frame."""
        return None if self.state.latest is None else self.look(self.state.latest)

    def motion_finished(self, report: MotionReport) -> Outcome | None:
        """Process the arm's report; None if the camera decides the outcome."""
        decision = self._under_way(Phase.ACTING)
        if report.outcome is None or not report.outcome.moved:
            assert decision.action is not None, 'Only actions are executed.'
            why = sentences.arm_failed(decision.object, decision.action, report.message)
            return self._close(Result.ARM_FAILED, motion=report.outcome, sentence=why)
        self.state.phase, self.state.motion = Phase.CONFIRMING, report.outcome
        self.state.motion_end = report.finished or self.state.last_view
        return None

    def answered(self, reply: Reply) -> Outcome | None:
        """Process the operator's reply; after TRY_ANYWAY the caller executes `decision.action`."""
        self._under_way(Phase.ASKING)
        if reply is Reply.SKIP:
            return self._close(Result.SKIPPED)
        if reply is Reply.TRY_ANYWAY:
            self.state.phase, self.state.actor = Phase.ACTING, Actor.ROBOT
        else:
            self.state.phase, self.state.actor = Phase.CONFIRMING, Actor.HUMAN
            self.state.motion_end = self.state.last_view
        return None

    def nothing_seen(self) -> Outcome:
        """Close the decision when no table state arrives."""
        self._under_way(Phase.CONFIRMING)
        return self._close(Result.NOT_SEEN)

    @property
    def _demonstrated(self) -> Demonstration:
        demo = self.state.demonstration
        assert demo is not None, 'There is a demonstration in every phase but IDLE.'
        return demo

    def _under_way(self, phase: Phase) -> Decision:
        if self.state.phase is not phase or self.state.decision is None:
            raise ValueError(f'Expected the session in {phase.name}, got {self.state.phase.name}.')
        return self.state.decision

    def _is_put_back(self, demo: Demonstration) -> bool:
        late = demo.stamp - self._demonstrated.stamp > self.settings.turn_timeout * SECOND
        return demo.undoes(self._demonstrated) and not late

    def _ignore(self, demo: Demonstration) -> Remark:
        decision = self._under_way(self.state.phase)
        if demo.start <= decision.stamp and self._is_put_back(demo):
            return Remark(f'{demo.object} was put back to {demo.x_f.name}: I am at it already.')
        helped = self.state.phase is Phase.ASKING or self.state.actor is Actor.HUMAN
        if helped and demo.object == decision.object:
            return Remark(f'{_change(demo)} is the help I asked for in request {decision.id}.')
        return Remark(
            f'{_change(demo)} is left aside: decision {decision.id} on {decision.object} is under '
            'way. Please show it again afterwards.'
        )

    def _take_turn(self, view: TableSnapshot) -> Decision | Remark | None:
        demo, settings, here = self._demonstrated, self.settings, self.state
        if view.stamp - here.turn_from > settings.turn_timeout * SECOND:
            here.phase = Phase.IDLE
            return Remark(
                f'Nobody put {demo.object} back within {settings.turn_timeout:g} s: I let it be.'
            )
        if not can_infer(self.model, settings, demo.object):
            # The model was replaced since the demonstration.
            here.phase = Phase.IDLE
            return Remark(
                f'{self.model.label} has no trials of {demo.object}: its demonstration is dropped.'
            )
        old = view.stamp < here.turn_from
        if old or not view.settled or demo.object not in view.states:
            here.off_goal_since = None
            return None
        decision = decide(self.model, settings, demo, view, here.decisions + 1, here.spent)
        if decision.kind is Kind.AT_GOAL and here.spent:
            return self._begin(decision, Phase.IDLE)
        if decision.kind is Kind.AT_GOAL:
            here.off_goal_since = None
            reported, here.at_goal_reported = here.at_goal_reported, True
            return None if reported else self._begin(decision, Phase.TURN)
        if here.off_goal_since is None:
            here.off_goal_since = view.stamp
        waited = view.stamp - here.off_goal_since
        if not here.put_back and waited < settings.turn_delay * SECOND:
            return None
        phases = {Kind.EXECUTE: Phase.ACTING, Kind.ASK_HUMAN: Phase.ASKING}
        return self._begin(decision, phases.get(decision.kind, Phase.IDLE))

    def _begin(self, decision: Decision, phase: Phase) -> Decision:
        here = self.state
        here.decision, here.phase, here.decisions = decision, phase, decision.id
        here.actor = Actor.ROBOT if phase is Phase.ACTING else Actor.NOBODY
        here.motion, here.resumed_at = None, 0
        here.spent += decision.kind is Kind.EXECUTE
        return decision

    def _confirm(self, view: TableSnapshot) -> Outcome | None:
        decision = self._under_way(Phase.CONFIRMING)
        if view.stamp <= self.state.motion_end:
            return None
        x_f = view.states.get(decision.object)
        if view.settled and x_f is not None:
            result = Result.REACHED if x_f == decision.goal else Result.MISSED
            outcome = self._close(result, view, x_f)
            if result is Result.MISSED and self._continues(decision):
                here = self.state
                here.phase, here.turn_from, here.put_back = Phase.TURN, view.stamp, True
            return outcome
        waited = view.stamp - max(self.state.motion_end, self.state.resumed_at or 0)
        late = waited > self.settings.outcome_timeout * SECOND
        return self.nothing_seen() if late else None

    def _continues(self, decision: Decision) -> bool:
        """Whether a miss is followed by another decision."""
        stopped = self.state.motion in STOPPED
        autonomous = decision.kind is Kind.EXECUTE and not stopped
        return decision.mode is Mode.SEQUENTIAL and autonomous

    def _time_jumped(self, view: TableSnapshot) -> Outcome | Remark | None:
        self.state.latest, self.state.last_view = view, view.stamp
        self.state.closed, self.state.resumed_at = None, 0
        if self.state.phase is Phase.CONFIRMING:
            return self.nothing_seen()
        if self.state.phase is Phase.TURN:
            self.state.phase = Phase.IDLE
            return Remark('Time jumped back: I forget the demonstration I saw before.')
        return None

    def _close(
        self,
        result: Result,
        view: TableSnapshot | None = None,
        x_f: State | None = None,
        motion: MotionOutcome | None = None,
        sentence: str = '',
    ) -> Outcome:
        """Close the decision under way."""
        decision = self._under_way(self.state.phase)
        motion = self.state.motion if motion is None else motion
        by_robot = self.state.actor is Actor.ROBOT
        header = view or decision
        self.state.phase, self.state.closed = Phase.IDLE, (decision.object, self.state.last_view)
        return Outcome(
            header.stamp, header.frame, decision.id, decision.object, decision.x_i, decision.goal,
            x_f, result, self.state.actor, decision.action if by_robot else None,
            decision.predicted_success if by_robot else math.nan, motion,
            sentence or sentences.outcome(decision, result, self.state.actor, x_f, motion),
        )  # fmt: skip


def _change(demo: Demonstration) -> str:
    return f'{demo.object} from {demo.x_i.name} to {demo.x_f.name}'
