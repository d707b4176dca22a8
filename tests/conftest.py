"""Lets these tests import their own helpers, the tools and the benchmarks."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / 'tools'), str(HERE.parent / 'benchmarks')]
