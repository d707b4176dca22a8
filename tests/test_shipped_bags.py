"""The shipped recordings: each replays, offline, to the log that is shipped with it."""

from __future__ import annotations

import multiprocessing
import os
import re
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path

import pytest

from bag_recipes import CHANGES, recipes
from likeme_replay.decision_log import read_log
from likeme_replay.offline_replay import ReplayResult, replay_offline
from make_bags import readme, row

BAGS = Path(__file__).parents[1] / 'bags'
RECIPES = {recipe.name: recipe for recipe in recipes()}
NUMBER = re.compile(r'-?\d+\.\d+(?:e-?\d+)?')
#: What every one of them weighs together at most, bytes.
WEIGHT = 60_000_000


def test_every_object_change_and_manner_is_there() -> None:
    wanted = {
        f'{name}_{x_i.name}_{x_f.name}_{manner}'.lower()
        for name in ('pear', 'lemon', 'chicken')
        for x_i, x_f in CHANGES
        for manner in ('place', 'push')
    }
    assert len(wanted) == 24
    assert wanted <= RECIPES.keys()
    assert {path.parent.name for path in BAGS.glob('*/metadata.yaml')} == RECIPES.keys()


def test_the_folder_is_small() -> None:
    assert sum(p.stat().st_size for p in BAGS.rglob('*') if p.is_file()) < WEIGHT


@pytest.fixture(scope='module')
def replays(request: pytest.FixtureRequest) -> Iterator[dict[str, Future[ReplayResult]]]:
    """The recordings that this session tests, replayed by one process for each core."""
    tests = [item for item in request.session.items if isinstance(item, pytest.Function)]
    names = [item.callspec.params['name'] for item in tests if 'replays' in item.fixturenames]
    workers = len(os.sched_getaffinity(0))
    with ProcessPoolExecutor(workers, multiprocessing.get_context('spawn')) as pool:
        yield {name: pool.submit(replay_offline, BAGS / name) for name in names}
        pool.shutdown(cancel_futures=True)


def same(log: str, shipped: str) -> bool:
    """Whether logs agree: to the byte, or with other versions of NumPy and OpenCV in 6 digits."""
    if os.environ.get('LIKEME_ENV') != 'noble':
        return log == shipped
    ours, theirs = ([float(x) for x in NUMBER.findall(text)] for text in (log, shipped))
    return NUMBER.sub('', log) == NUMBER.sub('', shipped) and ours == pytest.approx(
        theirs, rel=1e-6, abs=1e-6
    )


@pytest.mark.parametrize('name', RECIPES)
def test_a_recording_replays_to_the_log_beside_it(
    name: str, replays: dict[str, Future[ReplayResult]]
) -> None:
    replayed = replays[name].result()
    assert replayed.complete, replayed.warnings
    assert replayed.counts.warnings == []
    shipped = (BAGS / f'{name}.jsonl').read_text(encoding='utf-8')
    # The texts once more, for pytest to show where they differ.
    assert same(replayed.log, shipped) or replayed.log == shipped


@pytest.mark.parametrize('name', [n for n in RECIPES if re.match('pear_|lemon_|chicken_', n)])
def test_what_is_shown_is_what_is_seen_and_wanted(name: str) -> None:
    """The words of the name against the numbers of the log, which came from the camera alone."""
    thing, x_i, x_f, manner = name.split('_')
    states, manners = ['left', 'right', 'offtable'], ['place', 'push']
    events = list(read_log((BAGS / f'{name}.jsonl').read_text(encoding='utf-8')))
    assert [e['event'] for e in events] == ['demonstration', 'belief', 'decision', 'decision']
    act, belief, at_goal, decision = events
    assert act['object'] == thing
    assert (states[act['x_i']], states[act['x_f']], manners[act['manner']]) == (x_i, x_f, manner)
    # The paper's Fig 8a: the goal is the state that was reached.
    assert states[belief['goal']] == x_f
    assert at_goal['kind'] == 2
    # Fig 8c: only the pear from RIGHT to LEFT is too uncertain to do alone.
    assert (decision['kind'] == 1) == name.startswith('pear_right_left')
    assert states[decision['action'] % 3] == x_f


def test_the_table_says_what_the_logs_say() -> None:
    text = (BAGS / 'README.md').read_text(encoding='utf-8')
    assert text == readme(BAGS)
    for recipe in RECIPES.values():
        log = (BAGS / f'{recipe.name}.jsonl').read_text(encoding='utf-8')
        assert f'\n{row(recipe, log)}\n' in text
