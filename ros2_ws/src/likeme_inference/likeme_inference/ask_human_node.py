"""CLI client of ask_human: list pending requests, answer one, or wait for requests."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import rclpy
import typer
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rich.console import Console
from rich.markup import escape

from likeme_core.cli import Domain, Network, set_discovery, user_name
from likeme_core.ros.qos import LATCHED
from likeme_core.ros.world import WorldNames, WorldSubscriber
from likeme_core.typer_app import App
from likeme_inference.console_replies import WORDS, menu, read_reply
from likeme_inference.keyboard import DISCARDED, Keyboard
from likeme_inference.tabletop.values import Reply
from likeme_msgs.msg import Decision, HelpRequest, Outcome
from likeme_msgs.srv import AskHuman

#: s to wait for the service and for its response.
SERVICE_TIMEOUT = 8.0
#: s of a spin between two checks.
SPIN_PERIOD = 0.1
#: s to wait for the topic world.
WORLD_TIMEOUT = 2.0

app = App(
    help='Answer requests of the robot. Without a command: wait for them and read answers from '
    'the keyboard.',
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


Name = Annotated[
    str,
    typer.Option(
        '--by',
        help='Name of the operator.',
        default_factory=user_name,
        show_default='the user name',
    ),
]


class ServiceAbsentError(Exception):
    """The service ask_human is absent or does not respond."""


class AskHumanClient(Node):
    """Client of ask_human.

    Subscribes:
        decision (Decision, transient local): announces new requests
        outcome (Outcome, transient local): how they ended
        world (World, transient local): the names of states and actions
    Client:
        ask_human (AskHuman)
    """

    def __init__(self) -> None:
        super().__init__('operator_node')
        self._client = self.create_client(AskHuman, 'ask_human')
        self._announced = False
        self._outcome = Outcome()
        self.create_subscription(Decision, 'decision', self._on_decision, LATCHED)
        self.create_subscription(Outcome, 'outcome', self._on_outcome, LATCHED)
        self._world = WorldSubscriber(self)

    def pending(self) -> list[HelpRequest]:
        """Pending requests, oldest first."""
        return list(self._call(AskHuman.Request(command=AskHuman.Request.LIST)).pending)

    def names(self) -> WorldNames:
        """The names of states and actions; their numbers if nobody publishes them."""
        return self._world.wait(WORLD_TIMEOUT)

    def answer(self, request: HelpRequest, reply: Reply, by: str) -> Any:
        """Answer a request as it was read; returns the service's response."""
        action = self.names().action(request.action) if request.object else ''
        return self._call(
            AskHuman.Request(
                command=AskHuman.Request.ANSWER,
                request_id=request.id,
                answer=reply,
                answered_by=by,
                object=request.object,
                action=action,
                stamp=request.header.stamp,
            )
        )

    def wait_for_request(self) -> HelpRequest:
        """Wait for a pending request; returns the oldest."""
        while True:
            self._announced = False
            if pending := self.pending():
                return pending[0]
            while not self._announced:
                rclpy.spin_once(self, timeout_sec=SPIN_PERIOD)

    def wait_for_outcome(self, request: HelpRequest) -> str:
        """Wait until an answered request has ended; returns how, in one sentence."""
        while self._outcome.decision_id < request.id:
            rclpy.spin_once(self, timeout_sec=SPIN_PERIOD)
        ended = self._outcome.decision_id == request.id
        return str(self._outcome.sentence) if ended else ''

    def _on_outcome(self, outcome: Outcome) -> None:
        self._outcome = outcome

    def _on_decision(self, decision: Decision) -> None:
        self._announced = self._announced or decision.kind == Decision.ASK_HUMAN

    def _call(self, request: AskHuman.Request) -> Any:
        deadline = time.monotonic() + SERVICE_TIMEOUT
        while not self._client.service_is_ready():
            if time.monotonic() > deadline:
                raise ServiceAbsentError(
                    f'Expected the service ask_human within {SERVICE_TIMEOUT:g} s, got none: '
                    'is the inference node running?'
                )
            rclpy.spin_once(self, timeout_sec=SPIN_PERIOD)
        future = self._client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=SERVICE_TIMEOUT)
        if not future.done():
            raise ServiceAbsentError(f'Expected an answer within {SERVICE_TIMEOUT:g} s, got none.')
        return future.result()


@contextmanager
def ask_human_client(network: bool, domain: int) -> Iterator[AskHumanClient]:
    """A node for one command; Ctrl-C and an absent service set the exit code."""
    set_discovery(network)
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = AskHumanClient()
    try:
        yield node
    except ServiceAbsentError as error:
        print_line(Console(stderr=True), str(error))
        raise typer.Exit(3) from error
    except (KeyboardInterrupt, ExternalShutdownException):
        Console(stderr=True).print('Bye.')
        raise typer.Exit(0) from None
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


@app.command('list')
def list_pending(network: Network = False, domain: Domain = 0) -> None:
    """List pending requests."""
    console = Console()
    with ask_human_client(network, domain) as node:
        pending = node.pending()
        names = node.names()
    if not pending:
        console.print('Nothing is pending.')
    for request in pending:
        print_request(console, request, names)


@app.command()
def answer(
    request_id: Annotated[int, typer.Argument(metavar='ID', min=0, help='Number of the request.')],
    reply: Annotated[str, typer.Argument(metavar='|'.join(WORDS), help='The answer.')],
    by: Name,
    about: Annotated[
        str,
        typer.Option('--object', help='Object of the request; another one is not answered.'),
    ] = '',
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Answer a request as `list` shows it now. Exit code 1: refused, 3: no service."""
    try:
        choice = read_reply(reply)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    with ask_human_client(network, domain) as node:
        # The service says what is wrong with an answer to what is not pending.
        unread = HelpRequest(id=request_id)
        request = next((r for r in node.pending() if r.id == request_id), unread)
        if request is not unread and about and about.casefold() != request.object.casefold():
            print_line(
                Console(stderr=True),
                f'Expected request {request_id} about {about}, got one about {request.object}: '
                'it is not answered.',
            )
            raise typer.Exit(1)
        response = node.answer(request, choice, by)
    print_line(Console(stderr=not response.success), response.message)
    if not response.success:
        raise typer.Exit(1)


@app.callback(invoke_without_command=True)
def wait_for_requests(
    context: typer.Context, by: Name, network: Network = False, domain: Domain = 0
) -> None:
    """Answer requests of the robot. Without a command: wait for them at the keyboard."""
    if context.invoked_subcommand is not None:
        return
    console, keyboard = Console(), Keyboard(sys.stdin.fileno())
    with ask_human_client(network, domain) as node:
        console.print('Waiting for requests of the robot. Ctrl-C ends.')
        while True:
            request = node.wait_for_request()
            print_request(console, request, node.names())
            if keyboard.discard():
                console.print(DISCARDED)
            try:
                choice = read_answer(console, keyboard)
            except EOFError:
                console.print(f'No more input: request {request.id} stays unanswered.')
                raise typer.Exit(1) from None
            response = node.answer(request, choice, by)
            print_line(console, response.message)
            if response.success and (sentence := node.wait_for_outcome(request)):
                print_line(console, sentence)


def read_answer(console: Console, keyboard: Keyboard) -> Reply:
    """Read lines from the keyboard until one is a valid answer.

    Raises:
        EOFError: at the end of the input.
    """
    while True:
        try:
            # The prompt says that what is typed from here on is read.
            console.print('> ', end='')
            return read_reply(keyboard.line())
        except ValueError as error:
            print_line(console, str(error))


def print_line(console: Console, sentence: str) -> None:
    """Print text without markup on one line."""
    console.print(escape(sentence), soft_wrap=True, highlight=False)


def print_request(console: Console, request: HelpRequest, names: WorldNames) -> None:
    """Print a request and the answers that can be given."""
    goal, action = names.state(request.goal), names.action(request.action)
    console.print(f'[bold]Request {request.id}[/bold]', end=': ')
    print_line(console, request.question)
    print_line(
        console,
        f'  {request.object} is {names.state(request.x_i)}, wanted {goal}; best action {action}, '
        f'p = {request.predicted_success:.2f}, threshold {request.threshold:.2f}',
    )
    print_line(console, menu(request.options, request.object, goal, action))


def main() -> None:
    """Run the command line."""
    app(prog_name='ask_human')


if __name__ == '__main__':
    main()
