from __future__ import annotations

from pathlib import Path

import pytest

from likeme_arm.hold_keeper_node import only_one


def test_one_keeper_has_the_file(tmp_path: Path) -> None:
    path = tmp_path / 'hold'
    first = only_one(path)
    with pytest.raises(OSError, match='Expected no other hold keeper of this cell'):
        only_one(path)
    first.close()
    only_one(path).close()
