from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from likeme_arm_sim.hand_shapes import Posture, Side, hand_parts
from likeme_arm_sim.meshes import ConvexMesh, box, capsule, ellipsoid, hull_from_obj, lathe
from likeme_arm_sim.toys import toys_of
from likeme_core.paper_world import WORLD

TOYS = toys_of(WORLD)


RED = (200, 30, 30)
SOLIDS = {
    'box': box((0.1, 0.2, 0.3), RED, (1.0, 2.0, 3.0)),
    'ellipsoid': ellipsoid((0.03, 0.02, 0.01), RED),
    'capsule': capsule((0.0, 0.0, 0.0), (0.1, 0.05, -0.2), 0.02, RED, 0.01),
    'lathe': lathe([(-0.1, 0.02), (0.0, 0.05), (0.1, 0.0)], RED),
    'turned': hand_parts(Posture.PUSH, 0.7, side=Side.RIGHT_HAND)['palm'],
    **{f'{name}_{k}': part for name, toy in TOYS.items() for k, part in enumerate(toy.parts)},
}


def volume(mesh: ConvexMesh) -> float:
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    return float(np.einsum('ti,ti->', a, np.cross(b, c)) / 6)


@pytest.mark.parametrize('mesh', SOLIDS.values(), ids=SOLIDS.keys())
def test_triangles_close_the_surface_and_face_outwards(mesh: ConvexMesh) -> None:
    edges = mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forward, backward = {tuple(e) for e in edges}, {tuple(e[::-1]) for e in edges}
    assert forward == backward
    assert len(forward) == len(edges)
    assert volume(mesh) > 0
    assert mesh.contains(mesh.vertices).all()
    assert mesh.colours.shape == mesh.triangles.shape
    assert mesh.colours.dtype == np.uint8


def test_volumes_are_those_of_the_solids() -> None:
    assert volume(SOLIDS['box']) == pytest.approx(0.1 * 0.2 * 0.3)
    fine = ellipsoid((0.03, 0.02, 0.01), RED, sides=60, rings=40)
    assert volume(fine) == pytest.approx(4 / 3 * np.pi * 0.03 * 0.02 * 0.01, rel=0.01)


def test_contains_tells_inside_from_outside() -> None:
    inside = SOLIDS['box'].contains([[1.0, 2.0, 3.0], [1.049, 2.0, 3.0], [1.051, 2.0, 3.0]])
    assert inside.tolist() == [True, True, False]


def test_shading_is_flat_on_a_box_and_smooth_on_a_ball() -> None:
    cube, ball = box((1.0, 1.0, 1.0), RED), ellipsoid((1.0, 1.0, 1.0), RED, sides=40, rings=20)
    assert np.allclose(cube.corner_normals, cube.normals[:, None])
    assert np.einsum('tki,tki->tk', ball.corner_normals, ball.corners).min() > 0.98


def test_an_obj_without_a_body_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'flat.obj'
    path.write_text('v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n')
    with pytest.raises(ValueError, match=r'Expected at least 4 vertices in flat\.obj, got 3'):
        hull_from_obj(path, RED)


def test_both_postures_have_the_same_named_segments() -> None:
    names = [set(hand_parts(posture)) for posture in Posture]
    assert names[0] == names[1]
    assert {'palm', 'thumb_distal', 'index_distal', 'little_proximal', 'sleeve'} <= names[0]


@pytest.mark.parametrize('side', list(Side))
@pytest.mark.parametrize('yaw', [0.0, -1.2, np.pi / 2])
@pytest.mark.parametrize('posture', list(Posture))
def test_the_forearm_always_leaves_towards_the_person(
    posture: Posture, yaw: float, side: Side
) -> None:
    parts = hand_parts(posture, yaw, side=side)
    sleeve = parts['sleeve'].vertices
    along = sleeve[sleeve[:, 0].argmax()] - parts['wrist'].vertices.mean(axis=0)
    assert along[0] > 0.28
    assert 20 < np.degrees(np.arctan2(along[2], along[0])) < 45
    assert all(volume(part) > 0 for part in parts.values())


@pytest.mark.parametrize('opening', [0.04, 0.056, 0.095])
def test_a_grasp_leaves_the_stated_opening_free(opening: float) -> None:
    parts = hand_parts(Posture.GRASP, opening=opening)
    thumb = parts['thumb_distal'].vertices[:, 1].min()
    finger = parts['index_distal'].vertices[:, 1].max()
    assert thumb - finger == pytest.approx(opening, abs=0.006)


def test_a_pushing_hand_is_above_the_table_with_its_palm_at_the_origin() -> None:
    parts = hand_parts(Posture.PUSH)
    lowest = min(part.vertices[:, 2].min() for part in parts.values())
    assert lowest == pytest.approx(-0.024, abs=0.002)
    assert parts['palm'].vertices[:, 1].max() == pytest.approx(0.0, abs=0.002)
