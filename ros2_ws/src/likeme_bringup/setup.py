from glob import glob

from setuptools import find_packages, setup

package = 'likeme_bringup'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
        # On the PATH of a sourced workspace, where console scripts are not.
        ('bin', ['bin/likeme']),
        (f'share/{package}/launch', sorted(glob('launch/*.launch.py'))),
        (f'share/{package}/config', sorted(glob('config/*'))),
    ],
    install_requires=[
        'setuptools',
        'matplotlib',
        'numpy',
        'opencv-python-headless',
        'pyyaml',
        'rich',
        'typer',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description='Launch files, configuration, supervisor, thin callers, demo.',
    license='Apache-2.0',
    extras_require={'test': ['pytest']},
    entry_points={
        'console_scripts': [
            'arm = likeme_bringup.ros.cell_commands:arm',
            'cell = likeme_bringup.ros.cell_commands:cell',
            'demo = likeme_bringup.demo:run',
            'doctor = likeme_bringup.ros.doctor_command:main',
            'likeme = likeme_bringup.likeme_command:main',
            'param = likeme_bringup.ros.param_command:param',
            'show = likeme_bringup.ros.cell_commands:show',
            'start_cell = likeme_bringup.start_cell:main',
            'topic = likeme_bringup.ros.topic_commands:topic',
            'world = likeme_bringup.world_commands:main',
        ],
    },
)
