"""Members of enums by their names on the command line."""

from __future__ import annotations

import pytest
import typer

from likeme_bringup.enum_choice import choices, member
from likeme_core.tabletop import Manner, Mode


@pytest.mark.parametrize('enum', [Manner, Mode])
def test_every_member_is_known_by_its_name_in_lower_case(enum: type) -> None:
    for each in enum:
        assert member(enum, each.name.lower()) is each


@pytest.mark.parametrize('name', ['up', 'PLACE', '0', ''])
def test_an_unknown_name_is_refused(name: str) -> None:
    with pytest.raises(typer.BadParameter, match='expected place, push or drop, got '):
        member(Manner, name)


def test_choices_are_listed_for_help() -> None:
    assert choices(Manner) == 'place, push or drop'
