"""Figures 4, 5 and 6: their documents, their tables, and that they can be drawn."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from likeme_experiments.commands.reproduce import app
from likeme_experiments.evaluation.gaze_accuracy import GazeErrors
from likeme_experiments.reproductions import gaze, gaze_blindfold
from likeme_experiments.reproductions.gaze_figure import draw_histograms, region_95
from likeme_experiments.reproductions.report import ReproductionOptions, save_files
from likeme_gaze import Gaussian


@pytest.fixture(scope='module')
def errors() -> list[GazeErrors]:
    """Two agents' errors with known medians: |error| uniform in 0 to 2, 4 and 6 degrees."""
    rng = np.random.default_rng(0)
    shape = (5, 375)
    return [
        GazeErrors(
            rng.uniform(-2, 2, 375),
            rng.uniform(-4, 4, shape),
            rng.uniform(-6, 6, shape),
            rng.random(shape) < 0.95,
        )
        for _ in range(2)
    ]


def test_fig_4_by_its_command() -> None:
    result = CliRunner().invoke(app, ['fig4', '--json', '--seeds', '2'])
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document['seeds'] == [1, 2]
    for scene in document['scenes']:
        assert len(scene['goal']) == 8
        assert np.median(scene['distance_off']) < 50


def test_fig_4_is_drawn(tmp_path: Path) -> None:
    report = gaze.figure_4(ReproductionOptions())
    assert 'median distance off' in report.text
    paths = save_files(report, tmp_path, 'fig4')
    assert [path.suffix for path in paths] == ['.png', '.svg']
    assert all(path.stat().st_size > 10_000 for path in paths)


def test_fig_5_summary(errors: list[GazeErrors]) -> None:
    found = gaze.summary(errors)
    assert found['forward']['median'] == pytest.approx(1, abs=0.1)
    assert found['reverse'][4]['median'] == pytest.approx(2, abs=0.2)
    assert found['following'][4]['p90'] == pytest.approx(5.4, abs=0.2)
    assert found['following'][0]['rms'] == pytest.approx(6 / np.sqrt(3), abs=0.2)
    assert found['coverage_95'] == pytest.approx([0.95] * 5, abs=0.03)
    assert [step['observations'] for step in found['reverse']] == [1, 2, 3, 4, 5]


def test_fig_5_is_drawn_as_probabilities(errors: list[GazeErrors]) -> None:
    figure = draw_histograms(errors)
    for axes in figure.axes:
        bars = [patch for patch in axes.patches if hasattr(patch, 'get_height')]
        assert sum(bar.get_height() for bar in bars) == pytest.approx(1)


def test_fig_6(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gaze_blindfold, 'AGENTS', 4)
    report = gaze_blindfold.figure_6(ReproductionOptions())
    scores = {entry['name']: entry['scores']['30'] for entry in report.document['groups']}
    assert {score['agents'] for score in scores.values()} == {4}
    assert scores['baseline']['mean'] > 2 > abs(scores['opaque']['mean'])
    assert report.figure is not None
    assert len(report.figure().axes) == 2
    assert '35 deg' in report.text
    assert max(map(len, report.text.splitlines())) <= 80
    detected = report.document['told_by_movements']
    assert detected['mentors_of_each_kind'] == 16
    assert (
        detected['right_after_each_movement'][-1] > 0.9 > detected['right_after_each_movement'][0]
    )
    assert 'by movements alone' in report.text


def test_a_95_region_holds_95_percent() -> None:
    belief = Gaussian(np.array([3.0, -1.0]), np.array([[4.0, 1.5], [1.5, 1.0]]))
    points = np.random.default_rng(1).multivariate_normal(*belief, 20_000)
    circle = region_95(belief).get_patch_transform().inverted().transform(points)
    inside = np.linalg.norm(circle, axis=1) <= 1
    assert inside.mean() == pytest.approx(0.95, abs=0.01)


def test_an_unused_option_is_rejected() -> None:
    result = CliRunner().invoke(app, ['fig4', '--model', 'shipped'])
    assert result.exit_code == 2
