"""The annotations that the Typer of Ubuntu 24.04 (0.9) reads."""

from __future__ import annotations

from typing import Annotated, Optional, get_type_hints

from typer.testing import CliRunner

from likeme_core.typer_app import App, with_optionals


def function(a: int, b: Annotated[list[str] | None, 'help'] = None, c: str | None = None) -> None:
    """Takes one of each kind."""


def test_what_may_be_none_becomes_optional() -> None:
    assert with_optionals(function).__annotations__ == {
        'a': int,
        'b': Annotated[Optional[list[str]], 'help'],  # noqa: UP045
        'c': Optional[str],  # noqa: UP045
        'return': type(None),
    }
    assert not any('types.UnionType' in repr(type(h)) for h in get_type_hints(function).values())


def test_a_command_with_such_parameters_runs() -> None:
    app = App(add_completion=False)
    app.command()(function)
    assert CliRunner().invoke(app, ['1', '--b', 'x', '--b', 'y']).exit_code == 0
    refused = CliRunner().invoke(app, ['one'])
    assert refused.exit_code == 2
