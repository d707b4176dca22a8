"""Lets these tests import their own helpers and those of the system tests and the benchmarks."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[3]
sys.path[:0] = [str(HERE), str(ROOT / 'tests'), str(ROOT / 'tools'), str(ROOT / 'benchmarks')]
