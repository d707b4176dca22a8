"""Runs notebooks without Jupyter: `./scripts/run.sh python tools/notebooks.py NOTEBOOK...`.

Writes what each cell prints, its last value and its figure into the file, as Jupyter would.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import sys
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt


def text_of(cell: dict[str, Any]) -> str:
    """The text of a cell."""
    return ''.join(cell['source'])


def stored_text(cell: dict[str, Any]) -> str:
    """What a cell's stored outputs print."""
    texts = [o.get('text') or o.get('data', {}).get('text/plain', []) for o in cell['outputs']]
    return ''.join(''.join(text) for text in texts)


def run_cell(source: str, names: dict[str, Any]) -> list[dict[str, Any]]:
    """The outputs of a cell; names: of the cells before, and of this one afterwards."""
    tree, printed, value = ast.parse(source), io.StringIO(), None
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, '<cell>', 'exec'), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), '<cell>', 'eval'), names)
    outputs: list[dict[str, Any]] = []
    if printed.getvalue():
        text = printed.getvalue().splitlines(keepends=True)
        outputs.append({'output_type': 'stream', 'name': 'stdout', 'text': text})
    if plt.get_fignums():
        outputs.append({'output_type': 'display_data', 'metadata': {}, 'data': _picture()})
    elif value is not None:
        data = {'text/plain': repr(value).splitlines(keepends=True)}
        outputs.append({'output_type': 'execute_result', 'metadata': {}, 'data': data,
                        'execution_count': None})  # fmt: skip
    return outputs


def _picture() -> dict[str, Any]:
    drawn = io.BytesIO()
    plt.gcf().savefig(drawn, format='png', dpi=110, bbox_inches='tight', metadata={'Software': ''})
    plt.close('all')
    return {'image/png': base64.b64encode(drawn.getvalue()).decode()}


def as_markdown(notebook: dict[str, Any]) -> str:
    """A notebook as a page, its figures within."""
    parts = []
    for cell in notebook['cells']:
        if cell['cell_type'] == 'markdown':
            parts.append(text_of(cell))
            continue
        parts.append(f'```python\n{text_of(cell)}\n```')
        if printed := stored_text(cell):
            parts.append(f'```text\n{printed.rstrip()}\n```')
        pictures = [o['data'].get('image/png') for o in cell['outputs'] if 'data' in o]
        parts += [f'![figure](data:image/png;base64,{p.strip()})' for p in pictures if p]
    return '\n\n'.join(parts) + '\n'


def main(*paths: str) -> None:
    """Run the notebooks and store their outputs."""
    for path in map(Path, paths):
        notebook = json.loads(path.read_text('utf-8'))
        names: dict[str, Any] = {}
        for cell in notebook['cells']:
            if cell['cell_type'] == 'code':
                cell['outputs'] = run_cell(text_of(cell), names)
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + '\n', 'utf-8')


if __name__ == '__main__':
    main(*sys.argv[1:])
