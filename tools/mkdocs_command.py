"""Run a command of mkdocs for scripts/docs.sh: a usage error is one line."""

from __future__ import annotations

import sys

import click
from mkdocs.__main__ import cli

USAGE = 2


def main() -> int:
    """Run `mkdocs` with the arguments of this program; the exit code."""
    program, command, *words = sys.argv
    try:
        cli([command, *words], prog_name=program, standalone_mode=False)
    except click.NoSuchOption as error:
        said = f'Expected an option of mkdocs {command}, got {error.option_name}.'
    except click.UsageError as error:
        said = ' '.join(error.format_message().split())
    except click.ClickException as error:
        error.show()
        return error.exit_code
    else:
        return 0
    print(f'{program}: {said}', file=sys.stderr)
    return USAGE
