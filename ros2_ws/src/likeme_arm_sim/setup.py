import sys
from importlib.util import find_spec
from pathlib import Path

from setuptools import find_packages, setup

package = 'likeme_arm_sim'

#: Commands that install data files.
COMMANDS = {'install', 'install_data', 'symlink_data', 'bdist_wheel'}


def panda_files() -> list[tuple[str, list[str]]]:
    """The Panda's meshes and their licence (Apache-2.0), of the pybullet that is installed.

    Copied when this package is installed, so that `package://` URIs resolve: 11 MB that need not
    be in the repository. To a command that only asks, none: colcon links what it reads from there
    into its build folder, which cannot be done with files outside of the package.
    """
    found = find_spec('pybullet_data') if COMMANDS & {*sys.argv} else None
    if found is None or found.origin is None:
        return []
    root = Path(found.origin).parent / 'franka_panda'
    files = [root / 'LICENSE.txt', *sorted((root / 'meshes').rglob('*.*'))]
    return [
        (f'share/{package}/{path.parent.relative_to(root.parent)}', [str(path)]) for path in files
    ]


setup(
    name=package,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
        *panda_files(),
    ],
    install_requires=[
        'setuptools',
        'numpy',
        'opencv-python-headless',
        'pybullet',
        'scipy',
        'trimesh',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description='Simulated table, toys, Kinect, arm and human hand in pybullet, with their node.',
    license='Apache-2.0',
    extras_require={'test': ['pytest']},
    entry_points={
        'console_scripts': [
            'arm_driver_node = likeme_arm_sim.arm_driver_node:main',
            'robot_stand_in_node = likeme_arm_sim.robot_stand_in_node:main',
        ],
    },
)
