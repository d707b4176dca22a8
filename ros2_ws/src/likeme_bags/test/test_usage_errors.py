"""Wrong usage of bag.sh is one line with the script's name, what was expected and got."""

from __future__ import annotations

import sys

import pytest

from likeme_bags.bag_console import main


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        ('nope', "bag.sh: No such command 'nope'."),
        ('cut', 'bag.sh cut: Missing argument '),
        ('cut bag', "bag.sh cut: Missing option '--out'"),
        ('cut bag --out new --start soon', "bag.sh cut: Invalid value for '--start': "),
        (
            'export bag --out x --format mp4 --fps 500',
            "bag.sh export: Invalid value for '--fps': ",
        ),
        ('export bag --out x --format gif', "bag.sh export: Invalid value for '--format': "),
        ('info bag --nope', 'bag.sh info: No such option: --nope'),
    ],
)
def test_it_is_one_line(
    words: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, 'argv', ['/a/folder/bag.sh', *words.split()])
    with pytest.raises(SystemExit) as ended:
        main()
    printed = capsys.readouterr()
    assert (ended.value.code, printed.out, printed.err.count('\n')) == (2, '', 1)
    assert printed.err.startswith(said)
    if 'Invalid' in said:
        assert printed.err.count(words.split()[-1]) == 1


def test_help_and_exit_codes_are_as_before(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for words, code, said in (('cut --help', 0, '--start'), ('info no_bag', 1, '')):
        monkeypatch.setattr(sys, 'argv', ['bag.sh', *words.split()])
        with pytest.raises(SystemExit) as ended:
            main()
        assert (ended.value.code or 0) == code
        assert said in capsys.readouterr().out
