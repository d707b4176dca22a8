"""Parameters of the perception node."""

from __future__ import annotations

from dataclasses import fields

import pytest

from likeme_core.paper_world import WORLD
from likeme_core.settings import defaults
from likeme_perception.catalogue import world_catalogue
from likeme_perception.config import PerceptionConfig, world_config
from likeme_perception.node_settings import read_settings, settings_of

SETTINGS = settings_of(WORLD)
DEFAULTS = defaults(SETTINGS)


def test_every_field_of_the_configuration_is_a_parameter() -> None:
    names = {field.name for field in fields(PerceptionConfig)} - {'world'}
    assert names == set(SETTINGS) - {'pairing_tolerance'}


def test_the_defaults_are_those_of_the_configuration() -> None:
    settings = read_settings(DEFAULTS, WORLD)
    assert settings.config == world_config(WORLD)
    assert settings.catalogue == world_catalogue(WORLD)
    assert settings.pairing_tolerance == 0.016


def test_an_empty_list_stands_for_none() -> None:
    empty = {'camera_position': [], 'table': [], 'robot_sides': []}
    config = read_settings(DEFAULTS | empty, WORLD).config
    assert (config.camera_position, config.table) == (None, None)
    assert config.robot_sides == ()


@pytest.mark.parametrize('name', SETTINGS)
def test_a_default_lies_within_its_limits(name: str) -> None:
    limits = SETTINGS[name].limits
    if limits is not None:
        assert limits[0] <= SETTINGS[name].default <= limits[1]
