"""Lets these tests import their own helpers, those of likeme_inference and of the graph."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
FAKES = HERE.parents[1] / 'likeme_inference' / 'test'
sys.path[:0] = [str(HERE), str(FAKES), str(HERE.parents[3] / 'tests')]
