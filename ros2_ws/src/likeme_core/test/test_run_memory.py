"""What was set in a run, for a node that is started again in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from likeme_core.run_memory import RUN_VARIABLE, RunMemory


def memory(folder: Path, run: str | None = 'a') -> RunMemory:
    return RunMemory(lambda: folder, 'inference_node', run)


def test_the_same_run_finds_what_was_set(tmp_path: Path) -> None:
    first = memory(tmp_path)
    first.parameters['help_threshold'], first.inactive = 0.9, True
    first.save()

    again, other = memory(tmp_path), memory(tmp_path, 'b')
    assert (again.parameters, again.inactive) == ({'help_threshold': 0.9}, True)
    assert (other.parameters, other.inactive) == ({}, False)


def test_without_a_run_nothing_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(RUN_VARIABLE, raising=False)
    alone = memory(tmp_path, None)
    alone.parameters['mode'] = 'sequential'
    alone.save()

    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('text', ['', '{', '[]', '{"run": "a"}', '{"run": "a", "parameters": 1}'])
def test_a_torn_file_is_as_none(tmp_path: Path, text: str) -> None:
    (tmp_path / 'inference_node_in_run.json').write_text(text, encoding='utf-8')

    assert memory(tmp_path).parameters == {}


def test_what_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(OSError, match='No such file'):
        memory(tmp_path / 'gone').save()
