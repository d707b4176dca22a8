"""The arm driver's parameters: names, defaults, ranges, and the values they stand for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from likeme_arm_sim.board_in_cell import board_on_table
from likeme_arm_sim.cell import CellSettings
from likeme_arm_sim.renderer import PaintedPlane
from likeme_arm_sim.simulated_parts import ALL_PARTS, SimulatedPart, simulated_parts
from likeme_arm_sim.simulation_driver import SimulationSettings
from likeme_core.calibration_board import BOARD
from likeme_core.heartbeats import HOLD_TIMEOUT
from likeme_core.settings import Setting
from likeme_core.tabletop import State
from likeme_core.world import World

SETTINGS: dict[str, Setting] = {
    'simulate': Setting(
        [part.value for part in SimulatedPart],
        'Parts to simulate: arm, person, camera; those left out are real.',
        read_only=True,
    ),
    'seed': Setting(
        1, 'Of first places, camera noise, arm and person.', (0, 2**31), read_only=True
    ),
    'initial_states': Setting(
        [''],
        'First states, as OBJECT:REGION; empty: those of the world file.',
        read_only=True,
    ),
    'arm_speed': Setting(1.0, "Factor on the arm's speeds.", (0.2, 1.5), read_only=True),
    'human_speed': Setting(1.0, "Factor on the person's speeds.", (0.3, 2.0), read_only=True),
    'camera_rate': Setting(30.0, 'Frames per simulated second.', (1.0, 60.0), read_only=True),
    'calibration_board': Setting(
        '',
        "Calibration board on the table: 'X Y ANGLE' of its middle, m and rad; empty: none.",
        read_only=True,
    ),
    'publish_clock': Setting(
        True, 'Publish simulated time on /clock, if every part is simulated.', read_only=True
    ),
    'motion_budget': Setting(
        60.0, 'Greatest duration of a motion, simulated s.', (5.0, 600.0), read_only=True
    ),
    'table_state_timeout': Setting(
        2.0,
        'Greatest age of a table_state that is acted on, simulated s.',
        (0.1, 60.0),
        read_only=True,
    ),
    'hold_timeout': Setting(
        HOLD_TIMEOUT,
        's without a message of the hold keeper after which nothing moves.',
        (0.1, 5.0),
        read_only=True,
    ),
    'real_time_factor': Setting(
        1.0,
        'Simulated s per s; 0: as fast as possible; 1 if a part is real.',
        (0.0, 100.0),
    ),
}


def cell_settings(values: Mapping[str, Any], world: World) -> CellSettings:
    """Settings of the simulated cell of a world."""
    return CellSettings(
        arm_speed=values['arm_speed'],
        human_speed=values['human_speed'],
        initial_states=initial_states(values['initial_states'], world),
    )


def sheets_on_table(board: str) -> tuple[PaintedPlane, ...]:
    """The calibration board at 'X Y ANGLE', m and rad; empty: nothing.

    Raises:
        ValueError: the text is neither three finite numbers nor empty.
    """
    try:
        numbers = [float(word) for word in board.split()]
    except ValueError:
        numbers = []
    if board and (len(numbers) != 3 or not np.isfinite(numbers).all()):
        raise ValueError(f"Expected calibration_board like '0.44 0.0 0.0', got {board!r}.")
    return (board_on_table(BOARD, *numbers),) if numbers else ()


def simulation_settings(values: Mapping[str, Any]) -> SimulationSettings:
    """Settings of the simulation driver.

    Raises:
        ValueError: unknown parts, or a real_time_factor that does not suit a real part.
    """
    wall_time = simulated_parts(values['simulate']) != ALL_PARTS
    check_real_time_factor(values['real_time_factor'], wall_time)
    return SimulationSettings(
        values['camera_rate'], values['motion_budget'], values['table_state_timeout'], wall_time
    )


def check_real_time_factor(factor: float, wall_time: bool) -> None:
    """Refuse any other rate than that of the real parts.

    Raises:
        ValueError: it is not 1 although a part is real.
    """
    if wall_time and factor != 1.0:
        raise ValueError(
            f'Expected real_time_factor 1 while a part of the cell is real, got {factor:g}.'
        )


def initial_states(pairs: Sequence[str], world: World) -> dict[str, State] | None:
    """['OBJECT:REGION', ...] as a mapping; None: those of the world file.

    Raises:
        ValueError: a pair is not of that form, or the world has no such object or state.
    """
    given = [pair for pair in pairs if pair]
    if not given:
        return None
    states = {item.name: item.start for item in world.object_entries if item.start is not None}
    for pair in given:
        name, colon, state = pair.partition(':')
        if not colon:
            raise ValueError(f"Expected initial_states like OBJECT:REGION, got '{pair}'.")
        states[world.object(name).name] = world.state(state)
    return states
