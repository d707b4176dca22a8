"""Offline learning: trials do not depend on workers, order or crashes."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from typer.testing import CliRunner, Result

from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_core.tabletop import State
from likeme_experiments.commands.learn import app
from likeme_experiments.learning.cell_perception import distance_to_state
from likeme_experiments.learning.offline import NoClusterError, dask_pool, learn, learn_locally
from likeme_experiments.learning.robot_identity import simulated_robot
from likeme_experiments.learning.trial_cell import TrialFailedError, make_trial
from likeme_inference.experience.campaign import Campaign, Progress
from likeme_inference.experience.exploration_policy import Random
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Trial
from likeme_inference.tabletop.model_file import load

CAMPAIGN = Campaign(WORLD, simulated_robot(WORLD), 'offline-5', 5, ('lemon',), Random(6))


@pytest.fixture
def store(tmp_path: Path) -> Iterator[ExperienceStore]:
    with closing(ExperienceStore(str(tmp_path / 'experience.sqlite'), WORLD)) as opened:
        yield opened


@pytest.fixture(scope='module')
def alone() -> dict[str, Trial]:
    """Every trial of the campaign, last first, in this process."""
    made = [
        make_trial(key, CAMPAIGN.seed, WORLD.source) for key in reversed(list(CAMPAIGN.plan()))
    ]
    return {trial.key.identity: trial for trial in made}


def facts(store: ExperienceStore) -> dict[str, Trial]:
    """The recorded trials without their times."""
    return {t.key.identity: replace(t, time=0) for t in store.trials()}


def without_time(trials: dict[str, Trial]) -> dict[str, Trial]:
    return {identity: replace(trial, time=0) for identity, trial in trials.items()}


@pytest.mark.slow
def test_two_workers_make_the_same_trials_although_one_is_killed(
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
def test_a_dask_cluster_continues_a_stopped_campaign(
    store: ExperienceStore, alone: dict[str, Trial]
) -> None:
    distributed = pytest.importorskip('distributed')
    store.record(list(alone.values())[::2])
    made: list[Trial] = []
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster, dask_pool(cluster.scheduler_address) as pool:  # fmt: skip
        learn(Progress(CAMPAIGN, store), store, pool, made.append)
    assert len(made) == 3
    assert facts(store) == without_time(alone)


def test_states_and_places_of_a_trial_agree(alone: dict[str, Trial]) -> None:
    regions = WORLD.regions
    for trial in alone.values():
        x_i = trial.key.pair.x_i
        if trial.before is not None and x_i.name != 'OFFTABLE':
            assert int(regions.state_of(trial.before.x, trial.before.y)) == x_i
        if trial.after is not None and trial.x_f.name != 'OFFTABLE':
            assert int(regions.state_of(trial.after.x, trial.after.y)) == trial.x_f
        assert trial.motion.name == 'OBJECT_OFFTABLE' or trial.after is not None or trial.x_f == 2


def test_a_trial_of_another_robot_is_refused() -> None:
    key = replace(next(CAMPAIGN.plan()), robot='sim-other')
    with pytest.raises(TrialFailedError, match='Expected the software of the robot sim-other'):
        make_trial(key, 5, WORLD.source)


def test_a_missing_dask_scheduler_is_reported() -> None:
    pytest.importorskip('distributed')
    with (
        pytest.raises(NoClusterError, match='Expected a Dask scheduler at tcp://127'),
        dask_pool('tcp://127.0.0.1:9', timeout=1.0),
    ):
        pass


def test_a_cluster_without_dask_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(NoClusterError, match='package distributed'), dask_pool('tcp://no:1'):
        pass


@pytest.mark.parametrize(
    ('place', 'state', 'distance'),
    [
        ((0.44, 0.2), None, 0.13),
        ((0.44, 0.05), None, 0.05),
        ((0.60, 0.2), None, 0.01),
        ((0.44, -0.5), None, 0.17),
        ((0.60, 0.2), RIGHT, 0.2),
        ((0.44, 0.01), OFFTABLE, 0.17),
        ((0.44, -0.35), LEFT, 0.02),
    ],
)
def test_distance_to_a_state(
    place: tuple[float, float], state: State | None, distance: float
) -> None:
    regions = WORLD.regions
    assert distance_to_state(regions, *place, state) == pytest.approx(distance)


def learner(*words: str) -> Result:
    return CliRunner().invoke(app, words)


def test_export_import_and_summary(tmp_path: Path, alone: dict[str, Trial]) -> None:
    one, other = str(tmp_path / 'one.sqlite'), str(tmp_path / 'other.sqlite')
    with closing(ExperienceStore(one, WORLD)) as store:
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
        (('summary', '--store', 'absent.sqlite'), 1, 'nothing is recorded there yet'),
        (('import', '/no/such/file', '--store', 'sqlite://'), 1, 'No such file'),
        (
            ('export', '/no/such/folder/t.csv', '--store', 'absent.sqlite'),
            1,
            'nothing is recorded',
        ),
        (
            ('--offline', '--object', 'turnip'),
            2,
            "expected one of pear, lemon, chicken, got 'turnip'",
        ),
        (('--workers', '2'), 2, '--workers and --scheduler are for --offline'),
        (('--offline', '--trials', '3'), 2, 'systematic: --repetitions'),
        (('--policy', 'random', '--repetitions', '3'), 2, 'random: --trials'),
        (('--seed', str(2**63)), 2, "Invalid value for '--seed'"),
        (('--offline', '--workers', '0'), 2, "Invalid value for '--workers'"),
        (('--policy', 'unknown'), 2, "'unknown' is not one of"),
        (('--offline', '--store', 'nosuchdb://x'), 1, 'no driver'),
    ],
)
def test_invalid_options_end_with_one_sentence(
    words: tuple[str, ...], code: int, why: str
) -> None:
    said = learner(*words)
    assert said.exit_code == code
    assert why in ' '.join(said.stderr.replace('│', ' ').split())
    assert isinstance(said.exception, SystemExit)
