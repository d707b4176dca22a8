"""Usage errors of a Typer application in one line, with what was expected and got.

As likeme_core.typer_app has them, which this package does not import.
"""

import sys
from typing import Any

import typer

#: Of click, or of the copy of it that newer versions of Typer bring along.
UsageError: Any = next(k for k in typer.BadParameter.__mro__ if k.__name__ == 'UsageError')
USAGE, INTERRUPTED = 2, 130


def run(app: typer.Typer, name: str) -> None:
    """Run an application under a name and exit with its code."""
    try:
        code = app(prog_name=name, standalone_mode=False)
    except UsageError as error:
        if type(error).__name__ == 'NoArgsIsHelpError':
            error.show()
        else:
            called = error.ctx.command_path if error.ctx else name
            print(f'{called}: {usage_sentence(error)}', file=sys.stderr)  # noqa: T201
        code = USAGE
    except typer.Abort:
        print('Interrupted.', file=sys.stderr)  # noqa: T201
        code = INTERRUPTED
    sys.exit(code)


def usage_sentence(error: Any) -> str:
    """The error in one line; newer versions of Typer have what was got in its cause alone."""
    sentence = ' '.join(error.format_message().split())
    for problem in getattr(error.__cause__, 'errors', list)()[:1]:
        said = ' '.join(problem['msg'].split())
        wanted = said.removeprefix('Input should be ').partition(', unable')[0]
        if wanted == said:
            return sentence.replace('Value error, ', '')
        number = 'a number ' if wanted.startswith(('greater', 'less')) else ''
        return sentence.replace(said, f'expected {number}{wanted}, got {problem["input"]!r}.')
    return sentence
