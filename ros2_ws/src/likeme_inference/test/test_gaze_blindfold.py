"""Who follows a blindfolded gaze: the pattern of Fig 6, and the infants the paper tells of."""

from __future__ import annotations

import numpy as np
import pytest

from likeme_inference.experiments.blindfold_groups import (
    GROUPS,
    differs_from_zero,
    follows_more,
    group_score,
    group_turns,
)
from likeme_inference.gaze.blindfold import FIGURE_GROUPS, Blindfold, Group, infant, scores
from likeme_inference.gaze.simulation import DEGREE


@pytest.mark.parametrize('group', GROUPS, ids=lambda group: group.name)
def test_follows_or_does_not_as_infants_do(group: Group) -> None:
    score = group_score(group_turns(7, group, 12))
    if group.follows:
        assert score.mean > 3
    else:
        assert abs(score.mean) < 0.5


def test_sixty_agents_show_the_pattern() -> None:
    baseline, windowed, opaque = (group_turns(8, group, 20) for group in FIGURE_GROUPS)
    assert follows_more(np.concatenate([baseline, windowed]), opaque) < 1e-6
    assert differs_from_zero(opaque) > 0.05


def test_scores() -> None:
    turned = DEGREE * np.array([[31.0, 44.0, -33.0, 10.0], [-45.0, -45.0, -45.0, 0.0]])
    assert scores(turned, 30 * DEGREE) == pytest.approx([1, -3])
    assert scores(turned, 35 * DEGREE) == pytest.approx([1, -3])
    assert scores(turned, 44.5 * DEGREE) == pytest.approx([0, -3])


def test_an_agent_is_the_same_whichever_others_there_are() -> None:
    together = group_turns(9, FIGURE_GROUPS[2], 3)
    alone = group_turns(9, FIGURE_GROUPS[2], 1, first=2)
    assert (together[2] == alone[0]).all()


def test_only_those_who_wore_it_know_the_blindfold() -> None:
    knows = {
        kind: infant(np.random.default_rng(1), kind).blindfold is not None for kind in Blindfold
    }
    assert knows == {
        Blindfold.UNKNOWN: False,
        Blindfold.WINDOWED: False,
        Blindfold.OPAQUE: True,
        Blindfold.SEE_THROUGH: True,
    }
