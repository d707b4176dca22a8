"""Runs the acts of the demo over the services of a running cell and reports what happens."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import Image

from likeme_bringup import narration
from likeme_bringup.demo_acts import DemoAct, DemoActResult
from likeme_bringup.frame_buffer import FrameBuffer
from likeme_bringup.storyboard import Panel, StoryboardRow
from likeme_core.outcomes import MotionOutcome
from likeme_core.ros.qos import LATCHED
from likeme_core.tabletop import Action, State
from likeme_core.world import World
from likeme_inference.console_replies import TypedAnswer
from likeme_inference.tabletop.asking import ASKING_MODES
from likeme_msgs.msg import (
    Decision,
    Demonstration,
    GoalBelief,
    HelpRequest,
    Outcome,
    TableState,
)
from likeme_msgs.srv import AskHuman, ExecuteAction, ResetCell
from likeme_perception.rgbd import decode_rgb

T = TypeVar('T')
DONE_BY_HAND = AskHuman.Request.DONE_BY_HAND
TRY_ANYWAY = AskHuman.Request.TRY_ANYWAY
#: Answers ask_human: (request, check) to an answer and a name. A function that waits
#: calls `check` meanwhile, which raises when the demo cannot go on.
Operator = Callable[[Any, Callable[[], None]], tuple[TypedAnswer, str]]
#: Timeouts, s.
READY_TIMEOUT, EVENT_TIMEOUT, MOTION_TIMEOUT, OUTCOME_TIMEOUT = 60.0, 20.0, 60.0, 120.0
REPLY_TIMEOUT = 10.0


class DemoStoppedError(Exception):
    """The demo cannot go on; the message says what was expected and what came."""


class DemoNode(Node):
    """Runs one act after another.

    Subscribes: table_state, demonstration, goal_belief, decision, outcome, table_overlay.
    Calls: cell/reset, human/execute_action, ask_human.
    """

    def __init__(
        self,
        world: World,
        tell: Callable[[str], None],
        operator: Operator,
        check: Callable[[], None],
    ) -> None:
        """tell: prints a sentence. check: raises when the demo cannot go on."""
        super().__init__('demo')
        self._world = world
        self._tell, self._operator, self._check = tell, operator, check
        # Messages received since the act began, by their type.
        self._received: dict[type, list[Any]] = defaultdict(list)
        self._table: TableState | None = None
        self._frames = FrameBuffer[Image]()
        self._panels: list[Panel] = []
        self.rows: list[StoryboardRow] = []
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        self.create_subscription(TableState, 'table_state', self._on_table, 1)
        for kind, topic, qos in (
            (Demonstration, 'demonstration', 10),
            (GoalBelief, 'goal_belief', LATCHED),
            (Decision, 'decision', LATCHED),
            (Outcome, 'outcome', LATCHED),
        ):
            self.create_subscription(kind, topic, partial(self._on_message, kind), qos)
        self.create_subscription(Image, 'table_overlay', self._frames.add, qos_profile_sensor_data)
        self._human = self.create_client(ExecuteAction, 'human/execute_action')
        self._arm = self.create_client(ExecuteAction, 'arm/execute_action')
        self._reset = self.create_client(ResetCell, 'cell/reset')
        self._ask = self.create_client(AskHuman, 'ask_human')

    def wait_until_ready(self) -> None:
        """Return when every service is there and a first table state has come."""
        for client in (self._human, self._arm, self._reset, self._ask):
            what = f'the service {client.srv_name}'
            self._wait_for(client.service_is_ready, READY_TIMEOUT, what)
        self._wait_for(lambda: self._table, READY_TIMEOUT, 'a first table_state from perception')

    def run_act(self, act: DemoAct, seed: int) -> DemoActResult:
        """Run one act, from setting up the table to the outcome.

        If other objects are in the way of a robot that does not ask, they leave the table and the
        act begins anew.

        Raises:
            DemoStoppedError: it could not be completed.
        """
        result, motion = self._run_act(act, seed)
        if motion != MotionOutcome.NOT_FREE:
            return result
        self._tell('The person takes the other objects off the table and shows it again.')
        self._take_others_away(act.object, seed)
        return self._run_act(act, seed)[0]

    def _run_act(self, act: DemoAct, seed: int) -> tuple[DemoActResult, int]:
        """Run one act; its result and the motion's outcome."""
        self._panels = []
        self._received.clear()
        self.rows.append(StoryboardRow(act.title(), self._panels))
        self._move_objects({act.object: act.start}, seed)
        self._tell(narration.table(self._world, self._table))
        self._keep_next_frame('before')
        self._demonstrate(act)
        self._put_back(act)
        asked = False
        while True:
            choice = self._next_decision()
            self._tell(narration.decision(self._world, choice, act))
            caption = narration.action_caption(self._world, choice)
            if choice.kind == Decision.ASK_HUMAN:
                asked, caption = True, self._answer(choice, seed)
            elif choice.kind != Decision.EXECUTE:
                raise DemoStoppedError(
                    f'Expected the robot to act or to ask, got: {choice.sentence}'
                )
            else:
                self._tell('The robot acts.')
            outcome = self._outcome_of(choice)
            self._tell(outcome.sentence)
            if not _decides_anew(choice, outcome):
                break
            self._frames.clear()
        self._keep_middle_frame(caption)
        self._keep_next_frame(f'after: {narration.RESULT_CAPTIONS[outcome.result]}')
        reached = outcome.result == Outcome.REACHED and outcome.goal == act.end
        return DemoActResult(act, reached, asked, outcome.sentence), outcome.motion_outcome

    def _take_others_away(self, name: str, seed: int) -> None:
        """Take all objects but one off the table."""
        others = [other for other in self._world.objects if other != name]
        self._move_objects(dict.fromkeys(others, self._world.regions.elsewhere), seed)

    def _move_objects(self, places: Mapping[str, State], seed: int) -> None:
        states = [state.name for state in places.values()]
        request = ResetCell.Request(objects=list(places), states=states, seed=seed)
        reply = self._call(self._reset, request, EVENT_TIMEOUT)
        if not reply.success:
            raise DemoStoppedError(f'Expected the table to be set up, got: {reply.message}')
        for name, state in places.items():
            self._wait_for_object(name, state)

    def _demonstrate(self, act: DemoAct) -> None:
        self._tell(f'A person shows: {act.title()}.')
        self._move_by_hand(act.object, act.action)
        demo = self._first(Demonstration, EVENT_TIMEOUT, 'a demonstration')
        self._keep_middle_frame('a person shows')
        self._tell(narration.demonstration(self._world, demo))
        if (demo.object, demo.x_i, demo.x_f) != (act.object, act.start, act.end):
            raise DemoStoppedError(
                f'Expected to see {act.title()}; the camera saw something else.'
            )
        belief = self._first(GoalBelief, REPLY_TIMEOUT, 'a goal belief')
        self._tell(narration.belief(self._world, belief))

    def _put_back(self, act: DemoAct) -> None:
        at_goal = self._next_decision()
        self._tell(at_goal.sentence)
        if at_goal.kind != Decision.AT_GOAL:
            raise DemoStoppedError(
                f'Expected the robot to want the {act.object} {act.end.name}, where it is.'
            )
        self._tell(
            f'The person puts the {act.object} back {act.start.name}; the robot looks again.'
        )
        self._move_by_hand(act.object, act.undo)
        self._frames.clear()

    def _next_decision(self) -> Decision:
        choice = self._first(Decision, EVENT_TIMEOUT, 'a decision of the robot')
        self._received[Decision].remove(choice)
        return choice

    def _outcome_of(self, choice: Decision) -> Outcome:
        def received() -> Outcome | None:
            return next((o for o in self._received[Outcome] if o.decision_id == choice.id), None)

        return self._wait_for(received, OUTCOME_TIMEOUT, 'an outcome of the decision')

    def _answer(self, choice: Decision, seed: int) -> str:
        """Have the operator answer the request for help; the caption of what follows."""
        listed = self._call(self._ask, AskHuman.Request(command=AskHuman.Request.LIST))
        pending = [request for request in listed.pending if request.id == choice.id]
        if not pending:
            raise DemoStoppedError(
                f'Expected request {choice.id} to be pending, got: {listed.message}'
            )
        self._tell(f'The robot asks: {pending[0].question}')
        (answer, goal), name = self._operator(pending[0], self._check)
        if answer == TRY_ANYWAY and pending[0].kind == HelpRequest.CLEAR_THE_WAY:
            self._tell(f'{name[0].upper()}{name[1:]} takes the other objects off the table.')
            self._take_others_away(choice.object, seed)
        if answer == DONE_BY_HAND:
            self._tell(f'{name[0].upper()}{name[1:]} does it by hand.')
            self._move_by_hand(
                choice.object, self._world.action_to(self._world.state(choice.goal))
            )
        given = AskHuman.Request(
            command=AskHuman.Request.ANSWER,
            request_id=choice.id,
            answer=answer,
            answered_by=name,
            object=choice.object,
            action=self._world.actions[choice.action].name,
            stamp=choice.header.stamp,
            goal=goal,
        )
        reply = self._call(self._ask, given)
        if not reply.success:
            raise DemoStoppedError(f'Expected the answer to be accepted, got: {reply.message}')
        self._tell(reply.message)
        captions = {
            DONE_BY_HAND: 'a person helps',
            TRY_ANYWAY: narration.action_caption(self._world, choice),
        }
        return captions.get(answer, 'skipped')

    def _move_by_hand(self, name: str, action: Action) -> None:
        request = ExecuteAction.Request(object=name, action=action.name, world=self._world.label)
        reply = self._call(self._human, request, MOTION_TIMEOUT)
        if not reply.success:
            raise DemoStoppedError(f'Expected the hand to do {action.name}, got: {reply.message}')

    def _wait_for_object(self, name: str, state: State) -> None:
        def seen() -> bool:
            if self._table is None or not self._table.settled:
                return False
            return any(o.name == name and o.state == state for o in self._table.objects)

        what = f'the camera to see the {name} at rest {state.name}'
        self._wait_for(seen, EVENT_TIMEOUT, what)

    def _call(self, client: Any, request: Any, timeout: float = REPLY_TIMEOUT) -> Any:
        future = client.call_async(request)
        self._wait_for(future.done, timeout, f'an answer from {client.srv_name}')
        return future.result()

    def _first(self, kind: type[T], timeout: float, what: str) -> T:
        """The first message of a type since the act began."""
        messages: list[T] = self._wait_for(lambda: self._received[kind], timeout, what)
        return messages[0]

    def _wait_for(self, condition: Callable[[], T | None], timeout: float, what: str) -> T:
        deadline = time.monotonic() + timeout
        while not (value := condition()):
            self._check()
            if time.monotonic() > deadline:
                raise DemoStoppedError(f'Expected {what} within {timeout:.0f} s, got nothing.')
            self._executor.spin_once(timeout_sec=0.1)
        return value

    def _on_message(self, kind: type, message: Any) -> None:
        self._received[kind].append(message)

    def _on_table(self, message: TableState) -> None:
        self._table = message

    def _keep_next_frame(self, title: str) -> None:
        self._frames.clear()
        self._wait_for(lambda: len(self._frames), REPLY_TIMEOUT, 'an image on table_overlay')
        self._keep(title, self._frames.middle())

    def _keep_middle_frame(self, title: str) -> None:
        """Keep the frame from halfway through the last part of the act."""
        if len(self._frames):
            self._keep(title, self._frames.middle())

    def _keep(self, title: str, image: Image) -> None:
        size = image.height, image.width, image.step
        self._panels.append(Panel(title, decode_rgb(image.data, image.encoding, *size)))
        self._frames.clear()


def _decides_anew(choice: Decision, outcome: Outcome) -> bool:
    """Whether another decision on the same demonstration follows an outcome."""
    if outcome.result == Outcome.GOAL_NAMED:
        return True
    return outcome.motion_outcome == MotionOutcome.NOT_FREE and choice.mode in ASKING_MODES


def run_acts(
    world: World,
    acts: Sequence[DemoAct],
    seed: int,
    tell: Callable[[str], None],
    operator: Operator,
    check: Callable[[], None],
) -> tuple[list[DemoActResult], list[StoryboardRow]]:
    """Run the acts in order; stops at the first that cannot be completed.

    check: called between two spins; what it raises ends the run. Signals are left to it.
    """
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = DemoNode(world, tell, operator, check)
    results: list[DemoActResult] = []
    try:
        node.wait_until_ready()
        tell('The cell is ready: arm driver, perception and inference are up.')
        for number, act in enumerate(acts, start=1):
            tell(f'\n{number}. {act.title()}')
            results.append(node.run_act(act, seed))
    except DemoStoppedError as stopped:
        tell(f'The demo stops here. {stopped}')
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return results, node.rows
