"""The examples of README and docs are run, and their links lead somewhere."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted(
    [
        ROOT / 'README.md',
        ROOT / 'CONTRIBUTING.md',
        *(ROOT / 'docs').rglob('*.md'),
        *(ROOT / 'ros2_ws' / 'src').glob('*/README.md'),
    ]
)


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_examples(document: Path) -> None:
    found = doctest.testfile(str(document), module_relative=False, encoding='utf-8')

    assert found.failed == 0
    prompts = sum(line.startswith('>>> ') for line in document.read_text('utf-8').splitlines())
    assert found.attempted == prompts


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links(document: Path) -> None:
    links = re.findall(r'\]\(([^)#\s]+)', document.read_text('utf-8'))
    gone = [link for link in links if '://' not in link and not (document.parent / link).exists()]

    assert not gone
