"""The inference node: goal beliefs, decisions, arm requests, and requests for help."""

from __future__ import annotations

import sys
import time
import uuid
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

from likeme_core.heartbeats import NodeState, described
from likeme_core.observations import TableSnapshot
from likeme_core.ros.heartbeat import HeartbeatPublisher
from likeme_core.ros.managed_node import ManagedNode
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.spin import join_graph, run_node
from likeme_core.ros.state_folder import state_folder_of
from likeme_core.ros.time import steady_clock
from likeme_core.ros.world import WorldPublisher, declare_world
from likeme_inference import messages
from likeme_inference.arm_call import ArmCall, NotSentError
from likeme_inference.cell_report_filter import CellReportFilter
from likeme_inference.experience.store_error import StoreError
from likeme_inference.help_requests import AcceptedAnswer, HelpRequests
from likeme_inference.joint_observer import JointObserver
from likeme_inference.logged_session import LoggedSession
from likeme_inference.node_settings import (
    open_decision_log,
    open_experience,
    read_joint_settings,
    read_model,
    read_settings,
    settings_of,
)
from likeme_inference.ros.arm_services import arm_heartbeats, arm_services
from likeme_inference.ros.ask_human_service import AskHumanService
from likeme_inference.ros.cell_reports import CellReports
from likeme_inference.ros.decision_records import DecisionRecordPublisher
from likeme_inference.ros.diagnostics import SessionDiagnostics
from likeme_inference.ros.joint_goal_beliefs import JointGoalBeliefs
from likeme_inference.ros.node_parameters import NodeParameters, Values, plain
from likeme_inference.ros.session_inputs import SessionInputs
from likeme_inference.session_inputs import InputValue, OperatorAnswer, SessionEvent
from likeme_inference.session_log import SessionLog
from likeme_inference.session_restore import Restored, restore
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.calibration import Calibration
from likeme_inference.tabletop.imitation import Goals, help_request, model_gaps
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import Phase
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    MotionReport,
    Outcome,
    Remark,
    Reply,
    TableGoal,
)
from likeme_msgs.msg import Calibration as CalibrationMsg
from likeme_msgs.msg import Decision as DecisionMsg
from likeme_msgs.msg import GoalBelief as GoalBeliefMsg
from likeme_msgs.msg import Outcome as OutcomeMsg
from likeme_msgs.srv import ExecuteAction

#: s between two checks for an arm or a camera that does not respond.
TIMEOUT_CHECK_PERIOD = 0.1
#: s without a heartbeat of the arm for a warning in /diagnostics.
ARM_SILENCE_WARNING = 0.3


class InferenceNode(ManagedNode):
    """Infers goals from demonstrations, imitates them, and asks for help when it is not sure.

    Subscribes:
        demonstration (Demonstration, reliable 10): a human act
        attempt (Attempt, reliable 10): a human act under way, or ended anywhere
        table_state (TableState, reliable 1): the state of every object
        hear_again (Heard, reliable 100): the next input, while `replayed`
        heartbeat (Heartbeat), cell/holds (HoldState), motion (Motion): of the arm and the cell
    Publishes:
        goal_belief (GoalBelief), decision (Decision), outcome (Outcome): each reliable, transient
            local, depth 1; after a restart the last ones again
        joint_goal_belief (JointGoalBelief, reliable, transient local, depth 1): goals over all
            objects, after each attempt and when the person has stopped
        decision_record (String, reliable, transient local, depth 20): what a decision follows from
        calibration (Calibration, reliable, transient local, depth 1): what was promised and what
            was kept, after each outcome
        heartbeat (Heartbeat): DEGRADED while the decision log cannot be written
        heard (Heard, reliable 100): acknowledges each input of the session
        world (World): latched, what the numbers mean
        /diagnostics (DiagnosticArray): 1 Hz, by the steady clock
    Service:
        ask_human (AskHuman): list pending requests, answer one
    Clients:
        arm/execute_action (ExecuteAction): once a decision, never repeated; a further try after
            a miss (sequential mode) is a further decision
        arm/motion_status (MotionStatus): how a motion ended whose response was lost
    Parameters, in force from the next decision:
        mode: trajectory, goal_based, interactive or sequential
        policy: direct or explored
        action_budget: actions the sequential mode may spend on one demonstration
        asking: threshold, cost or promise; costs and promise belong to the latter two
        prior: own, shared or structured: whether the trials of other objects count
        soft_evidence: whether perception's probabilities of x_i and x_f count
        goals: object or joint: whether each demonstration has a goal, or a joint goal is imitated
            once the person has stopped
        joint_goals, stop_delay: greatest number of goals over all objects, and the time without an
            act after which a person has stopped
        world: a shipped world or a world file; taken at the start
        goal_prior: probability of each state before anything is shown
        model_file: path of a model file; empty: the shipped one
        experience_store, learn_from_outcomes, robot: executed imitations are experience too; the
            store and the name are taken at the start
        decision_log: what is written before anything follows from it, and restored at the start
        arm_node: whose heartbeats are the arm's
        replayed: a new session whose inputs come from a recording (docs/replay_protocol.md); the
            arm is never called
        and help_threshold, concentration, turn_timeout, turn_delay, outcome_timeout,
            action_timeout, arm_wait: see node_settings

    A managed node, active from the start unless `autostart` is false. While it is not active it
    takes no demonstration, no table state and no answer, and asks the arm for nothing. How a
    motion ended that was under way is still taken in, and what was open is open again once it is
    active. Deactivating ends no motion: that is what a hold is for.
    """

    def __init__(self) -> None:
        super().__init__('inference_node')
        self._log: SessionLog | None = None
        self._heartbeat = HeartbeatPublisher(self, self._node_state)
        self._world = declare_world(self)
        self._node_parameters = NodeParameters(
            self, settings_of(self._world), self._validate, self._apply
        )
        values = self._node_parameters.values()
        model = read_model(values['model_file'], self._world)
        self._proposed_model: RobotModel | None = None
        self._experience = open_experience(values, model, self._world)
        if self._experience is not None:
            model = self._experience.model
        log = self._open_log(values)
        restored = restore(log)
        settings = read_settings(values, self._world)
        self._logged = LoggedSession(ImitationSession(model, settings, restored.state), log)
        self._world_pub = WorldPublisher(self, self._world)
        self._belief_pub = self.create_publisher(GoalBeliefMsg, 'goal_belief', LATCHED)
        self._decision_pub = self.create_publisher(DecisionMsg, 'decision', LATCHED)
        self._record_pub = DecisionRecordPublisher(self, self._world)
        self._outcome_pub = self.create_publisher(OutcomeMsg, 'outcome', LATCHED)
        self._calibration_pub = self.create_publisher(CalibrationMsg, 'calibration', LATCHED)
        self._calibration = Calibration()
        self._arm_health = arm_heartbeats(self, values['arm_node'])
        self._arm = ArmCall(
            arm_services(self),
            self._on_motion,
            self._on_late_answer,
            values['arm_wait'],
            values['action_timeout'],
            self._arm_health,
        )
        self._health = SessionDiagnostics(self, self._problems, self._facts)
        self._inputs = SessionInputs(
            self, self._world, values['replayed'], self._health, self._apply_input, self._publish,
            lambda: self._session.last_view,
        )  # fmt: skip
        observer = JointObserver(self._world, model, read_joint_settings(values))
        self._joint_goals = JointGoalBeliefs(
            self, self._world, observer, self._health, log.believed, self._on_table_goal
        )
        self._ask_human = AskHumanService(self, self._world, self._on_answer, self._refusal)
        CellReports(self, CellReportFilter.of(log.log), log.note)
        self._node_parameters.watch()
        self.create_timer(TIMEOUT_CHECK_PERIOD, self._check_timeouts, clock=steady_clock())
        self.get_logger().info(
            f'I know {", ".join(model.objects)} from {model.label} and imitate in '
            f'{values["mode"]} mode. Show me something.'
        )
        self._report_gaps()
        self._log = log
        if not values['replayed']:
            self._take_up(restored, values)
        self.autostart()

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go on with the session; its timeouts begin anew."""
        self._health.camera_heard()
        if self._session.phase is Phase.CONFIRMING:
            self._session.state.resumed_at = None
        self._inputs.receiving = self._joint_goals.receiving = True
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Decide nothing until activated."""
        self._inputs.receiving = self._joint_goals.receiving = False
        return super().on_deactivate(state)

    def _open_log(self, values: Values) -> SessionLog:
        """The decision log; of a replay there is none."""
        name = self.get_fully_qualified_name()
        cell = f'{values["robot"]}/{self.context.get_domain_id()}{name}'
        opened = (
            None
            if values['replayed']
            else open_decision_log(values, partial(state_folder_of, self))
        )
        log = SessionLog(opened, self._world, cell, self._heartbeat.run)
        log.paused = values['replayed']
        return log

    def _open_late(self, values: Values) -> None:
        """Open the log of a node that was started to replay a recording.

        Raises:
            ValueError: it cannot be used.
        """
        log = self._logged.log
        if log.log is not None:
            return
        try:
            log.log = open_decision_log(values, partial(state_folder_of, self))
            self._logged.last_decision = restore(log).state.decisions
        except (StoreError, OSError) as error:
            raise ValueError(str(error)) from error

    def _take_up(self, restored: Restored, values: Values) -> None:
        """Go on where the last run of this node was."""
        log, state = self._logged.log, restored.state
        log.started(
            self.get_fully_qualified_name(),
            {name: plain(value) for name, value in values.items()},
            restored.sentence,
        )
        log.note_state(state)
        if restored.sentence:
            self.get_logger().info(restored.sentence)
        self._joint_goals.take_up(restored.events)
        for answer in restored.answers:
            self._ask_human.desk.accept(answer)
        if restored.belief is not None:
            self._belief_pub.publish(messages.belief_msg(self._world, restored.belief))
        if restored.newest is not None:
            self._decision_pub.publish(messages.decision_msg(self._world, restored.newest))
            self._record_pub.publish(restored.record)
        if restored.outcome is not None:
            if restored.decided is not None:
                self._learn(restored.decided, restored.outcome)
            self._outcome_pub.publish(messages.outcome_msg(self._world, restored.outcome))
        for outcome in restored.outcomes:
            self._calibration = self._calibration.after(outcome)
        if restored.outcomes:
            self._publish_calibration(restored.outcomes[-1])
        for decision in state.questions:
            self._ask_human.desk.add(help_request(decision))
        if state.phase is Phase.ACTING and restored.motion:
            self._arm.resume(restored.motion, time.monotonic())
        elif state.phase is Phase.ACTING:
            why = 'the inference node ended before it asked the arm, nothing moved.'
            self._inputs.motion(MotionReport(None, why))

    @property
    def _session(self) -> ImitationSession:
        return self._logged.session

    def _node_state(self) -> tuple[NodeState, str]:
        """What the heartbeats tell."""
        if self._log is None:
            return NodeState.STARTING, 'The node is starting.'
        if not self.active:
            return NodeState.STARTING, 'the node is not active'
        if self._log.problem:
            return NodeState.DEGRADED, f'The decision log cannot be written: {self._log.problem}'
        return NodeState.READY, ''

    def _report_gaps(self) -> None:
        """Log which objects either the model or the world lacks."""
        for sentence in model_gaps(self._session.model, self._session.settings):
            self.get_logger().warning(sentence)

    def _validate(self, values: Values, changed: set[str]) -> None:
        """Refuse invalid values, or values that cannot change now.

        Raises:
            ValueError: saying why.
        """
        self._proposed_model = None
        if 'replayed' in changed and self._arm.busy:
            raise ValueError('Expected no motion under way when a replay begins or ends.')
        read_settings(values, self._world)
        read_joint_settings(values)
        if 'replayed' in changed and not values['replayed']:
            self._open_late(values)
        if 'model_file' not in changed:
            return
        if self._experience is not None:
            raise ValueError('Expected the model_file to stay while experience is added to it.')
        self._proposed_model = read_model(values['model_file'], self._world)

    def _apply(self, values: Values, changed: set[str]) -> None:
        new = {name: plain(values[name]) for name in changed if name in values}
        self._logged.log.note('parameters', {'changed': new})
        self._logged.session.settings = read_settings(values, self._world)
        self._joint_goals.observer.settings = read_joint_settings(values)
        self._arm.arm_wait, self._arm.action_timeout = values['arm_wait'], values['action_timeout']
        if 'replayed' in changed:
            self._restart(values['replayed'])
        if self._proposed_model is not None:
            self._logged.session.model, self._proposed_model = self._proposed_model, None
            model, place = self._session.model, values['model_file']
            self.get_logger().info(
                f'I know {", ".join(model.objects)} from {model.label}, '
                + (str(Path(place).expanduser().absolute()) if place else 'which is shipped')
                + '.'
            )
            self._report_gaps()

    def _restart(self, replayed: bool) -> None:
        self._logged.restart(replayed)
        self._ask_human.desk = HelpRequests()
        self._health.counts.clear()
        self._calibration = Calibration()
        self._joint_goals.observer.restart()
        self._inputs.restart(replayed)

    def _apply_input(self, value: InputValue) -> list[SessionEvent]:
        """Apply an input to the session.

        Raises:
            ValueError: it is refused.
            StoreError: it cannot be logged; nothing follows from it.
        """
        if isinstance(value, TableSnapshot) and value.stamp > self._session.last_view:
            self._health.camera_heard()
        answer, desk = None, self._ask_human.desk
        if isinstance(value, OperatorAnswer):
            state = self._session.state.question(value.object) or self._session.state
            if state.decision is not None:
                answer = desk.check(
                    state.decision.id, value.reply, value.answered_by, goal=value.goal
                )
        if isinstance(value, TableSnapshot):
            # First, so that a new joint goal is known before the robot acts on the last one.
            self._joint_goals.observer.model = self._session.model
            self._joint_goals.look(value)
        events = self._logged.apply(value, answer)
        if answer is not None:
            desk.accept(answer)
        return events

    def _publish(self, event: SessionEvent) -> None:
        """Publish and log an event of the session, and carry out a decision."""
        if isinstance(event, GoalBelief):
            self._belief_pub.publish(messages.belief_msg(self._world, event))
        elif isinstance(event, Decision):
            # First, so that who reads the decision can look it up.
            self._record_pub.publish(self._logged.log.decided)
            self._decision_pub.publish(messages.decision_msg(self._world, event))
            self._health.counts['decisions'] += 1
        elif isinstance(event, Outcome):
            # Stored before it is published: a subscriber may stop this node.
            decision = self._session.decision
            if decision is not None and decision.id == event.decision_id:
                self._learn(decision, event)
            self._outcome_pub.publish(messages.outcome_msg(self._world, event))
            self._calibration = self._calibration.after(event)
            self._publish_calibration(event)
            self._health.counts[f'outcomes {event.result.name}'] += 1
        if not isinstance(event, Remark):
            self._health.counts['events'] += 1
        self.get_logger().info(event.sentence)
        if isinstance(event, Decision) and event.kind is Kind.ASK_HUMAN:
            self._ask_human.desk.add(help_request(event))
        elif isinstance(event, Decision) and event.kind is Kind.EXECUTE:
            self._act(event)

    def _publish_calibration(self, outcome: Outcome) -> None:
        promise = self._session.kept_promise
        self._calibration_pub.publish(
            messages.calibration_msg(self._world, self._calibration, promise, outcome)
        )

    def _learn(self, decision: Decision, outcome: Outcome) -> None:
        """Keep what was done in earnest, once, and decide by it from now on."""
        learns = self._learns and not self._inputs.replayed
        if self._experience is None or not learns:
            return
        try:
            model = self._experience.record_outcome(decision, outcome)
        except StoreError as error:
            self._health.counts['outcomes not kept'] += 1
            self.get_logger().warning(f'This outcome is not kept as experience: {error}')
            return
        if model is not None:
            self._session.model = model
            self._health.counts['outcomes learned from'] += 1

    @property
    def _learns(self) -> bool:
        return bool(self.get_parameter('learn_from_outcomes').value)

    def _act(self, decision: Decision) -> None:
        """Call the arm, once, by an id that no other request has.

        The time to start in counts from the newest table state: camera and arm share their clock,
        be it simulated or not, and what was seen too long ago is nothing to act on.
        """
        if self._inputs.replayed:
            return
        action = decision.action
        assert action is not None, 'Only actions are executed.'

        motion_id = f'decision-{decision.id}-{uuid.uuid4()}'

        def request() -> ExecuteAction.Request:
            expires = self._session.last_view + round(self._arm.arm_wait * 1e9)
            try:
                self._logged.log.request_motion(decision, motion_id, expires)
            except StoreError as error:
                raise NotSentError(f'the request cannot be logged: {error}') from error
            return messages.execute_request(
                self._world, decision.object, action, expires, motion_id
            )

        self._arm.start(motion_id, request, time.monotonic())

    def _on_motion(self, report: MotionReport) -> None:
        self._health.camera_heard()
        if report.outcome is not None:
            self.get_logger().info(f'The arm reports: {report.message}')
        self._inputs.motion(report)

    def _on_late_answer(self, report: MotionReport) -> None:
        self.get_logger().warning(f'Late report of the arm ignored: {report.message}')
        self._health.counts['late answers ignored'] += 1

    def _on_table_goal(self, goal: TableGoal) -> None:
        joint = self._session.settings.goals is Goals.JOINT
        if joint and not self._inputs.replayed:
            self._inputs.table_goal(goal)

    def _on_answer(self, answer: AcceptedAnswer) -> None:
        """Apply an operator's answer.

        Raises:
            StoreError: it cannot be logged.
        """
        about = answer.request.object
        self._inputs.answer(OperatorAnswer(answer.reply, answer.answered_by, about, answer.goal))
        self._health.camera_heard()
        self.get_logger().info(answer.sentence)
        acts = answer.reply is Reply.TRY_ANYWAY and self._session.phase is Phase.ACTING
        if acts and self._session.decision is not None:
            self._act(self._session.decision)

    def _refusal(self, answer: AcceptedAnswer | None) -> str:
        """Why no answer, or this one, is taken at present."""
        if self._inputs.replayed:
            return 'This is a replay: the recorded operator answers.'
        if not self.active:
            return 'The inference node is not active: activate it first.'
        return '' if answer is None else self._session.refusal(answer.request.object, answer.reply)

    def _check_timeouts(self) -> None:
        """Give up an arm or a camera that does not respond in time."""
        if self._inputs.replayed:
            return
        self._logged.log.poll()
        self._arm.poll(time.monotonic())
        if not self.active:
            return
        self._inputs.poll()
        late = self._health.silence > self._session.settings.outcome_timeout
        if self._session.phase is Phase.CONFIRMING and late:
            self._inputs.silence()

    def _facts(self) -> dict[str, Any]:
        """What /diagnostics reports beside the counts."""
        return {
            'phase': self._session.phase.name,
            'mode': self._session.settings.mode,
            'model': self._session.model.label,
            'pending requests': len(self._ask_human.desk.pending),
            'inputs': self._inputs.count,
            'inputs not logged yet': self._inputs.kept,
            'decision log': self._logged.log.place or 'none',
            'health': described(*self._node_state()),
        }

    def _problems(self) -> list[str]:
        """Why /diagnostics warns, beside what it knows itself."""
        known, silence = self._arm_health.run, self._arm_health.silence(time.monotonic())
        problems = [
            (not self.active, 'the node is not active'),
            (not self._arm.ready, 'arm service absent'),
            (bool(known) and silence > ARM_SILENCE_WARNING, 'the arm is silent'),
            (bool(self._logged.log.problem), f'no decision log: {self._logged.log.problem}'),
        ]
        return [sentence for present, sentence in problems if present]


def preload() -> None:
    """Of a standby process: import SQLAlchemy, which the decision log needs; join the graph."""
    import likeme_inference.experience.decision_log  # noqa: F401

    join_graph()


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node(
        'inference_node', InferenceNode, start_errors=(ValueError, StoreError, OSError)
    )


if __name__ == '__main__':
    sys.exit(main())
