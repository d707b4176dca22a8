"""The inference node: goal beliefs, decisions, arm requests, and requests for help."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

from rclpy.node import Node

from likeme_core.observations import TableSnapshot
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.spin import run_node
from likeme_core.ros.time import steady_clock
from likeme_core.ros.world import WorldPublisher, declare_world
from likeme_inference import messages
from likeme_inference.arm_call import ArmCall
from likeme_inference.experience.database import StoreError
from likeme_inference.help_requests import AnswerRefusedError, HelpRequests
from likeme_inference.node_settings import (
    open_experience,
    read_model,
    read_settings,
    settings_of,
)
from likeme_inference.ros.diagnostics import SessionDiagnostics
from likeme_inference.ros.node_parameters import NodeParameters, Values
from likeme_inference.ros.session_inputs import SessionInputs
from likeme_inference.session_inputs import (
    InputValue,
    OperatorAnswer,
    SessionEvent,
    apply_input,
    read_motion,
)
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import help_request, model_gaps
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_inference.tabletop.session import ImitationSession, Phase
from likeme_inference.tabletop.values import (
    Decision,
    GoalBelief,
    MotionReport,
    Outcome,
    Remark,
    Reply,
)
from likeme_msgs.msg import Decision as DecisionMsg
from likeme_msgs.msg import GoalBelief as GoalBeliefMsg
from likeme_msgs.msg import Outcome as OutcomeMsg
from likeme_msgs.srv import AskHuman, ExecuteAction

#: s between two checks for an arm or a camera that does not respond.
TIMEOUT_CHECK_PERIOD = 0.1


class InferenceNode(Node):
    """Infers goals from demonstrations, imitates them, and asks for help when it is not sure.

    Subscribes:
        demonstration (Demonstration, reliable 10): a human act
        table_state (TableState, reliable 1): the state of every object
        hear_again (Heard, reliable 100): the next input, while `replayed`
    Publishes:
        goal_belief (GoalBelief), decision (Decision), outcome (Outcome): each reliable, transient
            local, depth 1
        heard (Heard, reliable 100): acknowledges each input of the session
        world (World): latched, what the numbers mean
        /diagnostics (DiagnosticArray): 1 Hz, by the steady clock
    Service:
        ask_human (AskHuman): list pending requests, answer one
    Client:
        arm/execute_action (ExecuteAction): once a decision, never repeated; a further try after
            a miss (sequential mode) is a further decision
    Parameters, in force from the next decision:
        mode: trajectory, goal_based, interactive or sequential
        policy: direct or explored
        action_budget: actions the sequential mode may spend on one demonstration
        shared_prior: whether the trials of all objects choose the prior together
        soft_evidence: whether perception's probabilities of x_i and x_f count
        world: a shipped world or a world file; taken at the start
        goal_prior: probability of each state before anything is shown
        model_file: path of a model file; empty: the shipped one
        experience_store, learn_from_outcomes, robot: executed imitations are experience too; the
            store and the name are taken at the start
        replayed: a new session whose inputs come from a recording (docs/replay_protocol.md); the
            arm is never called
        and help_threshold, concentration, turn_timeout, turn_delay, outcome_timeout,
            action_timeout, arm_wait: see node_settings
    """

    def __init__(self) -> None:
        super().__init__('inference_node')
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
        self._session = ImitationSession(model, read_settings(values, self._world))
        self._desk = HelpRequests()
        self._world_pub = WorldPublisher(self, self._world)
        self._belief_pub = self.create_publisher(GoalBeliefMsg, 'goal_belief', LATCHED)
        self._decision_pub = self.create_publisher(DecisionMsg, 'decision', LATCHED)
        self._outcome_pub = self.create_publisher(OutcomeMsg, 'outcome', LATCHED)
        self._arm = ArmCall(
            self.create_client(ExecuteAction, 'arm/execute_action'),
            read_motion,
            self._on_motion,
            self._on_late_answer,
            values['arm_wait'],
            values['action_timeout'],
        )
        self._health = SessionDiagnostics(self, lambda: self._arm.ready, self._facts)
        self._inputs = SessionInputs(
            self, self._world, values['replayed'], self._health, self._apply_input, self._publish,
            lambda: self._session.last_view,
        )  # fmt: skip
        self.create_service(AskHuman, 'ask_human', self._on_ask_human)
        self._node_parameters.watch()
        self.create_timer(TIMEOUT_CHECK_PERIOD, self._check_timeouts, clock=steady_clock())
        self.get_logger().info(
            f'I know {", ".join(model.objects)} from {model.label} and imitate in '
            f'{values["mode"]} mode. Show me something.'
        )
        self._report_gaps()

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
        if 'model_file' not in changed:
            return
        if self._experience is not None:
            raise ValueError('Expected the model_file to stay while experience is added to it.')
        self._proposed_model = read_model(values['model_file'], self._world)

    def _apply(self, values: Values, changed: set[str]) -> None:
        self._session.settings = read_settings(values, self._world)
        self._arm.arm_wait, self._arm.action_timeout = values['arm_wait'], values['action_timeout']
        if 'replayed' in changed:
            self._restart(values['replayed'])
        if self._proposed_model is not None:
            self._session.model, self._proposed_model = self._proposed_model, None
            model, place = self._session.model, values['model_file']
            self.get_logger().info(
                f'I know {", ".join(model.objects)} from {model.label}, '
                + (str(Path(place).expanduser().absolute()) if place else 'which is shipped')
                + '.'
            )
            self._report_gaps()

    def _restart(self, replayed: bool) -> None:
        self._session = ImitationSession(self._session.model, self._session.settings)
        self._desk = HelpRequests()
        self._health.counts.clear()
        self._inputs.restart(replayed)

    def _apply_input(self, value: InputValue) -> list[SessionEvent]:
        """Apply an input to the session.

        Raises:
            ValueError: it is refused.
        """
        if isinstance(value, TableSnapshot) and value.stamp > self._session.last_view:
            self._health.camera_heard()
        events = apply_input(self._session, value)
        if self._inputs.replayed and isinstance(value, OperatorAnswer):
            assert self._session.decision is not None, 'An answer needs a question.'
            self._desk.answer(self._session.decision.id, value.reply, value.answered_by)
        return events

    def _publish(self, event: SessionEvent) -> None:
        """Publish and log an event of the session, and carry out a decision."""
        if isinstance(event, GoalBelief):
            self._belief_pub.publish(messages.belief_msg(self._world, event))
        elif isinstance(event, Decision):
            self._decision_pub.publish(messages.decision_msg(self._world, event))
            self._health.counts['decisions'] += 1
        elif isinstance(event, Outcome):
            # Stored before it is published: a subscriber may stop this node.
            self._learn(event)
            self._outcome_pub.publish(messages.outcome_msg(self._world, event))
            self._health.counts[f'outcomes {event.result.name}'] += 1
        if not isinstance(event, Remark):
            self._health.counts['events'] += 1
        self.get_logger().info(event.sentence)
        if isinstance(event, Decision) and event.kind is Kind.ASK_HUMAN:
            self._desk.add(help_request(event))
        elif isinstance(event, Decision) and event.kind is Kind.EXECUTE:
            self._act(event)

    def _learn(self, outcome: Outcome) -> None:
        """Keep what was done in earnest, and decide by it from now on."""
        decision = self._session.decision
        learns = self._learns and not self._inputs.replayed
        if self._experience is None or decision is None or not learns:
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
        """Call the arm, once.

        The time to start in counts from the newest table state: camera and arm share their clock,
        be it simulated or not, and what was seen too long ago is nothing to act on.
        """
        if self._inputs.replayed:
            return
        action = decision.action
        assert action is not None, 'Only actions are executed.'

        def request() -> ExecuteAction.Request:
            expires = self._session.last_view + round(self._arm.arm_wait * 1e9)
            return messages.execute_request(self._world, decision.object, action, expires)

        self._arm.start(request, time.monotonic())

    def _on_motion(self, report: MotionReport) -> None:
        self._health.camera_heard()
        if report.outcome is not None:
            self.get_logger().info(f'The arm reports: {report.message}')
        self._inputs.motion(report)

    def _on_late_answer(self, report: MotionReport) -> None:
        self.get_logger().warning(f'Late report of the arm ignored: {report.message}')
        self._health.counts['late answers ignored'] += 1

    def _on_ask_human(
        self, request: AskHuman.Request, response: AskHuman.Response
    ) -> AskHuman.Response:
        try:
            response.message = self._serve(request)
            response.success = True
        except AnswerRefusedError as error:
            response.message = str(error)
            self.get_logger().warning(f'Answer refused: {error}')
        response.pending = [messages.request_msg(self._world, item) for item in self._desk.pending]
        return response

    def _serve(self, request: AskHuman.Request) -> str:
        if request.command == AskHuman.Request.LIST:
            return f'{len(self._desk.pending)} pending.'
        if request.command != AskHuman.Request.ANSWER:
            raise AnswerRefusedError(
                f'Expected command 0 LIST or 1 ANSWER, got {request.command}.'
            )
        if self._inputs.replayed:
            raise AnswerRefusedError('This is a replay: the recorded operator answers.')
        answer = self._desk.answer(request.request_id, request.answer, request.answered_by)
        self._health.camera_heard()
        self.get_logger().info(answer.sentence)
        self._inputs.answer(OperatorAnswer(answer.reply, answer.answered_by))
        if answer.reply is Reply.TRY_ANYWAY and self._session.decision is not None:
            self._act(self._session.decision)
        return answer.sentence

    def _check_timeouts(self) -> None:
        """Give up an arm or a camera that does not respond in time."""
        if self._inputs.replayed:
            return
        self._arm.poll(time.monotonic())
        late = self._health.silence > self._session.settings.outcome_timeout
        if self._session.phase is Phase.CONFIRMING and late:
            self._inputs.silence()

    def _facts(self) -> dict[str, Any]:
        """What /diagnostics reports beside the counts."""
        return {
            'phase': self._session.phase.name,
            'mode': self._session.settings.mode,
            'model': self._session.model.label,
            'pending requests': len(self._desk.pending),
            'inputs': self._inputs.count,
        }


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node('inference_node', InferenceNode, start_errors=(ValueError, StoreError))


if __name__ == '__main__':
    sys.exit(main())
