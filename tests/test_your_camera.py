"""docs/your-camera.md and "Teach an object": their commands exist, and those for files are run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import cv2
import pytest
import yaml
from typer.testing import CliRunner

from likeme_arm_sim.node_settings import SETTINGS, sheets_on_table
from likeme_replay.camera_tools import calibrate, see, teach

ROOT = Path(__file__).parents[1]
CAMERA = (ROOT / 'docs' / 'your-camera.md').read_text(encoding='utf-8')
TEACH = (
    (ROOT / 'docs' / 'your-world.md')
    .read_text(encoding='utf-8')
    .partition('## Teach an object\n')[2]
    .partition('\n## ')[0]
)
APPS = {'see.sh': see.app, 'calibrate.sh': calibrate.app, 'teach.sh': teach.app}


def commands() -> list[list[str]]:
    """The words of each command of both texts, without the folder of the script."""
    text = CAMERA + TEACH
    lines = re.findall(r'^\./scripts/(\S+\.sh.*)$', text, re.MULTILINE)
    lines += re.findall(r'`\./scripts/(\S+\.sh[^`]*)`', text)
    return [shlex.split(line, comments=True) for line in lines]


@pytest.mark.parametrize('words', commands(), ids=' '.join)
def test_a_command_and_its_options_exist(words: list[str]) -> None:
    script = ROOT / 'scripts' / words[0]
    known = script.read_text(encoding='utf-8')
    if words[0] in APPS:
        known = CliRunner().invoke(APPS[words[0]], ['--help']).output
    for option in (word for word in words[1:] if word.startswith('--')):
        assert option in known


def test_the_pair_to_try(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = re.search(r'A pair to try: `(.*?)`, then\s+`(.*?)`', CAMERA)
    assert found is not None
    (tmp_path / 'bags').symlink_to(ROOT / 'bags')
    monkeypatch.chdir(tmp_path)
    for line in found.groups():
        done = CliRunner().invoke(see.app, shlex.split(line)[1:])
        assert done.exit_code == 0, done.output
    assert cv2.imread('seen.png') is not None
    assert cv2.imread('out/see/story_acts.png') is not None


def test_the_parameters_of_a_simulated_board() -> None:
    found = re.search(r'```yaml\n(.*?)```', CAMERA, re.DOTALL)
    assert found is not None
    values = yaml.safe_load(found.group(1))['arm_driver']['ros__parameters']
    assert set(values) <= set(SETTINGS)
    assert len(sheets_on_table(values['calibration_board'])) == 1


def test_what_calibrate_prints_is_that_of_the_text() -> None:
    shown = CAMERA.partition('It prints\n')[2].partition('```\n')[2].partition('```')[0]
    starts = ('Camera in base_link: ', 'Board: ', 'Depth: ', 'Expected error of the pose: ')
    for line, start in zip(shown.splitlines(), starts, strict=False):
        assert line.startswith(start)
    printed = Path(calibrate.__file__).read_text(encoding='utf-8')
    for start in (*starts, 'The file had it '):
        assert f"'{start}" in printed or f'"{start}' in printed
