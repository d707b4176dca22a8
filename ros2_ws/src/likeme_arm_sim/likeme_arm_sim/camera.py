"""The Kinect over the table: renders the cell and applies the sensor model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from likeme_arm_sim.arm import Arm
from likeme_arm_sim.background import cell_background
from likeme_arm_sim.human_hand import HumanHand
from likeme_arm_sim.kinect import Kinect, RgbdImages
from likeme_arm_sim.kinect_noise import KinectNoise
from likeme_arm_sim.panda_meshes import panda_links
from likeme_arm_sim.physics_world import PhysicsWorld
from likeme_arm_sim.renderer import MeshRenderer, PaintedPlane, RenderBody
from likeme_arm_sim.toys import toys_of
from likeme_core.world import World


class CellCamera:
    """The camera of one cell.

    arm: None if it is not drawn. lying: sheets on the table.
    """

    def __init__(
        self,
        world: World,
        physics_world: PhysicsWorld,
        arm: Arm | None,
        hand: HumanHand,
        noise: KinectNoise | None,
        seed: int,
        lying: Sequence[PaintedPlane] = (),
    ) -> None:
        self._physics_world, self._arm, self._hand = physics_world, arm, hand
        self._toys = {name: toy.parts for name, toy in toys_of(world).items()}
        self._links = panda_links()
        # Without the gripper, whose fingers are elsewhere each time that the arm comes home.
        links = [mesh for name, mesh in self._links.items() if name.startswith('panda_link')]
        background = (*cell_background(world.table), *lying)
        self._renderer = MeshRenderer(world.camera, background, links)
        self._kinect = Kinect(world.camera, noise, seed)

    def restart(self, seed: int) -> None:
        """Reseed the sensor noise."""
        self._kinect.restart(seed)

    def frame(self) -> RgbdImages:
        """The present colour and depth images."""
        return self._kinect.sense(self._renderer.render(self.bodies()))

    def bodies(self) -> list[RenderBody]:
        """The bodies that may move, at their present poses."""
        return self._toy_bodies() + self._arm_bodies() + self._hand_bodies()

    def _toy_bodies(self) -> list[RenderBody]:
        poses = {name: self._physics_world.toy_pose(name).matrix() for name in self._toys}
        named = ((name, part) for name, parts in self._toys.items() for part in parts)
        return [RenderBody(part, poses[name]) for name, part in named]

    def _arm_bodies(self) -> list[RenderBody]:
        if self._arm is None:
            return []
        poses = self._arm.link_poses()
        return [RenderBody(mesh, poses[link].matrix()) for link, mesh in self._links.items()]

    def _hand_bodies(self) -> list[RenderBody]:
        if self._hand.away:
            return []
        pose = np.eye(4)
        pose[:3, 3] = self._hand.position
        return [RenderBody(mesh, pose) for mesh in self._hand.parts]
