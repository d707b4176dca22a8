from __future__ import annotations

from pathlib import Path

import pytest

from likeme_core.state_folder import state_folder


@pytest.mark.parametrize(
    ('domain', 'namespace', 'name'),
    [(0, '/', 'domain_0'), (7, '', 'domain_7'), (0, '/lab/left', 'domain_0.lab.left')],
)
def test_every_domain_and_namespace_has_its_own_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, domain: int, namespace: str, name: str
) -> None:
    monkeypatch.setenv('LIKEME_STATE', str(tmp_path / 'a place'))
    folder = state_folder(domain, namespace)
    assert folder == tmp_path / 'a place' / name
    assert folder.is_dir()


def test_without_the_variable_the_users_state_is_kept_where_xdg_says(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv('LIKEME_STATE')
    monkeypatch.setenv('XDG_STATE_HOME', str(tmp_path))
    assert state_folder(0) == tmp_path / 'likeme' / 'domain_0'
    monkeypatch.delenv('XDG_STATE_HOME')
    monkeypatch.setenv('HOME', str(tmp_path))
    assert state_folder(0) == tmp_path / '.local' / 'state' / 'likeme' / 'domain_0'


def test_a_folder_that_cannot_be_made_is_refused_with_the_variable(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / 'file').write_text('')
    monkeypatch.setenv('LIKEME_STATE', str(tmp_path / 'file'))
    with pytest.raises(OSError, match=r'Expected a folder .*file/domain_0: .* LIKEME_STATE'):
        state_folder(0)
