"""Trial identities, trial files, policies, campaigns, and executed imitations as experience."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from example_trials import PEAR, trial

from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.paper_world import LEFT, PUSH_LEFT, PUSH_RIGHT, RIGHT, WORLD
from likeme_core.tabletop import Mode, State
from likeme_core.world import World
from likeme_inference.experience.campaign import Campaign, Progress
from likeme_inference.experience.exploration_policy import Random, Systematic
from likeme_inference.experience.imitation_experience import ImitationExperience
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.trial import Counts, Pair, TrialKey, no_counts
from likeme_inference.experience.trial_file import TrialFileError, load, parse, save, write
from likeme_inference.tabletop.action_selection import Kind
from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.model_file import shipped
from likeme_inference.tabletop.robot_model import RobotModel, TrialCounts
from likeme_inference.tabletop.values import Decision, Outcome, Result


@pytest.fixture
def store() -> Iterator[ExperienceStore]:
    with closing(ExperienceStore('sqlite://', WORLD)) as opened:
        yield opened


def campaign(policy: Systematic | Random | None = None, seed: int = 1) -> Campaign:
    return Campaign(WORLD, 'robot', 'test-1', seed, WORLD.objects, policy or Systematic(2))


def test_trial_identity_and_seed_are_stable() -> None:
    key = trial().key
    # Written down here: a change would count every recorded trial twice.
    assert key.identity == 'e9f9fb95-f473-5e60-9381-a978d792ff46'
    assert key.seed(1) == 8097126674643826257
    others = [
        replace(key, robot='r'), replace(key, campaign='c'), replace(key, repetition=1),
        replace(key, pair=PEAR._replace(action=PUSH_LEFT)),
    ]  # fmt: skip
    assert len({k.identity for k in (key, *others)}) == 5
    assert len({key.seed(1), key.seed(2), key.seed(1, attempt=1), others[2].seed(1)}) == 4


@pytest.mark.parametrize('name', ['', 'two\nlines', 'x' * 101, ' pear', '#1', 'end'])
def test_invalid_names_are_rejected(name: str) -> None:
    with pytest.raises(ValueError, match='Expected a name'):
        TrialKey(name, 'campaign', PEAR, 0)


@pytest.mark.parametrize('motion', [MotionOutcome.HELD, MotionOutcome.NOT_FREE])
def test_a_motion_that_was_held_or_not_begun_is_no_trial(motion: MotionOutcome) -> None:
    with pytest.raises(ValueError, match=f'got {motion.name}'):
        replace(trial(), motion=motion)


def test_trial_file_round_trip(tmp_path: Path) -> None:
    trials = (trial(0), trial(1, robot='a, "strange" one'), replace(trial(2), before=None))
    assert save(trials, tmp_path / 'trials.csv') == 3
    assert load(tmp_path / 'trials.csv', WORLD) == trials


@pytest.mark.parametrize(
    ('line', 'becomes', 'why'),
    [
        (0, 'likeme_experience,2', "line 1: expected 'likeme_experience,1'"),
        (2, None, "line 4: expected 'end,1', got 'end,2'"),
        (4, None, 'line 5: expected a trial or "end", but the file stops here'),
        (2, 'robot,test-1,pear', 'line 3: expected 19 fields'.replace('19', '17')),
        (4, 'end,2\nmore', "line 6: expected '(end of file)'"),
    ],
)
def test_a_broken_trial_file_is_refused_by_line(line: int, becomes: str | None, why: str) -> None:
    text = StringIO()
    write([trial(0), trial(1)], text)
    lines = text.getvalue().splitlines()
    lines[line : line + 1] = [] if becomes is None else becomes.split('\n')
    with pytest.raises(TrialFileError) as refused:
        list(parse(lines, WORLD))
    assert why in str(refused.value)


def test_unknown_names_in_a_trial_file_are_reported() -> None:
    text = StringIO()
    write([trial(0)], text)
    with pytest.raises(
        TrialFileError, match="line 3: expected one of LEFT RIGHT OFFTABLE, got 'UP'"
    ):
        list(parse(text.getvalue().replace('RIGHT,COMPLETED', 'UP,COMPLETED').splitlines(), WORLD))


def test_systematic_tries_every_pair_equally_often_in_rounds() -> None:
    plan = list(campaign(Systematic(10)).plan())
    assert len(plan) == len({key.identity for key in plan}) == 540
    assert set(Counter(key.pair for key in plan).values()) == {10}
    for start in range(0, 540, 54):
        assert len({key.pair for key in plan[start : start + 54]}) == 54
    assert [k.pair for k in plan[:54]] != [k.pair for k in plan[54:108]]


def test_random_policy_makes_the_given_number_of_trials() -> None:
    plan = list(campaign(Random(300)).plan())
    assert len({key.identity for key in plan}) == 300
    assert len({key.pair for key in plan}) == 54
    assert list(campaign(Random(300), seed=2).plan()) != plan


def test_a_restarted_campaign_resumes(store: ExperienceStore) -> None:
    first = list(Progress(campaign(), store).missing())
    store.record(trial(key.repetition, key.pair) for key in first[:40:3])
    after = Progress(campaign(), store)
    assert (after.total, after.done) == (108, 14)
    assert set(after.missing()) == set(first) - set(first[:40:3])
    others = Campaign(WORLD, 'other', 'test-1', 1, WORLD.objects, Systematic(2))
    assert Progress(others, store).done == 0


@dataclass(frozen=True)
class UntilItWorks:
    """An adaptive policy: the same pair until it ended RIGHT."""

    adaptive: bool = True

    def next(self, world: World, counts: Counts, rng: np.random.Generator) -> Pair | None:
        ends = counts['pear'][PEAR.x_i, PEAR.action]
        return None if ends[RIGHT] else PEAR


def test_an_adaptive_policy_sees_how_each_trial_ended(store: ExperienceStore) -> None:
    progress = Progress(
        Campaign(WORLD, 'robot', 'test-1', 1, WORLD.objects, UntilItWorks()), store
    )
    ends, made = iter((LEFT, LEFT, RIGHT)), []
    for key in progress.missing():
        store.record([trial(key.repetition, key.pair, next(ends))])
        progress.recorded(key)
        made.append(key.repetition)
    assert made == [0, 1, 2]
    assert (progress.total, progress.done) == (None, 3)


def test_counts_before_the_first_trial_are_zero() -> None:
    assert {t.sum() for t in no_counts(WORLD, WORLD.objects).values()} == {0}


def decision(number: int = 1) -> Decision:
    return Decision(
        100, 'base_link', number, 1, Mode.GOAL_BASED, 'pear', LEFT, RIGHT,
        (0.1, 0.9, 0.0), Kind.EXECUTE, PUSH_RIGHT, (0,) * 6, (0,) * 6, (0.0, 1.0, 0.0),
        1.0, 1, (0,) * 6, 1.0, 0.5, Policy.DIRECT, 'model', 'I push.',
    )  # fmt: skip


def outcome(number: int = 1, x_f: State | None = RIGHT) -> Outcome:
    return Outcome(
        200, 'base_link', number, 'pear', LEFT, RIGHT, x_f, Result.REACHED,
        Actor.ROBOT, PUSH_RIGHT, 1.0, MotionOutcome.COMPLETED, 'It is there.',
    )  # fmt: skip


def test_executed_imitations_improve_the_model(store: ExperienceStore) -> None:
    before = shipped()
    experience = ImitationExperience(store, 'robot', '0.1.0', before)
    assert experience.model == before
    for _ in range(2):
        # The same outcome again is the same fact.
        model = experience.record_outcome(decision(), outcome())
    assert model is experience.model
    pushed = model.model_of('pear').counts - before.model_of('pear').counts
    assert pushed[LEFT, PUSH_RIGHT].tolist() == [0, 1, 0]
    assert pushed.sum() == 1
    # The learned model may have been exported from this very store: nothing counts twice.
    again = ImitationExperience(store, 'robot', '0.1.0', model)
    assert again.model.rows == model.rows
    experience.record_outcome(decision(2), outcome(2, LEFT))
    assert experience.model.version == '1+2'


@pytest.mark.parametrize(
    'ending',
    [
        replace(outcome(), actor=Actor.HUMAN),
        replace(outcome(), motion=MotionOutcome.HELD),
        replace(outcome(), motion=MotionOutcome.NOT_FREE),
        replace(outcome(), motion=None),
        outcome(x_f=None),
    ],
)
def test_outcomes_that_do_not_count_as_trials(store: ExperienceStore, ending: Outcome) -> None:
    experience = ImitationExperience(store, 'robot', '0.1.0', shipped())
    assert experience.record_outcome(decision(), ending) is None
    assert not list(store.trials())


@pytest.mark.parametrize('name', ['', ' robot', 'end', '#1', 'x' * 101])
def test_names_that_no_trial_can_have_are_rejected_at_the_start(
    store: ExperienceStore, name: str
) -> None:
    rows = (TrialCounts(name or ' ', 0, 0, (1, 0, 0), 'a'),)
    with pytest.raises(ValueError, match='Expected a name of 1 to 100 printable characters'):
        ImitationExperience(store, 'robot', '0.1.0', RobotModel('m', '1', {'a': 'A.'}, rows))
    with pytest.raises(ValueError, match='Expected a name of 1 to 100 printable characters'):
        ImitationExperience(store, name, '0.1.0', shipped())


def test_another_decisions_outcome_is_refused(store: ExperienceStore) -> None:
    with pytest.raises(ValueError, match='Expected the outcome of decision 2, got that of 1'):
        ImitationExperience(store, 'robot', '0.1.0', shipped()).record_outcome(
            decision(2), outcome(1)
        )
