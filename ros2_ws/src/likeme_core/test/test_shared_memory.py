from __future__ import annotations

import fcntl
from pathlib import Path

from likeme_core.shared_memory import remove_orphans


def segment(folder: Path, name: str) -> Path:
    lock = folder / f'fastrtps_{name}_el'
    lock.touch()
    (folder / f'fastrtps_{name}').write_bytes(b'pixels')
    return lock


def test_segments_of_the_dead_are_removed_and_others_stay(tmp_path: Path) -> None:
    segment(tmp_path, '0' * 16)
    alive = segment(tmp_path, 'a' * 16)
    (tmp_path / 'fastrtps_port7411_el').touch()
    (tmp_path / 'somebody').touch()
    with alive.open('rb') as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert remove_orphans(tmp_path, least_age=0.0) == 1
    left = {path.name for path in tmp_path.iterdir()}
    living = f'fastrtps_{"a" * 16}'
    assert left == {living, f'{living}_el', 'fastrtps_port7411_el', 'somebody'}


def test_a_segment_that_was_just_made_is_left_alone(tmp_path: Path) -> None:
    segment(tmp_path, '0' * 16)
    assert remove_orphans(tmp_path, least_age=60.0) == 0
    assert remove_orphans(tmp_path / 'absent') == 0
