"""A human hand and forearm as convex segments, in the two postures of a demonstration.

The hand's frame is parallel to base_link, so its pose is a translation. The forearm points towards
the person (+x) and upwards at any yaw of the hand (`yaw` of `hand_parts`).

- GRASP: the origin is the point between thumb tip and fingertips, which goes to the toy's centre.
  Approach along -z; at yaw 0 the fingers close along y, a left hand's thumb on the +y side.
- PUSH: the origin is the middle of the palm face, `PALM_HEIGHT` above the hand's lower edge. At
  yaw 0 the fingers point to -x, and a left hand's palm faces +y, its direction of push.

A right hand is the mirror image in y: its thumb is at -y, and it pushes towards -y.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum, StrEnum
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from likeme_arm_sim.meshes import Colour, ConvexMesh, Floats, capsule, convex_hull, ellipsoid

SKIN: Colour = (222, 170, 140)
SLEEVE: Colour = (78, 92, 122)
# Height of the PUSH origin above the lower edge of the hand, m.
PALM_HEIGHT = 0.024
FOREARM_ELEVATION = np.radians(36.0)
FOREARM_LENGTH = 0.46
# Length of bare forearm from the wrist, m.
CUFF = 0.09
FINGERS = ('index', 'middle', 'ring', 'little')


class Posture(StrEnum):
    """Posture of the hand."""

    GRASP = 'grasp'
    PUSH = 'push'


class Side(Enum):
    """Which hand; a right hand is a left hand mirrored in y."""

    LEFT_HAND = 1.0
    RIGHT_HAND = -1.0


@lru_cache(maxsize=256)
def hand_parts(
    posture: Posture, yaw: float = 0.0, opening: float = 0.056, side: Side = Side.LEFT_HAND
) -> Mapping[str, ConvexMesh]:
    """Named segments of the hand in the hand frame.

    Args:
        posture: GRASP or PUSH.
        yaw: rotation of palm and fingers about z, rad; the forearm does not rotate.
        opening: free distance between thumb and fingers in GRASP, m.
        side: left or right hand.
    """
    if posture is Posture.GRASP:
        parts, wrist = _grasping(opening)
    else:
        parts, wrist = _pushing()
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    if side is Side.RIGHT_HAND:
        parts = {name: _mirrored(part) for name, part in parts.items()}
        wrist = wrist * [1.0, -1.0, 1.0]
    turned = {name: part.transformed(turn) for name, part in parts.items()}
    return MappingProxyType(turned | _forearm(turn[:3, :3] @ wrist))


def _mirrored(mesh: ConvexMesh) -> ConvexMesh:
    """The mirror image in y, with its triangles still facing outwards."""
    flipped = mesh.vertices * [1.0, -1.0, 1.0]
    return replace(mesh, vertices=flipped, triangles=mesh.triangles[:, ::-1])


def _skin(shift: int) -> Colour:
    """The skin colour, shifted towards red (positive) or paler."""
    return SKIN[0] + shift // 2, SKIN[1] - shift, SKIN[2] - shift


def _digit(name: str, joints: list[Floats], radius: float) -> dict[str, ConvexMesh]:
    """Two tapering phalanges through three joints (knuckle, bend, tip)."""
    knuckle, bend, tip = joints
    slim = radius * 0.86
    return {
        f'{name}_proximal': capsule(knuckle, bend, radius, _skin(2), slim, sides=10),
        f'{name}_distal': capsule(bend, tip, slim, _skin(9), slim * 0.86, sides=10),
    }


def _palm(knuckles: Floats, heel: Floats, radius: float) -> ConvexMesh:
    """The hull of balls about the knuckles (4, 3) and points of the heel of the hand (N, 3)."""
    ball = ellipsoid((radius, radius, radius), SKIN, sides=12, rings=6).vertices
    return convex_hull((np.concatenate([knuckles, heel])[:, None] + ball).reshape(-1, 3), SKIN)


def _grasping(opening: float) -> tuple[dict[str, ConvexMesh], Floats]:
    """A left hand's fingers around the origin, palm behind and above; and its wrist (3,)."""
    reach = -(opening / 2 + 0.007)
    wrist = np.array([0.112, -0.012, 0.080])
    knuckles = np.array(
        [
            [0.030, -0.006, 0.078],
            [0.034, -0.026, 0.076],
            [0.043, -0.043, 0.070],
            [0.055, -0.056, 0.062],
        ]
    )
    bends = np.array(
        [
            [-0.006, reach - 0.010, 0.062],
            [0.006, reach - 0.017, 0.056],
            [0.022, reach - 0.023, 0.046],
            [0.040, reach - 0.026, 0.036],
        ]
    )
    tips = np.array(
        [
            [-0.012, reach, 0.004],
            [0.006, reach, -0.002],
            [0.024, reach - 0.002, -0.002],
            [0.040, reach - 0.004, 0.004],
        ]
    )
    parts = {
        'palm': _palm(
            knuckles,
            wrist + np.array([[0, 0, 0], [-0.010, 0.020, -0.008], [-0.036, 0.021, -0.008]]),
            0.0125,
        )
    }
    for k, name in enumerate(FINGERS):
        parts |= _digit(name, [knuckles[k], bends[k], tips[k]], 0.0100 - 0.0006 * k)
    thumb = [
        np.array([0.078, 0.011, 0.067]),
        np.array([0.040, 0.036 + opening / 6, 0.038]),
        np.array([0.002, -reach + 0.001, 0.002]),
    ]
    return parts | _digit('thumb', thumb, 0.0118), wrist


def _pushing() -> tuple[dict[str, ConvexMesh], Floats]:
    """A flat left hand on its edge, palm to +y, slightly cupped; and its wrist (3,)."""
    back = -0.011
    heights = np.array([0.052, 0.032, 0.012, -0.007]) - 0.006
    wrist = np.array([0.083, back - 0.004, 0.024])
    knuckles = np.stack(
        [np.array([-0.012, -0.014, -0.011, -0.005]), np.full(4, back), heights], axis=1
    )
    bends = knuckles + np.array([-0.040, 0.005, 0.0])
    reach = np.array([0.036, 0.040, 0.037, 0.027])
    tips = bends + np.stack([-reach, np.full(4, 0.016), -0.03 * reach], axis=1)
    heel = np.array([[0.070, back, -0.010], [0.074, back, 0.040]])
    parts = {'palm': _palm(knuckles + np.array([0.006, 0.0, 0.0]), heel, 0.0110)}
    for k, name in enumerate(FINGERS):
        parts |= _digit(name, [knuckles[k], bends[k], tips[k]], 0.0100 - 0.0006 * k)
    thumb = [
        np.array([0.050, back + 0.004, 0.052]),
        np.array([0.018, back + 0.004, 0.066]),
        np.array([-0.008, back + 0.010, 0.068]),
    ]
    return parts | _digit('thumb', thumb, 0.0105), wrist


def _forearm(wrist: Floats) -> dict[str, ConvexMesh]:
    """From the wrist towards the person and upwards: bare first, then in a sleeve."""
    along = np.array([np.cos(FOREARM_ELEVATION), 0.0, np.sin(FOREARM_ELEVATION)])
    cuff, elbow = wrist + CUFF * along, wrist + FOREARM_LENGTH * along
    return {
        'wrist': capsule(wrist, cuff, 0.0225, _skin(-3), 0.0270, sides=14),
        'sleeve': capsule(cuff + 0.014 * along, elbow, 0.0345, SLEEVE, 0.0460, sides=16),
    }
