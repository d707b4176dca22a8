"""Pear, lemon and roast chicken of Fig 2b as convex parts: long axis x, z up, metres."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from likeme_arm_sim.meshes import (
    Colour,
    ConvexMesh,
    Floats,
    capsule,
    convex_hull,
    ellipsoid,
    lathe,
)

# For parts that are painted afterwards.
BARE: Colour = (0, 0, 0)
Paint = Callable[[Floats], NDArray[np.uint8]]


def _speckled(base: Colour, tint: Callable[[Floats], Floats]) -> Paint:
    """A paint that adds `tint(centres (T, 3)) -> (T, 3)` to a base colour."""

    def paint(centres: Floats) -> NDArray[np.uint8]:
        return np.clip(np.asarray(base) + tint(centres), 0, 255).astype(np.uint8)

    return paint


def pear_parts() -> tuple[ConvexMesh, ...]:
    """Belly and neck, 85 x 58 mm with the stem: on its side it rolls in a circle."""
    angle = np.linspace(0.0, np.pi, 13)
    belly = lathe(zip(-0.013 - 0.028 * np.cos(angle), 0.029 * np.sin(angle), strict=True), BARE)
    # The neck leaves the belly along its tangent, so that there is no crease between the parts.
    slope = [(-0.004, 0.0274), (0.008, 0.0231), (0.018, 0.0190), (0.026, 0.0155)]
    crown = [(0.0310, 0.0122), (0.0345, 0.0076), (0.0358, 0.0)]
    neck = lathe([*slope, *crown], BARE)
    stem = capsule((0.034, 0.0, 0.0), (0.0425, 0.0, 0.003), 0.0022, (92, 64, 38), 0.0017, sides=8)

    def blush(centres: Floats) -> Floats:
        warm = np.clip((centres[:, 0] + 0.045) / 0.08, 0, 1)[:, None]
        ripe = np.clip(-centres[:, 1:2] / 0.03, 0, 1)
        return np.asarray((1 - warm) * np.array([14, 4, 0]) + ripe * np.array([26, -8, -10]))

    paint = _speckled((154, 186, 52), blush)
    return belly.painted(paint), neck.painted(paint), stem


def lemon_parts() -> tuple[ConvexMesh, ...]:
    """An ellipsoid with two nubs, 70 x 50 mm: it rolls straight."""
    body = ellipsoid((0.0310, 0.0250, 0.0250), BARE, sides=28, rings=12)
    tip = lathe([(0.024, 0.0145), (0.0315, 0.0078), (0.0340, 0.0050), (0.0352, 0.0)], BARE, 16)
    stalk = lathe(
        [(-0.024, 0.0145), (-0.031, 0.0090), (-0.0335, 0.0066), (-0.0348, 0.0)], BARE, 16
    )

    def ends(centres: Floats) -> Floats:
        far = np.clip((np.abs(centres[:, :1]) - 0.024) / 0.010, 0, 1)
        return np.asarray(far * np.array([-22, -6, 6]))

    paint = _speckled((245, 212, 40), ends)
    return body.painted(paint), tip.painted(paint), stalk.painted(paint)


def chicken_parts() -> tuple[ConvexMesh, ...]:
    """A roast chicken on its back, 90 x 65 x 48 mm, flat below: it slides and does not roll."""
    whole = ellipsoid((0.039, 0.0285, 0.030), BARE, sides=24, rings=12).vertices
    low = whole.copy()
    low[:, 2] = np.maximum(low[:, 2], -0.018)
    body = convex_hull(low - np.array([0.005, 0.0, 0.0]), BARE)
    legs, bones, wings = [], [], []
    for side in (1.0, -1.0):
        hip, knee = np.array([0.006, side * 0.022, 0.0]), np.array([0.030, side * 0.0135, 0.011])
        legs.append(capsule(hip, knee, 0.0105, BARE, 0.0062, sides=14))
        foot = knee + np.array([0.0105, -side * 0.002, 0.003])
        bones.append(capsule(knee, foot, 0.0036, (240, 226, 196), 0.0046, sides=10))
        wings.append(
            ellipsoid((0.015, 0.0062, 0.0092), BARE, sides=12, rings=8).moved(
                [-0.020, side * 0.0262, -0.0015]
            )
        )

    def crust(centres: Floats) -> Floats:
        # A darker roast on top and a fine mottling that a camera can hold on to.
        height = np.clip((centres[:, 2:3] + 0.018) / 0.048, 0, 1)
        mottle = np.sin(centres @ [900.0, 300.0, 0.0]) * np.sin(centres @ [-200.0, 800.0, 500.0])
        return np.asarray(
            height * np.array([-16, -18, -12]) + mottle[:, None] * np.array([9, 7, 4])
        )

    paint = _speckled((196, 124, 58), crust)
    limbs = tuple(part.painted(_speckled((180, 104, 44), crust)) for part in (*legs, *wings))
    return (body.painted(paint), *limbs, *bones)
