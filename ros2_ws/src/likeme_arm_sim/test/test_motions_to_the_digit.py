"""Motions of the paper's world to the digit: they show changed draws, places and orders."""

from __future__ import annotations

import pytest

from likeme_arm_sim.cell import Cell
from likeme_core.outcomes import Actor
from likeme_core.paper_world import LEFT, PLACE_RIGHT, PUSH_LEFT, RIGHT, WORLD

# (x, y, yaw) of pear, lemon and chicken, m and rad, by physics alone: the person needs no inverse
# kinematics, whose last bit depends on the processor (OpenBLAS chooses its kernels by it).
AT_START = [
    (0.4520354394861677, -0.20735172767125548, -3.1030851996447506),
    (0.48422050983193415, 0.1982559152006097, -0.79088258833017311),
    (0.34812386968407516, -0.092723859328193589, -3.0261981476385658),
]
PLACED = [
    (0.45206712690334783, -0.20723737896218467, -3.1068051273848099),
    (0.48409434970624626, 0.19832098484812358, -0.79087458060402083),
    (0.37230942880188439, -0.11100547107137528, -3.026942452572412),
]
PUSHED = [
    (0.44230444393508639, 0.11003907493754708, -2.7205422003867503),
    (0.48393433022039267, 0.1984672553229711, -0.790872240112241),
    (0.37095793040343789, -0.10861982652790307, -2.9619840810880311),
]


def poses(cell: Cell) -> list[tuple[float, float, float]]:
    return [(view.x, view.y, view.yaw) for view in cell.true_states().values()]


def test_acts_of_the_person_end_where_they_did() -> None:
    cell = Cell(WORLD, 0)
    found = [poses(cell)]
    for name, action in (('chicken', PLACE_RIGHT), ('pear', PUSH_LEFT)):
        cell.run_action(Actor.HUMAN, name, action, cell.true_states().get)
        cell.step(1.0)
        found.append(poses(cell))
    for one, expected in zip(found, (AT_START, PLACED, PUSHED), strict=True):
        for pose, known in zip(one, expected, strict=True):
            assert pose == pytest.approx(known, abs=1e-9, rel=0)


def test_what_the_robot_aims_at_is_as_fitted_to_the_last_bit() -> None:
    # Not approximately: contacts turn the last bit into millimetres.
    assert WORLD.region(LEFT).push.aim == (0.44, 0.45 * 0.33)
    assert WORLD.region(RIGHT).push.aim == (0.44, -0.45 * 0.33)
    assert WORLD.region(LEFT).place == (0.44, 0.85 * 0.33)
    assert WORLD.region(RIGHT).place == (0.44, -0.85 * 0.33)
