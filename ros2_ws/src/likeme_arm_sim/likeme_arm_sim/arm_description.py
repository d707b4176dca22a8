"""The arm's URDF, with meshes that other programs find."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from likeme_arm_sim.kinematics import PANDA_URDF

PACKAGE, FOLDER = 'likeme_arm_sim', PANDA_URDF.parent.name
#: How pybullet_data writes its meshes: under the URDF's folder, not in a package `meshes`.
MESHES = 'package://meshes/'


def arm_urdf() -> str:
    """The URDF that the simulation loads, with the URIs of its meshes resolved.

    Those that setup.py installed (`package://`, which also resolves on another host that has this
    package), or, if pybullet was not there when it ran, those in the installed pybullet_data.
    """
    return PANDA_URDF.read_text(encoding='utf-8').replace(MESHES, f'{_mesh_folder()}/')


def _mesh_folder() -> str:
    try:
        installed = Path(get_package_share_directory(PACKAGE), FOLDER, 'meshes')
    except PackageNotFoundError:
        installed = None
    if installed is not None and installed.is_dir():
        return f'package://{PACKAGE}/{FOLDER}/meshes'
    return (PANDA_URDF.parent / 'meshes').as_uri()
