from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path

import pytest

from likeme_bringup import likeme_command
from likeme_bringup.likeme_command import COMMANDS, main


@pytest.mark.parametrize('name', COMMANDS)
def test_every_command_is_an_entry_point(name: str) -> None:
    module, _, function = COMMANDS[name].partition(':')
    assert callable(getattr(importlib.import_module(module), function))


def test_no_command_line_of_a_package_is_left_out() -> None:
    packages = Path(__file__).parents[2]
    scripts = {
        match.replace('_', '-')
        for setup in packages.glob('*/setup.py')
        for match in re.findall(r"'(\w+) = [\w.]+:\w+'", setup.read_text())
    }
    assert {name for name in scripts if not name.endswith('-node')} - {'likeme'} == set(COMMANDS)


@pytest.mark.parametrize(
    ('words', 'expected'),
    [
        (['stop', '--by', 'Ada'], ['likeme stop', '--by', 'Ada']),
        (['hold', '--domain', '3'], ['likeme cell', 'hold', '--domain', '3']),
    ],
)
def test_the_words_are_passed_on(
    monkeypatch: pytest.MonkeyPatch, words: list[str], expected: list[str]
) -> None:
    called: list[list[str]] = []
    monkeypatch.setattr(likeme_command, 'COMMANDS', dict.fromkeys(COMMANDS, f'{__name__}:run'))
    monkeypatch.setattr(sys.modules[likeme_command.__name__], 'importlib', _Fake(called))
    monkeypatch.setattr(sys, 'argv', ['likeme', *words])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 4
    assert called == [expected]


class _Fake:
    """Stands for importlib: every module has one function, `run`."""

    def __init__(self, called: list[list[str]]) -> None:
        self._called = called

    def import_module(self, _: str) -> _Fake:
        return self

    def run(self) -> int:
        self._called.append(sys.argv)
        return 4


@pytest.mark.parametrize(('words', 'code'), [([], 2), (['fly'], 2), (['--help'], 0)])
def test_other_words_get_the_names(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    code: int,
) -> None:
    monkeypatch.setattr(sys, 'argv', ['likeme', *words])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == code
    told = capsys.readouterr()
    assert 'Expected one of allow, arm, ask-human' in told.out + told.err
