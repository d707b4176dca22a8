"""The imitation session: the state machine from a demonstration to its outcome.

    IDLE --demonstration--> TURN --object settled off the goal--> ACTING or ASKING
    ACTING --motion ended--> CONFIRMING --settled view--> IDLE
    ACTING --not free, in a mode that asks--> TURN, without that action
    ASKING --try--> ACTING;  --done by hand--> CONFIRMING;  --skip--> IDLE;  --goal named--> TURN
    CONFIRMING --missed, in sequential mode--> TURN, with one action less

In TURN an object at its goal gives one AT_GOAL decision; the session then waits until the object
is put back, by the person or a reset. A demonstration that moves the same object back is taken as
that, not as a new goal; any other demonstration replaces the belief. TURN ends after
`turn_timeout`.

A question blocks nothing: a demonstration of another object suspends ASKING and begins a TURN. The
question stays open; its answer is carried out when no other decision is (ACTING, CONFIRMING), and
the turn that it interrupts goes on afterwards. Demonstrations during ACTING and CONFIRMING have to
be repeated, and those of an object that the robot asks about are the requested help: each gives a
Remark.

In sequential mode a miss is followed by another decision with the actions left, until the goal is
reached or the robot asks; not after an answer, a hold, or a motion of unknown outcome.

An action whose place or way was not free moved nothing: interactive and sequential mode decide
again without it, and ask for the way to be cleared if no other action is good enough. A goal that
the operator names is certain, and decided on again.

With joint goals (`goals: joint`) demonstrations have no turns of their own. The goal of a person
who has stopped is kept in IDLE until its objects are back; then they have a turn each.

Time is the stamps (ns) of the table states. No ROS, no clock, no thread.
"""

from __future__ import annotations

import math
from dataclasses import replace

from likeme_core.observations import Demonstration, TableSnapshot
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Mode, State
from likeme_inference.tabletop import sentences
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.asking import ASKING_MODES, Asking
from likeme_inference.tabletop.imitation import (
    Goals,
    ImitationSettings,
    believe,
    can_infer,
    decide,
    first_promise,
    meant_by,
    no_trials,
)
from likeme_inference.tabletop.promise import Promise
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.session_state import Phase, SessionState
from likeme_inference.tabletop.table_turn import is_back, next_of_table, posterior_of
from likeme_inference.tabletop.values import (
    BlockedAction,
    Decision,
    GoalBelief,
    MotionReport,
    Outcome,
    Remark,
    Reply,
    Result,
    TableGoal,
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
    def deciding_settings(self) -> ImitationSettings:
        """The settings, with the threshold that a promise has found, if one is kept."""
        if self.settings.asking is not Asking.PROMISE:
            return self.settings
        threshold = min(max(self._promise.threshold, 0.0), 1.0)
        return replace(self.settings, threshold=threshold)

    @property
    def kept_promise(self) -> Promise | None:
        """The promise that is kept; None: there is none."""
        return self._promise if self.settings.asking is Asking.PROMISE else None

    @property
    def given(self) -> tuple[float, ...]:
        """P(G) of the object that is decided on, where it does not follow from a demonstration.

        A goal that was named is certain; one of a joint goal has its probability.
        """
        here = self.state
        if here.named is not None:
            return tuple(float(g == here.named) for g in self.settings.world.states)
        return posterior_of(here.table, here.demonstration)

    @property
    def last_view(self) -> int:
        """Stamp of the latest table state, ns."""
        return self.state.last_view

    def observe_demonstration(self, demo: Demonstration) -> GoalBelief | Decision | Remark:
        """Process a demonstration: a new goal, or part of the current decision.

        An object without trials leads to a decision for no action, unless a prior is set.
        """
        here = self.state
        asked = here.question(demo.object)
        if asked is not None and asked is not here and asked.decision is not None:
            return _is_help(demo, asked.decision)
        if asked is not None or here.phase in (Phase.ACTING, Phase.CONFIRMING):
            return self._ignore(demo)
        if self.state.closed is not None:
            name, until = self.state.closed
            if demo.object == name and demo.start <= until:
                return Remark(f'{_change(demo)} belongs to the decision that is over.')
        if self.state.phase is Phase.TURN and self._is_put_back(demo):
            self.state.put_back, self.state.turn_from = True, demo.stamp
            return Remark(f'{demo.object} was put back to {demo.x_f.name}: my turn.')
        if self.settings.goals is Goals.JOINT:
            return self._note_joint(demo)
        if here.phase is Phase.ASKING:
            self._suspend()
            here.phase = Phase.IDLE
        if not can_infer(self.model, self.settings, demo.object):
            number = self.state.decisions + 1
            return self._begin(no_trials(self.model, self.settings, demo, number), Phase.IDLE)
        belief = believe(self.model, self.settings, demo)
        here.phase, here.demonstration, here.turn_from = Phase.TURN, demo, demo.stamp
        here.at_goal_reported, here.put_back, here.off_goal_since = False, False, None
        here.spent, here.blocked, here.named = 0, (), None
        here.table, here.done = None, ()
        return belief

    def observe_table_goal(self, goal: TableGoal) -> Remark:
        """Process a joint goal: it is imitated once its objects have been put back."""
        here, before = self.state, self.state.table
        if here.phase in (Phase.ACTING, Phase.CONFIRMING, Phase.ASKING):
            return Remark('I leave this goal aside, as I am at something else: show it again.')
        if here.closed is not None and goal.demonstration <= here.closed[1]:
            return Remark('What was done last belongs to the decision that is over.')
        if before is not None and not here.done and is_back(before, here.latest):
            here.put_back = True
            return Remark('The objects are back where they were: my turn.')
        here.phase, here.table, here.done = Phase.IDLE, goal, ()
        here.turn_from, here.put_back, here.off_goal_since = goal.stamp, False, None
        names = ', '.join(each.object for each in goal.goals)
        return Remark(f'Put it back ({names}), and I do what I saw was wanted.')

    def look(self, view: TableSnapshot) -> Decision | Outcome | Remark | None:
        """Process a table state; older ones than the last are dropped."""
        age = self.state.last_view - view.stamp
        if age > 0:
            return self._time_jumped(view) if age > TIME_JUMP else None
        self.state.latest, self.state.last_view = view, view.stamp
        if self.state.resumed_at is None:
            self.state.resumed_at = view.stamp
        if self.state.phase in (Phase.IDLE, Phase.ASKING):
            self._resume_turn()
        if self.state.phase is Phase.TURN:
            return self._take_turn(view)
        if self.state.phase is Phase.CONFIRMING:
            return self._confirm(view)
        if self.state.phase is Phase.IDLE and self.state.table is not None:
            return self._take_table_turn(self.state.table, view)
        return None

    def look_again(self) -> Decision | Outcome | Remark | None:
        """Process the latest table state again, after a demonstration of the same frame."""
        return None if self.state.latest is None else self.look(self.state.latest)

    def motion_finished(self, report: MotionReport) -> Outcome | None:
        """Process the arm's report; None if the camera decides the outcome."""
        decision = self._under_way(Phase.ACTING)
        if report.outcome is None or not report.outcome.moved:
            assert decision.action is not None, 'Only actions are executed.'
            self.state.motion = report.outcome
            goes_on = self._goes_on(Result.ARM_FAILED)
            say = sentences.not_begun if goes_on else sentences.arm_failed
            why = say(decision.object, decision.action, report.message)
            outcome = self._close(Result.ARM_FAILED, sentence=why)
            if goes_on:
                self._block(decision, report.message)
            return outcome
        self.state.phase, self.state.motion = Phase.CONFIRMING, report.outcome
        self.state.motion_end = report.finished or self.state.last_view
        return None

    def refusal(self, name: str, reply: Reply) -> str:
        """Why the question about an object cannot be answered so at present; empty: it can."""
        here, asked = self.state, self.state.question(name)
        if asked is None or asked.decision is None or reply is Reply.SKIP:
            return ''
        if here.phase in (Phase.ACTING, Phase.CONFIRMING) and here.decision is not None:
            return (
                f'Decision {here.decision.id} on {here.decision.object} is under way: answer '
                f'request {asked.decision.id} when it has ended.'
            )
        x_i, view = asked.decision.x_i, here.latest
        now = view.states.get(name, x_i) if view is not None and view.settled else x_i
        if reply is Reply.TRY_ANYWAY and now != x_i:
            return (
                f'{name} is {now.name} now, no longer {x_i.name} as when I asked: answer request '
                f'{asked.decision.id} by done or skip.'
            )
        return ''

    def answered(self, reply: Reply, name: str = '', goal: State | None = None) -> Outcome | None:
        """Process the operator's reply; after TRY_ANYWAY the caller executes `decision.action`.

        name: the object that the question is about; empty: the last question.
        goal: that NAME_GOAL names.

        Raises:
            ValueError: no such question is open, another decision is under way, or NAME_GOAL
                without a goal.
        """
        if (reply is Reply.NAME_GOAL) != (goal is not None):
            raise ValueError(
                f'Expected a goal with NAME_GOAL alone, got {goal} with {reply.name}.'
            )
        asked = self.state.question(name) if name else self.state
        if asked is not None and asked is not self.state:
            if reply is Reply.SKIP:
                return self._skip_suspended(asked)
            if refusal := self.refusal(name, Reply.DONE_BY_HAND):
                raise ValueError(refusal)
            if self.state.phase in (Phase.TURN, Phase.ASKING):
                self._suspend()
            self._take_up(asked, asked.decision)
        decision = self._under_way(Phase.ASKING)
        if name not in ('', decision.object):
            raise ValueError(f'Expected an open question, got an answer about {name}.')
        if reply is Reply.SKIP:
            return self._close(Result.SKIPPED)
        if reply is Reply.NAME_GOAL:
            self.state.named = goal
            outcome = self._close(Result.GOAL_NAMED)
            self._decide_anew()
            return outcome
        if reply is Reply.TRY_ANYWAY:
            self.state.phase, self.state.actor = Phase.ACTING, Actor.ROBOT
        else:
            self.state.phase, self.state.actor = Phase.CONFIRMING, Actor.HUMAN
            self.state.motion_end = self.state.last_view
        return None

    def named_belief(self) -> GoalBelief | None:
        """The belief in the goal that an operator named; None: none was, or no model knows it."""
        here = self.state
        if here.named is None or here.phase is not Phase.TURN:
            return None
        if not can_infer(self.model, self.settings, self._demonstrated.object):
            return None
        return believe(self.model, self.settings, self._demonstrated, self.given)

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

    def _suspend(self) -> None:
        """Keep the question or the turn that the session is at, to come back to it."""
        here = self.state
        here.suspended = (*here.suspended, replace(here, latest=None, suspended=()))

    def _take_up(self, kept: SessionState, decision: Decision | None) -> None:
        here = self.state
        self.state = replace(
            kept, decision=decision, decisions=here.decisions, latest=here.latest,
            last_view=here.last_view, closed=here.closed, resumed_at=here.resumed_at,
            promise=here.promise,
            suspended=tuple(other for other in here.suspended if other is not kept),
        )  # fmt: skip

    def _skip_suspended(self, asked: SessionState) -> Outcome:
        self.state.suspended = tuple(each for each in self.state.suspended if each is not asked)
        outcome = ImitationSession(self.model, self.settings, asked.copy()).answered(Reply.SKIP)
        assert outcome is not None, 'Skipping ends a decision.'
        self.state.closed = (outcome.object, self.state.last_view)
        return outcome

    def _ignore(self, demo: Demonstration) -> Remark:
        decision = self._under_way(self.state.phase)
        if demo.start <= decision.stamp and self._is_put_back(demo):
            return Remark(f'{demo.object} was put back to {demo.x_f.name}: I am at it already.')
        helped = self.state.phase is Phase.ASKING or self.state.actor is Actor.HUMAN
        if helped and demo.object == decision.object:
            return _is_help(demo, decision)
        return Remark(
            f'{_change(demo)} is left aside: decision {decision.id} on {decision.object} is under '
            'way. Please show it again afterwards.'
        )

    def _take_turn(self, view: TableSnapshot) -> Decision | Remark | None:
        demo, settings, here = self._demonstrated, self.settings, self.state
        if view.stamp - here.turn_from > settings.turn_timeout * SECOND:
            here.phase = Phase.IDLE
            nobody = f'Nobody put {demo.object} back'
            if demo.object not in view.states:
                nobody = f'The state of {demo.object} was not known'
            return Remark(f'{nobody} within {settings.turn_timeout:g} s: I let it be.')
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
        settings = self.deciding_settings
        number = here.decisions + 1
        decision = decide(
            self.model, settings, demo, view, number, here.spent, here.blocked, self.given
        )
        # The first state's number is 0: a goal that was named is one that is not None.
        followed = here.spent or here.blocked or here.named is not None
        if decision.kind is Kind.AT_GOAL and followed:
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

    def _note_joint(self, demo: Demonstration) -> GoalBelief | Remark:
        if not can_infer(self.model, self.settings, demo.object):
            return Remark(f'{self.model.label} has no trials of {demo.object}.')
        return believe(self.model, self.settings, demo)

    def _take_table_turn(self, table: TableGoal, view: TableSnapshot) -> Decision | Remark | None:
        """Decide on the next object of a joint goal once it was put back, see table_turn.py."""
        here, settings = self.state, self.deciding_settings
        if view.stamp - here.turn_from > settings.turn_timeout * SECOND:
            here.table = None
            return Remark(
                f'Nobody put the objects back within {settings.turn_timeout:g} s: I let it be.'
            )
        step = None
        if view.settled:
            number = here.decisions + 1
            step = next_of_table(self.model, settings, table, view, number, here.done)
        if step is None:
            here.off_goal_since = None
            if not view.settled or not here.done:
                return None
            here.table = None
            return Remark('I have done what I can for the goal that was shown.')
        if here.off_goal_since is None:
            here.off_goal_since = view.stamp
        waited = view.stamp - here.off_goal_since
        if not here.put_back and not here.done and waited < table.wait * SECOND:
            return None
        here.demonstration, here.turn_from = step.demonstration, view.stamp
        here.spent, here.blocked, here.named = 0, (), None
        phases = {Kind.EXECUTE: Phase.ACTING, Kind.ASK_HUMAN: Phase.ASKING}
        return self._begin(step.decision, phases.get(step.decision.kind, Phase.IDLE))

    def _begin(self, decision: Decision, phase: Phase) -> Decision:
        here = self.state
        here.decision, here.phase, here.decisions = decision, phase, decision.id
        here.actor = Actor.ROBOT if phase is Phase.ACTING else Actor.NOBODY
        here.motion, here.resumed_at = None, 0
        if phase is Phase.IDLE and here.table is not None:
            here.done = (*here.done, decision.object)
        here.spent += decision.kind is Kind.EXECUTE
        return decision

    def _block(self, decision: Decision, why: str) -> None:
        """Decide anew without an action that was not begun; it is not one that was spent."""
        here, action = self.state, decision.action
        assert action is not None, 'Only actions are executed.'
        others = (b for b in here.blocked if (b.x_i, b.action) != (decision.x_i, action))
        here.blocked = (*others, BlockedAction(decision.x_i, action, why))
        here.spent -= decision.kind is Kind.EXECUTE
        self._decide_anew()

    def _decide_anew(self) -> None:
        """Have the next table state lead to another decision on the same demonstration."""
        here = self.state
        here.phase, here.turn_from, here.put_back = Phase.TURN, here.last_view, True

    def _resume_turn(self) -> None:
        """Go on with the turn that the answer to a question interrupted, if there is one."""
        for kept in self.state.suspended:
            if kept.phase is Phase.TURN:
                if self.state.phase is Phase.ASKING:
                    self._suspend()
                self._take_up(kept, self.state.decision)

    def _confirm(self, view: TableSnapshot) -> Outcome | None:
        decision = self._under_way(Phase.CONFIRMING)
        if view.stamp <= self.state.motion_end:
            return None
        x_f = view.states.get(decision.object)
        if view.settled and x_f is not None:
            result = Result.REACHED if x_f == decision.goal else Result.MISSED
            outcome = self._close(result, view, x_f)
            if self._goes_on(result):
                self._decide_anew()
            return outcome
        waited = view.stamp - max(self.state.motion_end, self.state.resumed_at or 0)
        late = waited > self.settings.outcome_timeout * SECOND
        return self.nothing_seen() if late else None

    @property
    def _promise(self) -> Promise:
        """The promise of the current settings."""
        kept = self.state.promise
        if kept is None or kept.target != self.settings.promise:
            return first_promise(self.model, self.settings)
        return kept

    def _keep_promise(self, result: Result, x_f: State | None) -> str:
        """Take the end of an episode into account; a sentence on the promise."""
        skipped = result is Result.SKIPPED
        if self.settings.asking is not Asking.PROMISE or skipped or self._goes_on(result):
            return ''
        acted = self.state.actor is Actor.ROBOT
        seen = {Result.REACHED: 1.0, Result.MISSED: 0.0}.get(result)
        if acted and seen is not None and x_f is not None:
            seen = self._meant(x_f, seen)
        self.state.promise = self._promise.after(acted, seen)
        return f' I {self.state.promise.sentence}.'

    def _meant(self, x_f: State, inferred: float) -> float:
        """Probability that x_f was meant; `inferred`: whether it is the inferred goal."""
        demo, decision = self._demonstrated, self.state.decision
        confirmed = decision is not None and decision.kind is Kind.ASK_HUMAN
        # Who answers a question that names the goal by "try" has confirmed it.
        if confirmed or not can_infer(self.model, self.settings, demo.object):
            return inferred
        return meant_by(self.model, self.settings, demo, self.given)[x_f]

    def _goes_on(self, result: Result) -> bool:
        """Whether a result is followed by another decision on the same demonstration."""
        decision, motion = self.state.decision, self.state.motion
        if decision is None:
            return False
        if result is Result.ARM_FAILED:
            return motion is MotionOutcome.NOT_FREE and decision.mode in ASKING_MODES
        if result is Result.MISSED:
            autonomous = decision.kind is Kind.EXECUTE and motion not in STOPPED
            return decision.mode is Mode.SEQUENTIAL and autonomous
        return result is Result.GOAL_NAMED

    def _time_jumped(self, view: TableSnapshot) -> Outcome | Remark | None:
        self.state.latest, self.state.last_view = view, view.stamp
        self.state.closed, self.state.resumed_at, self.state.table = None, 0, None
        self.state.suspended = tuple(
            kept for kept in self.state.suspended if kept.phase is Phase.ASKING
        )
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
        sentence: str = '',
    ) -> Outcome:
        """Close the decision under way; the turn that it interrupted goes on if it is the last."""
        decision, motion = self._under_way(self.state.phase), self.state.motion
        by_robot = self.state.actor is Actor.ROBOT
        said = sentence or sentences.outcome(decision, result, self.state.actor, x_f, motion)
        said += self._keep_promise(result, x_f)
        header = view or decision
        self.state.phase, self.state.closed = Phase.IDLE, (decision.object, self.state.last_view)
        outcome = Outcome(
            header.stamp, header.frame, decision.id, decision.object, decision.x_i, decision.goal,
            x_f, result, self.state.actor, decision.action if by_robot else None,
            decision.predicted_success if by_robot else math.nan, motion,
            said,
        )  # fmt: skip
        if not self._goes_on(result):
            if self.state.table is not None:
                self.state.done = (*self.state.done, decision.object)
                self.state.turn_from = self.state.last_view
            self._resume_turn()
        return outcome


def _is_help(demo: Demonstration, asked: Decision) -> Remark:
    return Remark(f'{_change(demo)} is the help I asked for in request {asked.id}.')


def _change(demo: Demonstration) -> str:
    return f'{demo.object} from {demo.x_i.name} to {demo.x_f.name}'
