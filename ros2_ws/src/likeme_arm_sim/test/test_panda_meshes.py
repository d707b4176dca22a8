from __future__ import annotations

import numpy as np
import pybullet as bullet
from scipy.spatial.transform import Rotation

from likeme_arm_sim.kinematics import PANDA_URDF
from likeme_arm_sim.panda_meshes import panda_links


def test_link_hulls_lie_where_bullet_collides() -> None:
    client = bullet.connect(bullet.DIRECT)
    arm = bullet.loadURDF(str(PANDA_URDF), useFixedBase=True, physicsClientId=client)
    joints = range(bullet.getNumJoints(arm, physicsClientId=client))
    for joint, angle in zip(joints, np.random.default_rng(2).uniform(-1, 0.03, 12), strict=True):
        bullet.resetJointState(arm, joint, angle, physicsClientId=client)
    for joint in joints:
        name = bullet.getJointInfo(arm, joint, physicsClientId=client)[12].decode()
        if name not in panda_links():
            continue
        state = bullet.getLinkState(
            arm, joint, computeForwardKinematics=True, physicsClientId=client
        )
        turn = Rotation.from_quat(state[5]).as_matrix()
        cloud = panda_links()[name].vertices @ turn.T + state[4]
        low, high = bullet.getAABB(arm, joint, physicsClientId=client)
        # Bullet's boxes are looser than the hull by its margin and never tighter.
        assert (cloud.min(axis=0) > np.array(low) - 1e-3).all(), name
        assert (cloud.max(axis=0) < np.array(high) + 1e-3).all(), name
        assert np.allclose(cloud.mean(axis=0), np.add(low, high) / 2, atol=0.06), name
    bullet.disconnect(client)


def test_every_link_with_a_body_is_there_and_the_right_finger_is_turned() -> None:
    links = panda_links()
    assert {f'panda_link{k}' for k in range(8)} <= set(links)
    left, right = links['panda_leftfinger'].vertices, links['panda_rightfinger'].vertices
    assert np.allclose(left * [-1, -1, 1], right, atol=1e-9)
