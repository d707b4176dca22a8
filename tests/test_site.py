"""The documentation's site."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[1]
DOCS = ROOT / 'docs'


def pages(entry: Any) -> list[str]:
    """The pages of a navigation."""
    if isinstance(entry, str):
        return [entry]
    children = entry.values() if isinstance(entry, dict) else entry
    return [page for child in children for page in pages(child)]


def test_every_page_is_in_the_navigation() -> None:
    # Its tags are for mkdocs.
    text = (ROOT / 'mkdocs.yml').read_text('utf-8').replace('!!python/name:', '')
    named = pages(yaml.safe_load(text)['nav'])
    there = {
        str(path.relative_to(DOCS).with_suffix('.md'))
        for ending in ('md', 'ipynb')
        for path in DOCS.rglob(f'*.{ending}')
    }
    assert {page for page in there if not page.startswith('decisions/')} | {'decisions'} == set(
        named
    )


@pytest.mark.skipif(
    importlib.util.find_spec('mkdocs') is None, reason='scripts/docs.sh installs mkdocs'
)
def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    made = subprocess.run(
        [sys.executable, '-m', 'mkdocs', 'build', '-q', '--site-dir', str(tmp_path / 'site')],
        cwd=ROOT,
        env=os.environ | {'NO_MKDOCS_2_WARNING': '1'},
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    assert 'WARNING' not in made.stderr
    reference = (tmp_path / 'site' / 'api' / 'inference' / 'index.html').read_text('utf-8')
    assert 'GoalModel.goal_posterior' in reference
