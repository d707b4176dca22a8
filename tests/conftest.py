"""Lets these tests import their own helpers, the tools, and the random worlds of likeme_core."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
CORE = HERE.parent / 'ros2_ws' / 'src' / 'likeme_core' / 'test'
sys.path[:0] = [str(HERE), str(HERE.parent / 'tools'), str(CORE)]
