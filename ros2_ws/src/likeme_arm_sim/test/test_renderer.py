from __future__ import annotations

from dataclasses import replace

import numpy as np
import pybullet as bullet
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from likeme_arm_sim.background import cell_background
from likeme_arm_sim.hand_shapes import Posture, hand_parts
from likeme_arm_sim.meshes import ConvexMesh, Floats, box, ellipsoid
from likeme_arm_sim.panda_meshes import panda_links
from likeme_arm_sim.renderer import MeshRenderer, RenderBody, Rendering
from likeme_arm_sim.toys import toys_of
from likeme_core.camera_mount import CameraMount
from likeme_core.paper_world import WORLD

TOYS = toys_of(WORLD)


SCENE = WORLD
RED = (200, 30, 30)


def at(x: float, y: float, z: float, rotation: Rotation | None = None) -> Floats:
    pose = np.eye(4)
    pose[:3, :3] = (rotation or Rotation.identity()).as_matrix()
    pose[:3, 3] = x, y, z
    return pose


def hits(corners: Floats, origin: Floats, ray: Floats) -> Floats:
    """Multiples of `ray` where it meets triangles (T, 3, 3), inf if not (Moeller-Trumbore)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    across = np.cross(ray, c - a)
    determinant = np.einsum('ti,ti->t', b - a, across)
    scale = 1 / np.where(np.abs(determinant) < 1e-15, np.inf, determinant)
    p = np.einsum('ti,ti->t', origin - a, across) * scale
    side = np.cross(origin - a, b - a)
    q = side @ ray * scale
    distance = np.einsum('ti,ti->t', c - a, side) * scale
    inside = (p >= 0) & (q >= 0) & (p + q <= 1) & (distance > 0.05) & (scale != 0)
    return np.where(inside, distance, np.inf)


def cast(camera: CameraMount, bodies: list[RenderBody], pixels: NDArray[np.int64]) -> Floats:
    """Depth at pixels (N, 2: u, v) by casting one ray at a time against every triangle."""
    pose = camera.pose()
    corners = np.concatenate([m.transformed(frame).corners for m, frame in bodies])
    u, v = pixels.T
    x, y = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
    rays = np.stack([x, y, np.ones(len(pixels))], axis=1) @ pose[:3, :3].T
    return np.array([hits(corners, pose[:3, 3], ray).min() for ray in rays])


def crowd(rng: np.random.Generator) -> list[RenderBody]:
    """Toys, a hand and robot links tumbled over the table."""
    meshes: list[ConvexMesh] = [part for toy in TOYS.values() for part in toy.parts]
    meshes += hand_parts(Posture.GRASP).values()
    meshes += panda_links().values()
    bodies = []
    for mesh, turn in zip(meshes, Rotation.random(len(meshes), random_state=1), strict=True):
        x, y, z = rng.uniform([0.2, -0.3, 0.0], [0.65, 0.35, 0.3])
        bodies.append(RenderBody(mesh, at(x, y, z, turn)))
    return bodies


def test_depth_is_that_of_a_ray_caster_to_a_tenth_of_a_millimetre() -> None:
    rng = np.random.default_rng(0)
    bodies = crowd(rng)
    depth = MeshRenderer(SCENE.camera).render(bodies).depth
    seen = np.argwhere(np.isfinite(depth))[:, ::-1]
    pixels = np.concatenate([rng.permutation(seen)[:400], rng.integers(0, 480, (100, 2))])
    expected, found = cast(SCENE.camera, bodies, pixels), depth[pixels[:, 1], pixels[:, 0]]
    assert np.array_equal(np.isfinite(expected), np.isfinite(found))
    both = np.isfinite(expected)
    assert np.abs(expected[both] - found[both]).max() < 1e-4


def test_bodies_are_clipped_at_the_near_plane_and_the_image_border() -> None:
    camera = replace(SCENE.camera, width=64, height=48, fx=52.0, fy=52.0, cx=31.5, cy=23.5)
    eye, forward = camera.pose()[:3, 3], camera.pose()[:3, 2]
    plank = box((0.04, 2.0, 0.04), RED)
    bodies = [
        RenderBody(
            plank, at(*(eye + 0.02 * forward + [0.0, 0.0, -0.1]), Rotation.from_euler('x', 0.9))
        ),
        RenderBody(plank, at(0.4, 0.0, 0.0)),
        RenderBody(plank, at(*(eye - 0.5 * forward))),
        RenderBody(plank, at(9.0, 0.0, 0.0)),
    ]
    depth = MeshRenderer(camera).render(bodies).depth
    pixels = np.stack(np.meshgrid(np.arange(64), np.arange(48)), axis=2).reshape(-1, 2)
    expected = cast(camera, bodies, pixels).reshape(48, 64)
    assert np.isfinite(expected).sum() > 100
    differs = ~np.isclose(depth, expected, atol=1e-4) & ~(np.isinf(depth) & np.isinf(expected))
    assert not differs.any()


def test_the_camera_sees_what_pybullets_own_renderer_sees() -> None:
    camera = replace(SCENE.camera, width=160, height=120, fx=131.25, fy=131.25, cx=79.5, cy=59.5)
    cube = box((0.2, 0.3, 0.1), RED)
    ours = MeshRenderer(camera).render([RenderBody(cube, at(0.45, 0.1, 0.05))]).depth
    theirs = bullet_depth(camera, (0.2, 0.3, 0.1), (0.45, 0.1, 0.05))
    seen = np.isfinite(ours)
    assert seen.sum() > 300
    assert np.array_equal(seen, theirs < 5.0)
    assert np.abs(ours - theirs)[seen].max() < 1e-5


def test_bodies_that_return_to_a_pose_look_as_when_they_are_drawn_anew() -> None:
    camera, bodies = SCENE.camera, crowd(np.random.default_rng(3))
    background = cell_background(SCENE.table)
    plain = MeshRenderer(camera, background)
    keeping = MeshRenderer(camera, background, [mesh for mesh, _ in bodies[5:15]])
    moved = [RenderBody(mesh, pose + at(0.0, 0.0, 0.01) - np.eye(4)) for mesh, pose in bodies]
    # Drawn, pictured, its picture shown behind and in front of other bodies; elsewhere; again.
    for frame in (bodies, bodies, bodies[:15], moved[:5] + bodies[5:15], moved, bodies):
        expected, found = plain.render(frame), keeping.render(frame)
        assert np.array_equal(expected.rgb, found.rgb)
        assert np.array_equal(expected.depth, found.depth)


def bullet_depth(camera: CameraMount, size: tuple[float, ...], place: tuple[float, ...]) -> Floats:
    near, far = 0.1, 10.0
    client = bullet.connect(bullet.DIRECT)
    half = [edge / 2 for edge in size]
    shape = bullet.createVisualShape(bullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
    bullet.createMultiBody(0, -1, shape, place, physicsClientId=client)
    pose = camera.pose()
    view = bullet.computeViewMatrix(pose[:3, 3], pose[:3, 3] + pose[:3, 2], -pose[:3, 1])
    width, height = camera.width, camera.height
    # TinyRenderer samples pixels at their lower left corners.
    edges = [-camera.cx, width - camera.cx, camera.cy + 1 - height, camera.cy + 1]
    left, right, bottom, top = [edge * near / camera.fx for edge in edges]
    lens = bullet.computeProjectionMatrix(left, right, bottom, top, near, far)
    image = bullet.getCameraImage(
        width, height, view, lens, renderer=bullet.ER_TINY_RENDERER, physicsClientId=client
    )
    bullet.disconnect(client)
    buffer = np.reshape(image[3], (height, width)).astype(float)
    return np.asarray(far * near / (far - (far - near) * buffer))


def shown(renderer: MeshRenderer, *bodies: RenderBody) -> Rendering:
    return renderer.render(bodies)


@pytest.fixture(scope='module')
def cell() -> MeshRenderer:
    return MeshRenderer(SCENE.camera, cell_background(SCENE.table))


def pixel_of(x: float, y: float, z: float) -> tuple[int, int]:
    """(row, column) at which a point of base_link is seen."""
    point = np.linalg.inv(SCENE.camera.pose()) @ [x, y, z, 1.0]
    camera = SCENE.camera
    u = camera.fx * point[0] / point[2] + camera.cx
    v = camera.fy * point[1] / point[2] + camera.cy
    return round(v), round(u)


def test_the_empty_cell_shows_table_and_blue_line_where_they_are(cell: MeshRenderer) -> None:
    frame = shown(cell)
    line = frame.rgb[pixel_of(0.44, 0.0, 0.0)].astype(int)
    wood = frame.rgb[pixel_of(0.44, 0.2, 0.0)].astype(int)
    assert np.argmax(line) == np.argmax(SCENE.table.lines[0].colour)
    assert wood[0] > wood[1] > wood[2]
    place = np.linalg.inv(SCENE.camera.pose()) @ [0.44, 0.2, 0.0, 1.0]
    assert frame.depth[pixel_of(0.44, 0.2, 0.0)] == pytest.approx(place[2], abs=0.002)
    assert np.isfinite(frame.depth).all()


def test_the_nearer_body_hides_the_farther(cell: MeshRenderer) -> None:
    low = RenderBody(ellipsoid((0.03, 0.03, 0.03), (0, 200, 0)), at(0.44, 0.1, 0.03))
    toward = np.array(SCENE.camera.position) - [0.44, 0.1, 0.03]
    high = RenderBody(ellipsoid((0.02, 0.02, 0.02), RED), at(*([0.44, 0.1, 0.03] + 0.3 * toward)))
    here = pixel_of(0.44, 0.1, 0.03)
    assert np.argmax(shown(cell, low).rgb[here]) == 1
    for order in ((low, high), (high, low)):
        assert np.argmax(shown(cell, *order).rgb[here]) == 0


def test_frames_are_repeatable_and_leave_the_background_alone(cell: MeshRenderer) -> None:
    toy = [RenderBody(part, at(0.4, 0.1, 0.03)) for part in TOYS['pear'].parts]
    empty, first, second = shown(cell), shown(cell, *toy), shown(cell, *toy)
    assert np.array_equal(first.rgb, second.rgb)
    assert np.array_equal(first.depth, second.depth)
    assert np.array_equal(shown(cell).rgb, empty.rgb)
    assert first.depth.dtype == np.float32


def test_a_shadow_darkens_the_table_beside_a_body_and_no_depth(cell: MeshRenderer) -> None:
    toy = RenderBody(ellipsoid((0.03, 0.03, 0.03), RED), at(0.44, 0.15, 0.03))
    empty, frame = shown(cell), shown(cell, toy)
    beside, far = pixel_of(0.45, 0.108, 0.0), pixel_of(0.44, -0.2, 0.0)
    assert frame.rgb[beside].astype(int).sum() < 0.9 * empty.rgb[beside].astype(int).sum()
    assert np.array_equal(frame.rgb[far], empty.rgb[far])
    assert frame.depth[beside] == empty.depth[beside]
