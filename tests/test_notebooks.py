"""The notebooks of the documentation run, and print what is stored in them."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from likeme_experiments.evaluation.table1 import PAPER
from notebooks import as_markdown, run_cell, stored_text, text_of

FOLDER = Path(__file__).parents[1] / 'docs' / 'examples'
NOTEBOOKS = sorted(FOLDER.glob('*.ipynb'))


def read(path: Path) -> Any:
    return json.loads(path.read_text('utf-8'))


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_it_prints_what_is_stored(path: Path) -> None:
    names: dict[str, Any] = {}
    code = [cell for cell in read(path)['cells'] if cell['cell_type'] == 'code']
    for cell in code:
        made = {**cell, 'outputs': run_cell(text_of(cell), names)}
        assert stored_text(made) == stored_text(cell), text_of(cell)
        kinds = [[output['output_type'] for output in c['outputs']] for c in (made, cell)]
        assert kinds[0] == kinds[1]
    assert len(code) >= 5
    assert all(cell['outputs'] for cell in code)


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_its_links_lead_somewhere(path: Path) -> None:
    cells = read(path)['cells']
    text = ''.join(text_of(cell) for cell in cells if cell['cell_type'] == 'markdown')
    links = [link for link in re.findall(r'\]\(([^)#\s]+)', text) if '://' not in link]
    assert links
    assert all((path.parent / link).exists() for link in links)


def test_its_table_is_the_papers_but_for_the_misprint() -> None:
    names: dict[str, Any] = {}
    for cell in read(FOLDER / 'table1.ipynb')['cells']:
        if cell['cell_type'] == 'code':
            run_cell(text_of(cell), names)
    printed = {(m.name, name): values for (m, name), values in PAPER.items()}
    assert names['PAPER'] == printed
    others = [
        (key, k)
        for key, values in printed.items()
        for k in range(3)
        if names['table'][key][k] != pytest.approx(values[k], abs=5e-5)
    ]
    assert others == [(('PUSH', 'pear'), 2)]


def test_a_page_has_text_code_what_it_prints_and_figures() -> None:
    cells = [
        {'cell_type': 'markdown', 'source': ['# Title\n', 'Text.']},
        {'cell_type': 'code', 'source': ['print(1)\n', '2'],
         'outputs': run_cell('print(1)\n2', {})},
        {'cell_type': 'code', 'source': ['x'],
         'outputs': [{'output_type': 'display_data', 'data': {'image/png': 'iVBO'}}]},
    ]  # fmt: skip
    assert as_markdown({'cells': cells}) == (
        '# Title\nText.\n\n```python\nprint(1)\n2\n```\n\n```text\n1\n2\n```\n\n'
        '```python\nx\n```\n\n![figure](data:image/png;base64,iVBO)\n'
    )
