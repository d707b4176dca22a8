"""The Franka Panda's links as convex meshes, in the frames of pybullet_data's URDF."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from likeme_arm_sim.kinematics import PANDA_URDF
from likeme_arm_sim.meshes import Colour, ConvexMesh, Floats, hull_from_obj

WHITE, GREY, DARK = (236, 238, 240), (176, 180, 186), (64, 66, 70)
COLOURS: Mapping[str, Colour] = {
    'panda_link2': (226, 228, 232),
    'panda_link4': (226, 228, 232),
    'panda_link6': GREY,
    'panda_link7': (206, 210, 214),
    'panda_hand': (214, 217, 221),
    'panda_leftfinger': DARK,
    'panda_rightfinger': DARK,
}


@cache
def panda_links() -> Mapping[str, ConvexMesh]:
    """URDF link name to the hull bullet collides with, vertices in the URDF link frame, m.

    In bullet that frame is `getLinkState(...)[4:6]` (worldLinkFrame), not the inertial one [0:2].
    """
    links = {}
    for link in ElementTree.parse(PANDA_URDF).getroot().iter('link'):
        collision = link.find('collision')
        if collision is not None:
            name = link.attrib['name']
            links[name] = _hull(collision, COLOURS.get(name, WHITE))
    return MappingProxyType(links)


def _hull(collision: ElementTree.Element, colour: Colour) -> ConvexMesh:
    """The hull of a <collision> element's mesh, with its scale and origin applied."""
    mesh = collision.find('geometry/mesh')
    if mesh is None:
        raise ValueError('Expected a mesh in <collision>, got none.')
    path = PANDA_URDF.parent / mesh.attrib['filename'].removeprefix('package://')
    hull = hull_from_obj(path, colour)
    scale = np.array(mesh.attrib.get('scale', '1 1 1').split(), float)
    return ConvexMesh(hull.vertices * scale, hull.triangles, hull.colours).transformed(
        _origin(collision.find('origin'))
    )


def _origin(element: ElementTree.Element | None) -> Floats:
    """A URDF <origin> as a 4x4 pose."""
    pose = np.eye(4)
    if element is not None:
        rpy = np.array(element.attrib.get('rpy', '0 0 0').split(), float)
        pose[:3, :3] = Rotation.from_euler('xyz', rpy).as_matrix()
        pose[:3, 3] = np.array(element.attrib.get('xyz', '0 0 0').split(), float)
    return pose
