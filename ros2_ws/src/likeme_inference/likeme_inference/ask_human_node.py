"""The operator's side of ask_human: list what is pending, answer it, or wait for questions."""

from __future__ import annotations

import getpass
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import rclpy
import typer
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rich.console import Console
from rich.markup import escape

from likeme_core.tabletop import Action, State
from likeme_inference.console_replies import MENU, WORDS, read_reply
from likeme_inference.tabletop.values import Reply
from likeme_msgs.msg import Decision, HelpRequest
from likeme_msgs.srv import AskHuman

#: s; with the start of Python, a console without a cell says so within 10.
SERVICE_WAIT = 8.0
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

app = typer.Typer(
    help='Answer the questions of the robot. Without a command: wait for them at the keyboard.',
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def user_name() -> str:
    """Name of who sits at the keyboard, as far as the system knows."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return 'operator'


Name = Annotated[
    str,
    typer.Option(
        '--by', help='Who answers.', default_factory=user_name, show_default='the user name'
    ),
]
Network = Annotated[
    bool, typer.Option('--network', help='Look for the cell on other machines of the subnet too.')
]
#: 232 is the greatest domain that DDS has ports for.
Domain = Annotated[int, typer.Option(min=0, max=232, envvar='ROS_DOMAIN_ID', help='ROS domain.')]


class ServiceAbsentError(Exception):
    """ask_human is not there, or gives no answer."""


class OperatorNode(Node):
    """A person's ear and mouth.

    Subscribes:
        decision (Decision, transient local): tells when there is something to ask for
    Client:
        ask_human (AskHuman)
    """

    def __init__(self) -> None:
        super().__init__('operator_node')
        self._client = self.create_client(AskHuman, 'ask_human')
        self._asked = False
        self.create_subscription(Decision, 'decision', self._on_decision, LATCHED)

    def pending(self) -> list[HelpRequest]:
        """Questions that wait for an answer, oldest first."""
        return list(self._call(AskHuman.Request(command=AskHuman.Request.LIST)).pending)

    def answer(self, request_id: int, reply: Reply, by: str) -> Any:
        """Answer one; the service's response."""
        return self._call(
            AskHuman.Request(
                command=AskHuman.Request.ANSWER,
                request_id=request_id,
                answer=reply,
                answered_by=by,
            )
        )

    def wait_for_question(self) -> HelpRequest:
        """Wait as long as it takes; the oldest question."""
        while True:
            self._asked = False
            if pending := self.pending():
                return pending[0]
            while not self._asked:
                rclpy.spin_once(self, timeout_sec=1.0)

    def _on_decision(self, decision: Decision) -> None:
        self._asked = self._asked or decision.kind == Decision.ASK_HUMAN

    def _call(self, request: AskHuman.Request) -> Any:
        deadline = time.monotonic() + SERVICE_WAIT
        while not self._client.service_is_ready():
            if time.monotonic() > deadline:
                raise ServiceAbsentError(
                    f'Expected the service ask_human within {SERVICE_WAIT:g} s, got none: '
                    'is the inference node running?'
                )
            rclpy.spin_once(self, timeout_sec=0.1)
        future = self._client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=SERVICE_WAIT)
        if not future.done():
            raise ServiceAbsentError(f'Expected an answer within {SERVICE_WAIT:g} s, got none.')
        return future.result()


@contextmanager
def operator(network: bool, domain: int) -> Iterator[OperatorNode]:
    """Give a node for one command; Ctrl-C and a missing service end it with the right code."""
    if network:
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET'
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = OperatorNode()
    try:
        yield node
    except ServiceAbsentError as error:
        say(Console(stderr=True), str(error))
        raise typer.Exit(3) from error
    except (KeyboardInterrupt, ExternalShutdownException):
        Console(stderr=True).print('Bye.')
        raise typer.Exit(0) from None
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


@app.command('list')
def list_pending(network: Network = False, domain: Domain = 0) -> None:
    """Show the questions that wait for an answer."""
    console = Console()
    with operator(network, domain) as node:
        pending = node.pending()
    if not pending:
        console.print('Nothing is pending.')
    for request in pending:
        show(console, request)


@app.command()
def answer(
    request_id: Annotated[int, typer.Argument(metavar='ID', min=0, help='Number of the request.')],
    reply: Annotated[str, typer.Argument(metavar='|'.join(WORDS), help='What to answer.')],
    by: Name,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Answer one question. Exit code 1: refused, 3: no service."""
    try:
        meant = read_reply(reply)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    with operator(network, domain) as node:
        response = node.answer(request_id, meant, by)
    say(Console(stderr=not response.success), response.message)
    if not response.success:
        raise typer.Exit(1)


@app.callback(invoke_without_command=True)
def wait_at_the_keyboard(
    context: typer.Context, by: Name, network: Network = False, domain: Domain = 0
) -> None:
    """Answer the questions of the robot. Without a command: wait for them at the keyboard."""
    if context.invoked_subcommand is not None:
        return
    console = Console()
    with operator(network, domain) as node:
        console.print('Waiting for questions of the robot. Ctrl-C leaves.')
        while True:
            request = node.wait_for_question()
            show(console, request)
            console.print(MENU)
            try:
                meant = ask_keyboard(console)
            except EOFError:
                console.print(f'No more input: request {request.id} stays unanswered.')
                raise typer.Exit(1) from None
            say(console, node.answer(request.id, meant, by).message)


def ask_keyboard(console: Console) -> Reply:
    """Read lines until one is an answer.

    Raises:
        EOFError: when the keyboard is gone.
    """
    while True:
        try:
            return read_reply(console.input('> '))
        except ValueError as error:
            say(console, str(error))


def say(console: Console, sentence: str) -> None:
    """Print a sentence as it is, on one line."""
    console.print(escape(sentence), soft_wrap=True, highlight=False)


def show(console: Console, request: HelpRequest) -> None:
    """Print a question with its numbers."""
    console.print(f'[bold]Request {request.id}[/bold]', end=': ')
    say(console, request.question)
    say(
        console,
        f'  {request.object} is {State(request.x_i).name}, wanted '
        f'{State(request.goal).name}; best action {Action(request.action).name}, '
        f'p = {request.predicted_success:.2f}, threshold {request.threshold:.2f}',
    )


def main() -> None:
    """Run the command line."""
    app(prog_name='ask_human')


if __name__ == '__main__':
    main()
