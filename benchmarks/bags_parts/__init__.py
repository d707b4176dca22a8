"""What `bench.sh bags` measures, a part a module; each gives its bars and notes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

from report import Bar

#: Developer tools are no package.
sys.path.append(str(Path(__file__).resolve().parents[2] / 'tools'))

Measured = tuple[list[Bar], dict[str, object]]


class Effort(NamedTuple):
    """How much is measured.

    runs: in lockstep. seconds: of 640x480 RGB-D at 30 Hz. damaged: bags.
    """

    runs: int
    seconds: int
    damaged: int
