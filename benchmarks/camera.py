"""The simulated Kinect on one core: time per frame with the sensor model, beside TinyRenderer.

Two scenes at 640x480: the three toys and a hand, which has to reach 30 Hz, and the same with the
robot arm, which has to reach 15 Hz. Both rates must leave half of the core to physics and ROS.
pybullet's TinyRenderer draws the same meshes in the same run. Times are processor time, which
other load affects little.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence

import cv2
import numpy as np
import pybullet as bullet
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import report
from likeme_arm_sim.background import cell_background
from likeme_arm_sim.hand_shapes import Posture, hand_parts
from likeme_arm_sim.kinect import Kinect
from likeme_arm_sim.kinematics import PANDA_URDF
from likeme_arm_sim.meshes import Floats
from likeme_arm_sim.panda_meshes import panda_links
from likeme_arm_sim.renderer import MeshRenderer, RenderBody
from likeme_arm_sim.toys import toys_of
from likeme_core.camera_mount import CameraMount
from likeme_core.paper_world import WORLD
from likeme_core.progress_bar import counted

TOYS = toys_of(WORLD)
FRAMES, TINY_FRAMES = 200, 8
TOY_PLACES = {
    'pear': (0.38, 0.17, 0.5),
    'lemon': (0.50, -0.08, 1.0),
    'chicken': (0.40, -0.22, 0.3),
}
REACHING = (0.2, 0.35, 0.1, -2.1, 0.0, 2.45, 0.8, 0.035, 0.035)
NEAR, FAR = 0.1, 10.0


def on_one_core() -> None:
    """Restart this script on a single core, before any library has started threads."""
    if len(os.sched_getaffinity(0)) > 1:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        single = {'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1'}
        os.execve(sys.executable, sys.orig_argv, os.environ | single)


def pose(x: float, y: float, z: float, rotation: Rotation | None = None) -> Floats:
    """A 4x4 pose from a place, m, and a rotation."""
    matrix = np.eye(4)
    matrix[:3, :3] = (rotation or Rotation.identity()).as_matrix()
    matrix[:3, 3] = x, y, z
    return matrix


def toys() -> list[RenderBody]:
    """The three toys on the table."""
    bodies = []
    for name, (x, y, yaw) in TOY_PLACES.items():
        where = pose(x, y, TOYS[name].resting_height, Rotation.from_euler('z', yaw))
        bodies += [RenderBody(part, where) for part in TOYS[name].parts]
    return bodies


def hand(shift: float) -> list[RenderBody]:
    """A hand over the lemon, moved by `shift`, m."""
    where = pose(0.50 + shift, -0.08 + shift, 0.03 + shift)
    return [RenderBody(part, where) for part in hand_parts(Posture.GRASP).values()]


def arm(client: int, body: int, shift: float) -> list[RenderBody]:
    """The arm bent over the table, its first joint turned by 5 `shift`, rad per m."""
    angles = iter(np.add(REACHING, [5 * shift] + [0.0] * 8))
    bodies = [RenderBody(panda_links()['panda_link0'], np.eye(4))]
    count = bullet.getNumJoints(body, physicsClientId=client)
    for joint in range(count):
        if bullet.getJointInfo(body, joint, physicsClientId=client)[2] != bullet.JOINT_FIXED:
            bullet.resetJointState(body, joint, next(angles), physicsClientId=client)
    for joint in range(count):
        name = bullet.getJointInfo(body, joint, physicsClientId=client)[12].decode()
        if name in panda_links():
            state = bullet.getLinkState(body, joint, False, True, physicsClientId=client)
            x, y, z = state[4]
            where = pose(x, y, z, Rotation.from_quat(state[5]))
            bodies.append(RenderBody(panda_links()[name], where))
    return bodies


def milliseconds(what: str, work: Callable[[int], object], times: int) -> Floats:
    """Processor time of each of `times` calls, ms, after two to warm up."""
    spent = []
    for index in counted((0, 1, *range(times)), what, times + 2, timed=True):
        start = time.process_time()
        work(index)
        spent.append(time.process_time() - start)
    return 1e3 * np.array(spent[2:])


class Tiny:
    """The same meshes under pybullet's software renderer."""

    def __init__(self, bodies: Sequence[RenderBody], camera: CameraMount) -> None:
        self.client = bullet.connect(bullet.DIRECT)
        self._camera = camera
        for mesh, where in bodies:
            self._add(mesh.transformed(where).vertices, mesh.triangles)
        frame = camera.pose()
        self._view = bullet.computeViewMatrix(
            frame[:3, 3], frame[:3, 3] + frame[:3, 2], -frame[:3, 1]
        )
        # TinyRenderer samples pixels at their lower left corners.
        sides = -camera.cx, camera.width - camera.cx
        ends = camera.cy + 1 - camera.height, camera.cy + 1
        edges = [edge * NEAR / camera.fx for edge in (*sides, *ends)]
        self._lens = bullet.computeProjectionMatrix(*edges, NEAR, FAR)

    def _add(self, vertices: Floats, triangles: NDArray[np.int32]) -> None:
        shape = bullet.createVisualShape(
            bullet.GEOM_MESH,
            vertices=vertices.tolist(),
            indices=triangles.ravel().tolist(),
            physicsClientId=self.client,
        )
        bullet.createMultiBody(0, -1, shape, physicsClientId=self.client)

    def depth(self) -> Floats:
        """Depth (H, W), m."""
        image = bullet.getCameraImage(
            self._camera.width,
            self._camera.height,
            self._view,
            self._lens,
            shadow=0,
            flags=bullet.ER_NO_SEGMENTATION_MASK,
            renderer=bullet.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        buffer = np.reshape(image[3], (self._camera.height, self._camera.width)).astype(float)
        return np.asarray(FAR * NEAR / (FAR - (FAR - NEAR) * buffer))


def main() -> None:
    """Measure and publish."""
    on_one_core()
    report.option_parser('camera').parse_args()
    cv2.setNumThreads(1)
    background = cell_background(WORLD.table)
    renderer, kinect = MeshRenderer(WORLD.camera, background), Kinect(WORLD.camera)
    client = bullet.connect(bullet.DIRECT)
    body = bullet.loadURDF(str(PANDA_URDF), useFixedBase=True, physicsClientId=client)
    shifts = 0.05 * np.sin(np.arange(FRAMES) / 10)
    with_hand = [toys() + hand(shift) for shift in shifts]
    with_arm = [with_hand[k] + arm(client, body, shift) for k, shift in enumerate(shifts)]

    hand_scene, arm_scene = 'toys and hand', 'toys, hand and arm'
    quick = milliseconds(hand_scene, lambda k: kinect.sense(renderer.render(with_hand[k])), FRAMES)
    full = milliseconds(arm_scene, lambda k: kinect.sense(renderer.render(with_arm[k])), FRAMES)
    drawn = milliseconds('drawing alone', lambda k: renderer.render(with_arm[k]), FRAMES)
    still = [RenderBody(item.mesh, np.eye(4)) for item in background]
    tiny = Tiny([*still, *with_arm[0]], WORLD.camera)
    theirs = milliseconds('TinyRenderer', lambda k: tiny.depth(), TINY_FRAMES)
    error = 1e3 * np.abs(tiny.depth() - renderer.render(with_arm[0]).depth)

    bars = [
        *bars_of(hand_scene, quick, 15.0, 30.0),
        *bars_of(arm_scene, full, 20.0, 15.0),
        report.Bar(
            'drawing, times as fast',
            float(np.median(theirs) / np.median(drawn)),
            1.0,
            'x',
            'TinyRenderer, same meshes, no sensor model',
            TINY_FRAMES,
            at_most=False,
        ),
        report.Bar(
            'depth, 99th percentile of difference',
            float(np.percentile(error, 99)),
            0.1,
            'mm',
            'TinyRenderer',
            error.size,
        ),
    ]
    report.publish(
        'camera',
        bars,
        {
            'image': f'{WORLD.camera.width}x{WORLD.camera.height}, one core, one thread',
            'drawing alone, with arm': f'{np.median(drawn):.1f} ms',
            'TinyRenderer': f'{np.median(theirs):.0f} ms, {1e3 / np.median(theirs):.1f} Hz',
            'core used, hand at 30 Hz': f'{np.median(quick) * 30 / 1e3:.0%}',
            'core used, arm at 15 Hz': f'{np.median(full) * 15 / 1e3:.0%}',
            'triangles': sum(len(item.mesh.triangles) for item in with_arm[0]),
        },
    )


def bars_of(scene: str, spent: Floats, budget: float, rate: float) -> list[report.Bar]:
    """The bars of one scene: median and 99th percentile, ms, and the rate it sustains, Hz."""
    period = 1e3 / rate
    return [
        report.Bar(f'{scene}: median', float(np.median(spent)), budget, 'ms', 'budget', FRAMES),
        report.Bar(
            f'{scene}: 99 %', float(np.percentile(spent, 99)), period, 'ms', 'period', FRAMES
        ),
        report.Bar(
            f'{scene}: rate', 1e3 / float(np.mean(spent)), rate, 'Hz', 'Kinect', FRAMES, False
        ),
    ]


if __name__ == '__main__':
    main()
