"""Small bags to read, and what was written into them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from likeme_bags.values import Record

sys.path.insert(0, str(Path(__file__).resolve().parent))

from sample_bags import KINDS, sample_records


@pytest.fixture(scope='session')
def written() -> list[Record]:
    """What every sample bag holds, in the order of log times."""
    return sample_records(seed=11)


@pytest.fixture
def sample(tmp_path: Path, written: list[Record]) -> Callable[[str], Path]:
    """Make a bag of one of the kinds in `sample_bags.KINDS`; a folder or a ROS 1 file."""
    return lambda kind: KINDS[kind][0](tmp_path, written)


@pytest.fixture
def mcap(sample: Callable[[str], Path]) -> Path:
    return sample('mcap zstd')
