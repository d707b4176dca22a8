"""The node that believes, decides, acts through the arm, and asks."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

from rclpy.node import Node

from likeme_core.ros.qos import LATCHED
from likeme_core.ros.spin import run_node
from likeme_core.ros.time import steady_clock
from likeme_inference import messages
from likeme_inference.arm_call import ArmCall
from likeme_inference.experience.database import StoreError
from likeme_inference.help_requests import AnswerRefusedError, HelpDesk
from likeme_inference.input_sequencer import Input
from likeme_inference.node_settings import open_experience, read_model, read_settings
from likeme_inference.ros.diagnostics import Health
from likeme_inference.ros.node_parameters import NodeParameters, Values
from likeme_inference.ros.session_inputs import Hearing
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.imitation import help_request
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
from likeme_msgs.msg import Demonstration as DemonstrationMsg
from likeme_msgs.msg import GoalBelief as GoalBeliefMsg
from likeme_msgs.msg import Heard, TableState
from likeme_msgs.msg import Outcome as OutcomeMsg
from likeme_msgs.srv import AskHuman, ExecuteAction

WATCH_PERIOD = 0.1
#: What a recorded input other than a topic's message carries.
HEARD_FIELDS = ('motion_outcome', 'finished', 'answer', 'message')


class InferenceNode(Node):
    """Infers goals from demonstrations, imitates them, and asks for help when it is not sure.

    Subscribes:
        demonstration (Demonstration, reliable 10): what a person showed
        table_state (TableState, reliable 1): where things are, settled or not
        hear_again (Heard, reliable 100): what to take in next, while `replayed`
    Publishes:
        goal_belief (GoalBelief), decision (Decision), outcome (Outcome): each reliable, transient
            local, depth 1
        heard (Heard, reliable 100): each thing the session took in
        /diagnostics (DiagnosticArray): 1 Hz, by the steady clock
    Service:
        ask_human (AskHuman): list what is pending, answer it
    Client:
        arm/execute_action (ExecuteAction): once a decision, never repeated; a further try after
            a miss (sequential mode) is a further decision
    Parameters, all taken up by the next decision:
        mode: trajectory, goal_based, interactive or sequential
        policy: direct or explored
        action_budget: actions the sequential mode may spend on one demonstration
        shared_prior: whether the trials of all objects choose the prior together
        soft_evidence: whether perception's probabilities of x_i and x_f count
        goal_prior: p(LEFT), p(RIGHT), p(OFFTABLE) before anything is shown
        model_file: path of a model file; empty: the shipped one
        experience_store, learn_from_outcomes, robot: executed imitations are experience too; the
            store and the name are taken at the start
        replayed: the session starts anew and hears arm and operator from a recording alone, see
            rehearsal; the arm is never called
        and help_threshold, concentration, turn_timeout, turn_delay, outcome_timeout,
            action_timeout, arm_wait: see node_settings
    """

    def __init__(self) -> None:
        super().__init__('inference_node')
        self._node_parameters = NodeParameters(self, self._judge, self._take_up)
        values = self._node_parameters.values()
        model = read_model(values['model_file'])
        self._proposed_model: RobotModel | None = None
        self._experience = open_experience(values, model)
        if self._experience is not None:
            model = self._experience.model
        self._session = ImitationSession(model, read_settings(values))
        self._desk = HelpDesk()
        self._belief_pub = self.create_publisher(GoalBeliefMsg, 'goal_belief', LATCHED)
        self._decision_pub = self.create_publisher(DecisionMsg, 'decision', LATCHED)
        self._outcome_pub = self.create_publisher(OutcomeMsg, 'outcome', LATCHED)
        self._arm = ArmCall(
            self.create_client(ExecuteAction, 'arm/execute_action'),
            messages.read_motion,
            self._on_motion,
            self._on_late_answer,
            values['arm_wait'],
            values['action_timeout'],
        )
        self._health = Health(self, lambda: self._arm.ready, self._facts)
        self._hearing = Hearing(self, values['replayed'], self._hear_again)
        self._hearing.subscribe(
            Input.DEMONSTRATION, DemonstrationMsg, 'demonstration', self._on_demonstration, 10
        )
        self._hearing.subscribe(
            Input.TABLE_STATE, TableState, 'table_state', self._on_table_state, 1
        )
        self.create_service(AskHuman, 'ask_human', self._on_ask_human)
        self._node_parameters.watch()
        self.create_timer(WATCH_PERIOD, self._watch, clock=steady_clock())
        self.get_logger().info(
            f'I know {", ".join(model.objects)} from {model.label} and imitate in '
            f'{values["mode"]} mode. Show me something.'
        )

    def _judge(self, values: Values, changed: set[str]) -> None:
        """Refuse what makes no sense, now or at all.

        Raises:
            ValueError: saying why.
        """
        self._proposed_model = None
        if 'replayed' in changed and self._arm.busy:
            raise ValueError('Expected no motion under way when a replay begins or ends.')
        read_settings(values)
        if 'model_file' not in changed:
            return
        if self._experience is not None:
            raise ValueError('Expected the model_file to stay while experience is added to it.')
        self._proposed_model = read_model(values['model_file'])

    def _take_up(self, values: Values, changed: set[str]) -> None:
        self._session.settings = read_settings(values)
        self._arm.arm_wait, self._arm.action_timeout = values['arm_wait'], values['action_timeout']
        if 'replayed' in changed:
            self._begin_anew(values['replayed'])
        if self._proposed_model is not None:
            self._session.model, self._proposed_model = self._proposed_model, None
            model, place = self._session.model, values['model_file']
            self.get_logger().info(
                f'I know {", ".join(model.objects)} from {model.label}, '
                + (str(Path(place).expanduser().absolute()) if place else 'which is shipped')
                + '.'
            )

    def _begin_anew(self, replayed: bool) -> None:
        self._session = ImitationSession(self._session.model, self._session.settings)
        self._desk = HelpDesk()
        self._health.counts.clear()
        self._hearing.begin(replayed)

    def _on_demonstration(self, msg: DemonstrationMsg) -> None:
        try:
            demo = messages.read_demonstration(msg, self._session.model.objects)
        except ValueError as error:
            self._health.drop('demonstrations', error)
            self._heard(Input.DEMONSTRATION, header=msg.header, refused=True)
            return
        self._health.counts['demonstrations'] += 1
        self._tell(self._session.observe_demonstration(demo))
        self._tell(self._session.look_again())
        self._heard(Input.DEMONSTRATION, header=msg.header)

    def _on_table_state(self, msg: TableState) -> None:
        try:
            view = messages.read_table(msg)
        except ValueError as error:
            self._health.drop('table states', error)
            self._heard(Input.TABLE_STATE, header=msg.header, refused=True)
            return
        if view.stamp > self._session.last_view:
            self._health.camera_heard()
        self._health.counts['table states'] += 1
        self._tell(self._session.look(view))
        self._heard(Input.TABLE_STATE, header=msg.header)

    def _tell(self, event: GoalBelief | Decision | Outcome | Remark | None) -> None:
        """Publish what the session came to, say it, and set about it."""
        if event is None:
            return
        if isinstance(event, GoalBelief):
            self._belief_pub.publish(messages.belief_msg(event))
        elif isinstance(event, Decision):
            self._decision_pub.publish(messages.decision_msg(event))
            self._health.counts['decisions'] += 1
        elif isinstance(event, Outcome):
            # Kept before it is told: whoever hears of it may stop this node.
            self._learn(event)
            self._outcome_pub.publish(messages.outcome_msg(event))
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
        learns = self._learns and not self._hearing.replayed
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
        if self._hearing.replayed:
            return
        action = decision.action
        assert action is not None, 'Only actions are executed.'

        def request() -> ExecuteAction.Request:
            expires = self._session.last_view + round(self._arm.arm_wait * 1e9)
            return messages.execute_request(decision.object, action, expires)

        self._arm.start(request, time.monotonic())

    def _on_motion(self, report: MotionReport) -> None:
        self._health.camera_heard()
        if report.outcome is not None:
            self.get_logger().info(f'The arm says: {report.message}')
        self._tell(self._session.motion_finished(report))
        self._heard(Input.MOTION, **messages.motion_fields(report))

    def _on_late_answer(self, report: MotionReport) -> None:
        self.get_logger().warning(f'Too late, ignored: the arm says: {report.message}')
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
        response.pending = [messages.request_msg(item) for item in self._desk.pending]
        return response

    def _serve(self, request: AskHuman.Request) -> str:
        if request.command == AskHuman.Request.LIST:
            return f'{len(self._desk.pending)} pending.'
        if request.command != AskHuman.Request.ANSWER:
            raise AnswerRefusedError(
                f'Expected command 0 LIST or 1 ANSWER, got {request.command}.'
            )
        if self._hearing.replayed:
            raise AnswerRefusedError('This is a replay: the recorded operator answers.')
        answer = self._desk.answer(request.request_id, request.answer, request.answered_by)
        self._health.camera_heard()
        self.get_logger().info(answer.sentence)
        self._tell(self._session.answered(answer.reply))
        self._heard(Input.ANSWER, answer=int(answer.reply), message=answer.answered_by)
        if answer.reply is Reply.TRY_ANYWAY and self._session.decision is not None:
            self._act(self._session.decision)
        return answer.sentence

    def _watch(self) -> None:
        """Give up an arm or a camera that is not heard of in time."""
        if self._hearing.replayed:
            return
        self._arm.poll(time.monotonic())
        late = self._health.silence > self._session.settings.outcome_timeout
        if self._session.phase is Phase.CONFIRMING and late:
            self._tell(self._session.nothing_seen())
            self._heard(Input.SILENCE)

    def _heard(self, kind: Input, **fields: Any) -> None:
        events = self._health.counts['events']
        self._hearing.announce(kind, self._session.last_view, events, **fields)

    def _hear_again(self, kind: Input, said: Heard) -> None:
        """Hear what arm or operator said in the recorded run, or that nobody did."""
        fields = {name: getattr(said, name) for name in HEARD_FIELDS}
        try:
            if kind is Input.MOTION:
                self._tell(self._session.motion_finished(messages.heard_motion(said)))
            elif kind is Input.SILENCE:
                self._tell(self._session.nothing_seen())
            elif kind is Input.ANSWER:
                self._tell(self._session.answered(messages.heard_reply(said)))
                assert self._session.decision is not None, 'An answer needs a question.'
                self._desk.answer(self._session.decision.id, said.answer, said.message or '?')
        except ValueError as error:
            self.get_logger().warning(f'The recording does not fit what came of it here: {error}')
            fields['refused'] = True
        self._heard(kind, **fields)

    def _facts(self) -> dict[str, Any]:
        """What /diagnostics tells beside the counts."""
        return {
            'phase': self._session.phase.name,
            'mode': self._session.settings.mode,
            'model': self._session.model.label,
            'pending requests': len(self._desk.pending),
            'inputs': self._hearing.inputs,
        }


def main() -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node('inference_node', InferenceNode, start_errors=(ValueError, StoreError))


if __name__ == '__main__':
    sys.exit(main())
