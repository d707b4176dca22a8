"""Commands `list` and `answer`, and the command line `ask_human` of these and the line mode."""

from __future__ import annotations

from typing import Annotated

import typer

from likeme_core.cli import Domain, Network, user_name
from likeme_core.typer_app import App, command_follows
from likeme_inference.console_replies import WORDS, read_answer
from likeme_operator.desk_view import QuestionKey
from likeme_operator.ros.command_output import Json, Name, connected, emit, fail
from likeme_operator.ros.line_mode import line_mode
from likeme_operator.ros.request_text import request_json, request_text
from likeme_operator.ros.views_of_messages import question_key

#: Greatest number of a request: a uint64.
MAX_ID = 2**64 - 1


def list_command(as_json: Json = False, network: Network = False, domain: Domain = 0) -> None:
    """List pending requests."""
    with connected(user_name(), network, domain, as_json) as node:
        pending = node.pending()
        names = node.wait_for_world()
    texts = [request_text(request, names) for request in pending]
    data = {'pending': [request_json(request, names) for request in pending]}
    emit(as_json, data, '\n'.join(texts) or 'Nothing is pending.')


def answer_command(
    request_id: Annotated[
        int, typer.Argument(metavar='ID', min=0, max=MAX_ID, help='Number of the request.')
    ],
    reply: Annotated[str, typer.Argument(metavar='|'.join(WORDS), help='The answer.')],
    by: Name,
    goal: Annotated[
        str, typer.Argument(metavar='[REGION]', help='With goal: the region that is meant.')
    ] = '',
    about: Annotated[
        str,
        typer.Option('--object', help='Object of the request; another one is not answered.'),
    ] = '',
    as_json: Json = False,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Answer a request as `list` shows it now. Exit code 1: refused, 3: no service."""
    try:
        choice = read_answer(f'{reply} {goal}')
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    with connected(by, network, domain, as_json) as node:
        request = next((r for r in node.pending() if r.id == request_id), None)
        # The service says what is wrong with an answer to what is not pending.
        key = QuestionKey(request_id, '', '', 0)
        if request is not None:
            key = question_key(request, node.wait_for_world())
            if about and about.casefold() != request.object.casefold():
                fail(
                    1,
                    f'Expected request {request_id} about {about}, got one about '
                    f'{request.object}: it is not answered.',
                    as_json,
                )
        response = node.answer(key, *choice)
    if not response.success:
        fail(1, response.message, as_json)
    told = {'id': request_id, 'answer': choice.reply.name, 'by': by, 'message': response.message}
    emit(as_json, told, response.message)


def ask_human(
    context: typer.Context, by: Name, network: Network = False, domain: Domain = 0
) -> None:
    """Answer requests of the robot. Without a command: wait for them at the keyboard."""
    if not command_follows(context):
        line_mode(by, network, domain)


app = App(
    help='Answer requests of the robot. Without a command: wait for them and read answers from '
    'the keyboard.',
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.callback(invoke_without_command=True)(ask_human)
app.command('list')(list_command)
app.command('answer')(answer_command)


def main() -> None:
    """Run the command line `ask_human`."""
    app()


if __name__ == '__main__':
    main()
