"""The arm driver's parameters as values."""

from __future__ import annotations

import pytest

from likeme_arm_sim.cell import CellSettings
from likeme_arm_sim.node_settings import (
    SETTINGS,
    cell_settings,
    initial_states,
    simulation_settings,
)
from likeme_arm_sim.simulation_driver import SimulationSettings
from likeme_core.paper_world import LEFT, RIGHT, WORLD


def test_initial_states_are_read() -> None:
    assert initial_states([''], WORLD) is None
    given = initial_states(['pear:left'], WORLD)
    assert given == {'pear': LEFT, 'lemon': LEFT, 'chicken': RIGHT}
    for wrong in ('pear=LEFT', 'apple:LEFT', 'pear:UP'):
        with pytest.raises(ValueError, match=r'Expected .*, got '):
            initial_states([wrong], WORLD)


def test_the_defaults_are_the_cores_own() -> None:
    values = {name: setting.default for name, setting in SETTINGS.items()}
    assert cell_settings(values, WORLD) == CellSettings()
    assert simulation_settings(values) == SimulationSettings()


def test_a_real_part_means_system_time() -> None:
    values = {name: setting.default for name, setting in SETTINGS.items()}
    assert simulation_settings(values | {'simulate': ['camera', 'arm']}).wall_time
    assert not simulation_settings(values | {'simulate': ['camera', 'arm', 'person']}).wall_time


@pytest.mark.parametrize(
    ('changed', 'reason'),
    [
        ({'simulate': []}, 'at least one of arm, person, camera, got none'),
        ({'simulate': ['legs']}, "parts of arm, person, camera, got 'legs'"),
        ({'simulate': ['arm'], 'real_time_factor': 4.0}, 'real_time_factor 1 .*, got 4'),
    ],
)
def test_settings_that_do_not_fit_are_refused(changed: dict[str, object], reason: str) -> None:
    values = {name: setting.default for name, setting in SETTINGS.items()} | changed
    with pytest.raises(ValueError, match=reason):
        simulation_settings(values)
