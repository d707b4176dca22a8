"""The annotations that the Typer of Ubuntu 24.04 (0.9) reads."""

from __future__ import annotations

import sys
from enum import StrEnum
from typing import Annotated, Optional, get_type_hints

import pytest
import typer
from typer.testing import CliRunner

from likeme_core.typer_app import App, command_follows, with_optionals


class Mode(StrEnum):
    """Values of an option."""

    ONE = 'one'
    TWO = 'two'


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


def test_an_option_before_a_command_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    app, ran = App(add_completion=False), list[str]()

    @app.callback(invoke_without_command=True)
    def program(context: typer.Context, domain: int = 0) -> None:
        if not command_follows(context):
            ran.append(f'program {domain}')

    @app.command('list')
    def list_command(domain: int = 0) -> None:
        ran.append(f'list {domain}')

    for words in (['--domain', '7'], ['list', '--domain', '7'], ['list']):
        assert CliRunner().invoke(app, words).exit_code == 0
    refused = CliRunner().invoke(app, ['--domain', '7', 'list'])
    assert refused.exit_code == 2
    assert ran == ['program 7', 'list 7', 'list 0']
    assert (
        'expected --domain after list, got it before.' in refused.output + capsys.readouterr().err
    )


def test_a_usage_error_is_one_line_with_the_programs_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    app = App(add_completion=False, rich_markup_mode=None)
    app.command('one')(function)
    app.command('two')(function)
    for words, sentence in (
        (['one', 'x'], 'tool.sh one: Invalid value for '),
        (['one'], 'tool.sh one: Missing argument '),
        (['one', '1', '--b'], 'tool.sh: Option '),
        (['one', '1', '--nope'], 'tool.sh one: No such option: --nope'),
        (['three'], "tool.sh: No such command 'three'"),
    ):
        monkeypatch.setattr(sys, 'argv', ['/a/folder/tool.sh', *words])
        with pytest.raises(SystemExit) as ended:
            app()
        said = capsys.readouterr()
        assert (ended.value.code, said.out) == (2, '')
        assert said.err.startswith(sentence)
        assert said.err.count('\n') == 1


def limited(
    number: Annotated[int, typer.Option(min=1, max=9)] = 1,
    share: Annotated[float, typer.Option(min=0.5)] = 1.0,
    mode: Annotated[Mode, typer.Option()] = Mode.ONE,
) -> None:
    """Takes options with limits."""


@pytest.mark.parametrize(
    'words', [('--number', '10'), ('--number', 'zz'), ('--share', '-3'), ('--share', 'much'),
              ('--mode', 'three')]
)  # fmt: skip
def test_a_wrong_value_is_named(
    words: tuple[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    app = App(add_completion=False, rich_markup_mode=None)
    app.command()(limited)
    monkeypatch.setattr(sys, 'argv', ['tool.sh', *words])
    with pytest.raises(SystemExit):
        app()
    said = capsys.readouterr().err
    assert said.startswith(f"tool.sh: Invalid value for '{words[0]}': ")
    assert said.count(words[1]) == 1
    assert said.count('\n') == 1
