"""docs/your-world.md: from nothing to a story on a new table, by the document's own commands."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / 'docs' / 'your-world.md').read_text(encoding='utf-8')
#: Cost of the commands that take minutes, by what is added to them.
SHORTER = {'learn.sh --offline': '--repetitions 1'}

pytestmark = [pytest.mark.graph, pytest.mark.slow]


def commands() -> list[list[str]]:
    """The words of each command of the section "Ten minutes"."""
    section = TEXT.partition('## Ten minutes\n')[2].partition('\n## ')[0]
    block = re.findall(r'```\n(.*?)```', section, re.DOTALL)[0]
    return [shlex.split(line, comments=True) for line in block.splitlines()]


def change(path: Path) -> None:
    """Edit the new file as a reader does: one object, a tray for the polygon, three actions."""
    text = path.read_text(encoding='utf-8').replace('MIDDLE', 'TRAY')
    data = yaml.safe_load(text)
    data['objects'] = [entry for entry in data['objects'] if entry['name'] == 'cube']
    tray = next(region for region in data['regions'] if region['name'] == 'TRAY')
    del tray['polygon']
    tray['rectangle'] = {'x': [0.30, 0.58], 'y': [-0.11, 0.11]}
    wanted = ('PUSH_LEFT', 'PUSH_TRAY', 'PLACE_LEFT')
    data['actions'] = [action for action in data['actions'] if action['name'] in wanted]
    data['story'] = [{'object': 'cube', 'from': 'LEFT', 'to': 'TRAY', 'by': 'push'}]
    path.write_text(yaml.safe_dump(data, sort_keys=False), encoding='utf-8')


def run(words: list[str], folder: Path) -> str:
    """Run one command in a folder; what it printed."""
    name, *rest = words
    added = next((more for known, more in SHORTER.items() if known in ' '.join(words)), '')
    if name.endswith('learn.sh'):
        added += f' --store {folder / "trials.sqlite"}'
    command = [str(ROOT / name), *rest, *added.split()]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, check=False, cwd=folder,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0, f'{words}\n{done.stdout}\n{done.stderr}'
    return ' '.join(done.stdout.split())


@pytest.mark.timeout(900)
def test_from_nothing_to_a_story(tmp_path: Path) -> None:
    new, *rest = commands()
    run(new, tmp_path)
    change(tmp_path / 'my_table.yaml')
    checked, drawn, learned, exported, told = (run(words, tmp_path) for words in rest)
    assert 'regions: LEFT, TRAY, RIGHT, OFFTABLE' in checked
    assert drawn == 'Drawn: my_table.png'
    assert (tmp_path / 'my_table.png').stat().st_size > 10_000
    assert '12 of 12 trials recorded' in learned
    assert exported == '12 trials counted in my_table.csv.'
    assert '1 of 1 acts reached the goal that was shown' in told
    assert 'reached: cube, LEFT to TRAY' in told
