"""Simulator on one host, perception and inference on another: two network namespaces."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).parents[1] / 'benchmarks' / 'two_hosts.py'
NO_NAMESPACES = 3
#: With the system's own socket buffers 60 % of the frames are lost; a loaded machine loses some.
MAX_LOST = 0.3


@pytest.mark.graph
@pytest.mark.slow
def test_a_story_over_a_network() -> None:
    done = subprocess.run(
        [sys.executable, str(BENCHMARK), '--json', '--n', '1', '--lossy', '0'],
        capture_output=True, text=True, timeout=280, check=False,
    )  # fmt: skip
    if done.returncode == NO_NAMESPACES:
        pytest.skip(done.stderr.strip())
    report = json.loads(done.stdout)
    bars = {bar['name'].partition(': ')[2]: bar for bar in report['bars']}
    assert bars['demonstrations reported']['measured'] == 1, done.stderr
    assert bars['stories with an outcome']['measured'] == 1, done.stderr
    assert bars['false claims above 0.8']['measured'] == 0, report['notes']
    lost = bars['frames lost']
    assert lost['measured'] < MAX_LOST * lost['n']
