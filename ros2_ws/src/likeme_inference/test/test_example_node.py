"""The node that docs/your-node.md has people start."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from fakes import Camera

from graph import Graph

pytestmark = pytest.mark.graph
DOCS = Path(__file__).parents[4] / 'docs'


def test_it_says_what_the_person_wants(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node')
        example = graph.run('example', sys.executable, str(DOCS / 'examples' / 'goal_listener.py'))
        camera = Camera(graph)
        line = 'pear from RIGHT to LEFT: LEFT 0.88, RIGHT 0.12, OFFTABLE 0.00'
        assert line in (DOCS / 'your-node.md').read_text('utf-8')
        camera.show('pear', 1, 0)
        graph.until(lambda: line in example.said, 30, 'the line')
        assert example.stop() == 0
