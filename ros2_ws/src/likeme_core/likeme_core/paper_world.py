"""The paper's world by its names: for reproductions, tests and benchmarks, never for a node."""

from __future__ import annotations

from likeme_core.world.file import load_world

WORLD = load_world('chung2015')
LEFT, RIGHT, OFFTABLE = WORLD.states
PLACE_LEFT, PLACE_RIGHT, PLACE_OFFTABLE, PUSH_LEFT, PUSH_RIGHT, PUSH_OFFTABLE = WORLD.actions
