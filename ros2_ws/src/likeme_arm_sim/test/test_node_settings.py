"""The arm driver's parameters as values."""

from __future__ import annotations

import pytest

from likeme_arm_sim.cell import CellSettings
from likeme_arm_sim.node_settings import SETTINGS, cell_settings, driver_settings, initial_states
from likeme_arm_sim.simulation_driver import SimulationSettings
from likeme_core.tabletop import State


def test_initial_states_are_read() -> None:
    assert initial_states(['pear:LEFT']) == {'pear': State.LEFT}
    with pytest.raises(ValueError, match="got 'pear=LEFT'"):
        initial_states(['pear=LEFT'])


def test_the_defaults_are_the_cores_own() -> None:
    values = {name: setting.default for name, setting in SETTINGS.items()}
    assert cell_settings(values) == CellSettings()
    assert driver_settings(values) == SimulationSettings()
