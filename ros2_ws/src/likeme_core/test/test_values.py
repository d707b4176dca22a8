"""States, actions, outcomes, demonstrations and stamps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from likeme_core import stamps
from likeme_core.observations import Demonstration
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import LEFT, OFFTABLE, RIGHT, WORLD
from likeme_core.tabletop import Action, Manner
from likeme_core.yaml_files import read_yaml

ACT = Demonstration(9, 'camera', 'pear', RIGHT, LEFT, Manner.PUSH, 1, 8)


@pytest.mark.parametrize('action', WORLD.actions, ids=str)
def test_an_action_is_its_manner_and_target(action: Action) -> None:
    assert WORLD.action_of(action.manner, action.target) is action
    assert action.name == f'{action.manner.name}_{action.target.name}'


def test_only_the_same_object_moved_back_undoes_an_act() -> None:
    back = replace(ACT, x_i=LEFT, x_f=RIGHT, manner=Manner.PLACE)
    assert back.undoes(ACT)
    assert not ACT.undoes(ACT)
    assert not replace(back, object='lemon').undoes(ACT)
    assert not replace(back, x_f=OFFTABLE).undoes(ACT)


def test_the_arm_may_have_moved_unless_the_request_was_refused() -> None:
    moved = {outcome for outcome in MotionOutcome if outcome.moved}
    assert moved == {
        MotionOutcome.COMPLETED,
        MotionOutcome.NOT_GRASPED,
        MotionOutcome.NO_IK_SOLUTION,
        MotionOutcome.HELD,
        MotionOutcome.FAILED,
        MotionOutcome.LOST,
    }


def test_seconds_and_nanoseconds_are_inverse() -> None:
    assert stamps.nanoseconds(0.3) == 300_000_000
    assert stamps.seconds(stamps.nanoseconds(12.345)) == 12.345


def test_a_yaml_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / 'a.yaml'
    path.write_text('a: [1, 2]')
    assert read_yaml(path) == {'a': [1, 2]}


@pytest.mark.parametrize('content', [b'a: [1', b'\xff\xfe\x00', None])
def test_a_yaml_file_that_cannot_be_read_is_one_sentence(
    content: bytes | None, tmp_path: Path
) -> None:
    path = tmp_path / 'a.yaml'
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ValueError, match=r'a\.yaml cannot be read: ') as caught:
        read_yaml(path)
    assert '\n' not in str(caught.value)
