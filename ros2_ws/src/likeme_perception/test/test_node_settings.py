"""The perception node's parameters as values."""

from __future__ import annotations

from dataclasses import fields

import pytest

from likeme_core.settings import defaults
from likeme_perception.config import PerceptionConfig
from likeme_perception.identification import load_catalogue
from likeme_perception.node_settings import SETTINGS, read_settings

DEFAULTS = defaults(SETTINGS)


def test_every_number_of_the_configuration_is_a_parameter() -> None:
    assert {field.name for field in fields(PerceptionConfig)} == (
        set(SETTINGS) - {'catalogue_file', 'pairing_tolerance'}
    )


def test_the_defaults_are_the_configurations_own() -> None:
    settings = read_settings(DEFAULTS)
    assert settings.config == PerceptionConfig()
    assert settings.catalogue == load_catalogue()
    assert settings.pairing_tolerance == 0.016


def test_empty_lists_mean_that_it_is_estimated() -> None:
    empty = {'camera_position': [], 'table': [], 'work_area': [], 'robot_sides': []}
    config = read_settings(DEFAULTS | empty).config
    assert (config.camera_position, config.table, config.work_area) == (None, None, None)
    assert config.robot_sides == ()


@pytest.mark.parametrize('name', SETTINGS)
def test_a_default_lies_within_its_limits(name: str) -> None:
    limits = SETTINGS[name].limits
    if limits is not None:
        assert limits[0] <= SETTINGS[name].default <= limits[1]
