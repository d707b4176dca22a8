"""Files that release 0.1.0 wrote are read, and the same campaign makes the same trials.

release_0_1_0/: learn.sh --offline --seed 11 --policy random --trials 8, export, export --model.
"""

from __future__ import annotations

import math
import shutil
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner

from likeme_core.paper_world import WORLD
from likeme_experiments.commands.learn import app
from likeme_experiments.learning.campaigns import PolicyName, campaign_of
from likeme_experiments.learning.robot_identity import simulated_robot
from likeme_experiments.learning.trial_cell import make_trial
from likeme_experiments.reproductions.models import model_of
from likeme_experiments.reproductions.report import ReproductionOptions
from likeme_inference.experience import trial_file
from likeme_inference.experience.campaign import Progress
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Place, Trial

RELEASED = Path(__file__).parent / 'release_0_1_0'
CAMPAIGN = campaign_of(
    WORLD, 'offline', simulated_robot(WORLD), 11, WORLD.objects, PolicyName.RANDOM, 10, 8
)


@pytest.fixture
def place(tmp_path: Path) -> str:
    """A copy of the released store."""
    return str(shutil.copy(RELEASED / 'experience.sqlite', tmp_path))


def test_a_released_store_is_of_this_robot_and_its_campaign_is_complete(place: str) -> None:
    with closing(ExperienceStore(place, WORLD)) as store:
        assert {trial.key.robot for trial in store.trials()} == {simulated_robot(WORLD)}
        assert list(Progress(CAMPAIGN, store).missing()) == []
    answer = CliRunner().invoke(
        app, ['--offline', '--policy', 'random', '--trials', '8', '--seed', '11', '--store', place]
    )
    assert answer.exit_code == 0, answer.output
    assert '8 of 8 trials recorded' in answer.stdout


def test_a_released_store_is_exported_and_imported_as_before(place: str, tmp_path: Path) -> None:
    for released, flags in (('trials.csv', ()), ('model.csv', ('--model',))):
        out = tmp_path / released
        answer = CliRunner().invoke(app, ['export', str(out), *flags, '--store', place])
        assert answer.exit_code == 0, answer.output
        assert out.read_bytes() == (RELEASED / released).read_bytes()
    other = str(tmp_path / 'other.sqlite')
    for source in (str(RELEASED / 'trials.csv'), place):
        answer = CliRunner().invoke(app, ['import', source, '--store', other])
        assert answer.exit_code == 0, answer.output
    with closing(ExperienceStore(other, WORLD)) as imported:
        trials = {trial.key: trial for trial in imported.trials()}
    assert trials == {
        trial.key: trial for trial in trial_file.load(RELEASED / 'trials.csv', WORLD)
    }


def test_a_released_model_and_store_are_models(place: str) -> None:
    by_file, by_store = (
        model_of(ReproductionOptions(model=str(m))) for m in (RELEASED / 'model.csv', place)
    )
    assert by_file.rows == by_store.rows
    assert sum(known.trials for known in by_file.objects.values()) == 8


@pytest.mark.slow
def test_the_same_campaign_makes_the_trials_of_the_release() -> None:
    """The same outcomes, and places within millimetres.

    To the last bit where also OpenBLAS has the kernels of the same processor (SkylakeX, not Zen or
    Haswell): contacts enlarge what it rounds differently.
    """
    released = trial_file.load(RELEASED / 'trials.csv', WORLD)
    made = {key: make_trial(key, CAMPAIGN.seed, WORLD.source) for key in CAMPAIGN.plan()}
    assert {key: _result(trial) for key, trial in made.items()} == {
        trial.key: _result(trial) for trial in released
    }
    for trial in released:
        again = made[trial.key]
        assert _near(again.before, trial.before)
        assert _near(again.after, trial.after)


def _result(trial: Trial) -> tuple[str, str, int]:
    return trial.x_f.name, trial.motion.name, trial.seed


def _near(one: Place | None, other: Place | None) -> bool:
    """Whether two places, m and rad, are of one run on two processors."""
    if one is None or other is None:
        return one is other
    turn = math.remainder(one.yaw - other.yaw, math.tau)
    return math.dist(one[:2], other[:2]) < 0.005 and abs(turn) < 0.2
