"""Self-experience without ROS: the same trials however, wherever and in whatever order made."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from typer.testing import CliRunner, Result

from likeme_core.tabletop import State
from likeme_experiments.learn import app
from likeme_experiments.learning.observed_cell import distance_to_state
from likeme_experiments.learning.offline import NoClusterError, dask_crew, learn, learn_locally
from likeme_experiments.learning.trial_cell import TrialFailedError, make_trial, simulated_robot
from likeme_inference.experience.campaign import Campaign, Progress
from likeme_inference.experience.policy import Random
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Trial
from likeme_inference.tabletop.model_file import load
from likeme_perception.config import PerceptionConfig
from likeme_perception.regions import regions_of

CAMPAIGN = Campaign(simulated_robot(), 'offline-5', 5, ('lemon',), Random(6))


@pytest.fixture
def store(tmp_path: Path) -> Iterator[ExperienceStore]:
    with closing(ExperienceStore(str(tmp_path / 'experience.sqlite'))) as opened:
        yield opened


@pytest.fixture(scope='module')
def alone() -> dict[str, Trial]:
    """Every trial of the campaign, last first, in this process."""
    made = [make_trial(key, CAMPAIGN.seed) for key in reversed(list(CAMPAIGN.plan()))]
    return {trial.key.identity: trial for trial in made}


def facts(store: ExperienceStore) -> dict[str, Trial]:
    """What is recorded; when is no part of it."""
    return {t.key.identity: replace(t, time=0) for t in store.trials()}


def without_time(trials: dict[str, Trial]) -> dict[str, Trial]:
    return {identity: replace(trial, time=0) for identity, trial in trials.items()}


@pytest.mark.slow
def test_two_workers_one_of_whom_dies_make_the_same_trials(
    store: ExperienceStore, alone: dict[str, Trial]
) -> None:
    killed = 0

    def kill_one(_: Trial) -> None:
        nonlocal killed
        if not killed:
            children = psutil.Process().children()
            workers = [c for c in children if 'spawn_main' in ' '.join(c.cmdline())]
            killed = workers[0].pid
            os.kill(killed, signal.SIGKILL)

    learn_locally(Progress(CAMPAIGN, store), store, 2, kill_one)
    assert killed
    assert facts(store) == without_time(alone)
    assert Progress(CAMPAIGN, store).done == 6


@pytest.mark.slow
def test_a_dask_cluster_goes_on_with_a_stopped_campaign(
    store: ExperienceStore, alone: dict[str, Trial]
) -> None:
    from distributed import LocalCluster

    store.record(list(alone.values())[::2])
    said: list[Trial] = []
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster, dask_crew(cluster.scheduler_address) as crew:  # fmt: skip
        learn(Progress(CAMPAIGN, store), store, crew, said.append)
    assert len(said) == 3
    assert facts(store) == without_time(alone)


def test_a_trial_is_what_the_camera_saw(alone: dict[str, Trial]) -> None:
    regions = regions_of(PerceptionConfig(), PerceptionConfig().table)  # type: ignore[arg-type]
    for trial in alone.values():
        x_i = trial.key.pair.x_i
        if trial.before is not None and x_i.name != 'OFFTABLE':
            assert int(regions.state_of(trial.before.x, trial.before.y)) == x_i
        if trial.after is not None and trial.x_f.name != 'OFFTABLE':
            assert int(regions.state_of(trial.after.x, trial.after.y)) == trial.x_f
        assert trial.motion.name == 'OBJECT_OFFTABLE' or trial.after is not None or trial.x_f == 2


def test_a_trial_of_another_body_is_refused() -> None:
    key = replace(next(CAMPAIGN.plan()), robot='sim-of-yesterday')
    with pytest.raises(TrialFailedError, match='Expected the software of the body sim-of-yester'):
        make_trial(key, 5)


def test_nobody_answers_for_the_cluster() -> None:
    with (
        pytest.raises(NoClusterError, match='Expected a Dask scheduler at tcp://127'),
        dask_crew('tcp://127.0.0.1:9', patience=1.0),
    ):
        pass


@pytest.mark.parametrize(
    ('place', 'state', 'distance'),
    [
        ((0.44, 0.2), None, 0.13),
        ((0.44, 0.05), None, 0.05),
        ((0.60, 0.2), None, 0.01),
        ((0.44, -0.5), None, 0.17),
        ((0.60, 0.2), State.RIGHT, 0.2),
        ((0.44, 0.01), State.OFFTABLE, 0.17),
        ((0.44, -0.35), State.LEFT, 0.02),
    ],
)
def test_distance_to_where_a_state_begins(
    place: tuple[float, float], state: State | None, distance: float
) -> None:
    regions = regions_of(PerceptionConfig(), PerceptionConfig().table)  # type: ignore[arg-type]
    assert distance_to_state(regions, *place, state) == pytest.approx(distance)


def learner(*words: str) -> Result:
    return CliRunner().invoke(app, words)


def test_export_import_and_summary(tmp_path: Path, alone: dict[str, Trial]) -> None:
    one, other = str(tmp_path / 'one.sqlite'), str(tmp_path / 'other.sqlite')
    with closing(ExperienceStore(one)) as store:
        store.record(list(alone.values())[:5])
    text, model = str(tmp_path / 'trials.csv'), tmp_path / 'model.csv'
    assert learner('export', text, '--store', one).stdout.startswith('5 trials written')
    said = learner('import', text, one, '--store', other)
    assert (said.exit_code, said.stdout.splitlines()) == (
        0, [f'{text}: 5 trials new, 0 known.', f'{one}: 0 trials new, 5 known.']
    )  # fmt: skip
    assert learner('export', str(model), '--model', '--store', other).exit_code == 0
    assert sum(m.trials for m in load(model).objects.values()) == 5
    summary = json.loads(learner('summary', '--json', '--store', other).stdout)
    assert summary['trials'] == 5
    assert summary['sources'][0]['campaign'] == 'offline-5'


@pytest.mark.parametrize(
    ('words', 'code', 'why'),
    [
        (('summary', '--store', '/no/such/folder/x'), 1, 'no folder'),
        (('summary', '--store', 'absent.sqlite'), 1, 'there is no experience yet'),
        (('import', '/no/such/file', '--store', 'sqlite://'), 1, 'No such file'),
        (('export', '/no/such/folder/t.csv', '--store', 'absent.sqlite'), 1, 'no experience'),
        (
            ('--offline', '--object', 'turnip'),
            2,
            "expected one of pear, lemon, chicken, got 'turnip'",
        ),
        (('--workers', '2'), 2, '--workers and --scheduler are for --offline'),
        (('--offline', '--workers', '0'), 2, "Invalid value for '--workers'"),
        (('--policy', 'astrology'), 2, "'astrology' is not one of"),
        (('--offline', '--store', 'telepathy://x'), 1, 'no driver'),
    ],
)
def test_wrong_words_are_refused_in_one_sentence(
    words: tuple[str, ...], code: int, why: str
) -> None:
    said = learner(*words)
    assert said.exit_code == code
    assert why in ' '.join(said.stderr.replace('│', ' ').split())
    assert isinstance(said.exception, SystemExit)
