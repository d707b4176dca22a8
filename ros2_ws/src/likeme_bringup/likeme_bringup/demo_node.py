"""The narrator of the demo: plays the person's part over real services, tells what comes back."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Image

from likeme_bringup import story
from likeme_bringup.storyboard import Panel, Row
from likeme_core.tabletop import Action, State
from likeme_msgs.msg import Decision, Demonstration, GoalBelief, Outcome, TableState
from likeme_msgs.srv import AskHuman, ExecuteAction, ResetCell
from likeme_perception.rgbd import decode_rgb

T = TypeVar('T')
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
DONE_BY_HAND = AskHuman.Request.DONE_BY_HAND
TRY_ANYWAY = AskHuman.Request.TRY_ANYWAY
# Who answers ask_human: gives an AskHuman constant and a name for (request, pause). Who takes long
# calls `pause()` now and then: it raises when the story cannot go on.
Operator = Callable[[Any, Callable[[], None]], tuple[int, str]]


class StoryStoppedError(Exception):
    """The story cannot go on; the sentence says what was expected and what came."""


class DemoNode(Node):
    """Plays one act after another and narrates.

    Subscribes: table_state, demonstration, goal_belief, decision, outcome, table_overlay.
    Calls: cell/reset, human/execute_action, ask_human.
    """

    def __init__(
        self, tell: Callable[[str], None], operator: Operator, alive: Callable[[], None]
    ) -> None:
        super().__init__('demo')
        self._tell = tell
        self._operator = operator
        self._alive = alive
        # What the graph said since the act began, by its type.
        self._heard: dict[type, list[Any]] = defaultdict(list)
        self._table: TableState | None = None
        self._reel: list[Image] = []
        self._panels: list[Panel] = []
        self.rows: list[Row] = []
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        self.create_subscription(TableState, 'table_state', self._on_table, 1)
        for kind, topic, qos in (
            (Demonstration, 'demonstration', 10),
            (GoalBelief, 'goal_belief', LATCHED),
            (Decision, 'decision', LATCHED),
            (Outcome, 'outcome', LATCHED),
        ):
            self.create_subscription(kind, topic, partial(self._hear, kind), qos)
        self.create_subscription(
            Image, 'table_overlay', self._reel.append, qos_profile_sensor_data
        )
        self._human = self.create_client(ExecuteAction, 'human/execute_action')
        self._arm = self.create_client(ExecuteAction, 'arm/execute_action')
        self._reset = self.create_client(ResetCell, 'cell/reset')
        self._ask = self.create_client(AskHuman, 'ask_human')

    def wait_until_ready(self, timeout: float) -> None:
        """Return when every service is there and perception has a first table state."""
        for client in (self._human, self._arm, self._reset, self._ask):
            self._until(client.service_is_ready, timeout, f'the service {client.srv_name}')
        self._until(lambda: self._table, timeout, 'a first table_state from perception')

    def play(self, act: story.Act, seed: int) -> story.Ending:
        """Play one act from the set table to the outcome. Raises StoryStoppedError."""
        self._panels = []
        self._heard.clear()
        self.rows.append(Row(act.title(), self._panels))
        self._set_the_table(act, seed)
        self._snap('before')
        self._show(act)
        self._put_back(act)
        choice = self._next_decision()
        self._tell(story.decision(choice, act))
        asked, middle = choice.kind == Decision.ASK_HUMAN, story.acting(choice)
        if asked:
            middle = self._answer(choice)
        elif choice.kind != Decision.EXECUTE:
            raise StoryStoppedError(f'Expected the robot to act or to ask, got: {choice.sentence}')
        else:
            self._tell('The robot acts.')
        outcome = self._until(
            lambda: next((o for o in self._heard[Outcome] if o.decision_id == choice.id), None),
            120.0,
            'an outcome of the decision',
        )
        self._keep_middle(middle)
        self._tell(outcome.sentence)
        self._snap(f'after: {story.RESULTS[outcome.result]}')
        reached = outcome.result == Outcome.REACHED and outcome.goal == act.end
        return story.Ending(act, reached, asked, outcome.sentence)

    def _set_the_table(self, act: story.Act, seed: int) -> None:
        request = ResetCell.Request(objects=[act.object], states=[int(act.start)], seed=seed)
        reply = self._call(self._reset, request, 20.0)
        if not reply.success:
            raise StoryStoppedError(f'Expected the table to be set, got: {reply.message}')
        self._wait_for_object(act.object, act.start, 20.0)
        self._tell(story.table(self._table))

    def _show(self, act: story.Act) -> None:
        self._tell(f'A person shows: {act.title()}.')
        self._by_hand(act.object, act.action)
        demo = self._first(Demonstration, 20.0, 'a demonstration event')
        self._keep_middle('a person shows')
        self._tell(story.demonstration(demo))
        if (demo.object, demo.x_i, demo.x_f) != (act.object, act.start, act.end):
            raise StoryStoppedError(
                f'Expected to see {act.title()}; the camera saw something else.'
            )
        self._tell(story.belief(self._first(GoalBelief, 10.0, 'a goal belief')))

    def _put_back(self, act: story.Act) -> None:
        at_goal = self._next_decision()
        self._tell(at_goal.sentence)
        if at_goal.kind != Decision.AT_GOAL:
            raise StoryStoppedError(
                f'Expected the robot to want the {act.object} {act.end.name}, where it is.'
            )
        self._tell(
            f'The person puts the {act.object} back {act.start.name}; the robot looks again.'
        )
        self._by_hand(act.object, act.undo)
        self._reel.clear()

    def _next_decision(self) -> Decision:
        choice = self._first(Decision, 20.0, 'a decision of the robot')
        self._heard[Decision].remove(choice)
        return choice

    def _answer(self, choice: Decision) -> str:
        """Have the question answered; what goes on then, as a caption."""
        listed = self._call(self._ask, AskHuman.Request(command=AskHuman.Request.LIST), 10.0)
        pending = [request for request in listed.pending if request.id == choice.id]
        if not pending:
            raise StoryStoppedError(
                f'Expected request {choice.id} to be pending, got: {listed.message}'
            )
        self._tell(f'The robot asks: {pending[0].question}')
        answer, name = self._operator(pending[0], self._check)
        if answer == DONE_BY_HAND:
            self._tell(f'{name[0].upper()}{name[1:]} does it by hand.')
            self._by_hand(choice.object, Action(choice.goal))
        given = AskHuman.Request(
            command=AskHuman.Request.ANSWER, request_id=choice.id, answer=answer, answered_by=name
        )
        reply = self._call(self._ask, given, 10.0)
        if not reply.success:
            raise StoryStoppedError(f'Expected the answer to be taken, got: {reply.message}')
        self._tell(reply.message)
        captions = {DONE_BY_HAND: 'a person helps', TRY_ANYWAY: story.acting(choice)}
        return captions.get(answer, 'skipped')

    def _by_hand(self, name: str, action: Action) -> None:
        request = ExecuteAction.Request(object=name, action=int(action))
        reply = self._call(self._human, request, 60.0)
        if not reply.success:
            raise StoryStoppedError(f'Expected the hand to do {action.name}, got: {reply.message}')

    def _wait_for_object(self, name: str, state: State, timeout: float) -> None:
        def seen() -> bool:
            if self._table is None or not self._table.settled:
                return False
            return any(o.name == name and o.state == state for o in self._table.objects)

        self._until(seen, timeout, f'the camera to see the {name} at rest {state.name}')

    def _call(self, client: Any, request: Any, timeout: float) -> Any:
        future = client.call_async(request)
        self._until(future.done, timeout, f'an answer from {client.srv_name}')
        return future.result()

    def _first(self, kind: type[T], timeout: float, what: str) -> T:
        """The first message of a type that was heard since the act began."""
        return self._until(lambda: self._heard[kind], timeout, what)[0]

    def _until(self, predicate: Callable[[], T | None], timeout: float, what: str) -> T:
        deadline = time.monotonic() + timeout
        while not (value := predicate()):
            self._check()
            if time.monotonic() > deadline:
                raise StoryStoppedError(f'Expected {what} within {timeout:.0f} s, got nothing.')
            self._executor.spin_once(timeout_sec=0.1)
        return value

    def _check(self) -> None:
        self._alive()
        if not rclpy.ok():
            raise StoryStoppedError('Interrupted.')

    def _hear(self, kind: type, message: Any) -> None:
        self._heard[kind].append(message)

    def _on_table(self, message: TableState) -> None:
        self._table = message

    def _snap(self, title: str) -> None:
        """Keep the next picture that perception draws."""
        self._reel.clear()
        self._until(lambda: self._reel, 10.0, 'a picture on table_overlay')
        self._keep(title, self._reel[-1])

    def _keep_middle(self, title: str) -> None:
        """Keep the picture from half way through what just went on."""
        if self._reel:
            self._keep(title, self._reel[len(self._reel) // 2])

    def _keep(self, title: str, image: Image) -> None:
        size = image.height, image.width, image.step
        self._panels.append(Panel(title, decode_rgb(image.data, image.encoding, *size)))
        self._reel.clear()


def play_story(
    acts: Sequence[story.Act],
    seed: int,
    tell: Callable[[str], None],
    operator: Operator,
    alive: Callable[[], None],
) -> tuple[list[story.Ending], list[Row]]:
    """Play the acts in order in a node of their own; stops at the first that cannot go on."""
    rclpy.init()
    node = DemoNode(tell, operator, alive)
    endings: list[story.Ending] = []
    try:
        node.wait_until_ready(60.0)
        tell('The cell is ready: arm driver, perception and inference are up.')
        for number, act in enumerate(acts, start=1):
            tell(f'\n{number}. {act.title()}')
            endings.append(node.play(act, seed))
    except StoryStoppedError as stopped:
        tell(f'The story stops here. {stopped}')
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return endings, node.rows
