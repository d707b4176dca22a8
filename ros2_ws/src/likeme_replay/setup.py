from setuptools import find_packages, setup

package = 'likeme_replay'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['**/*.csv', '**/*.json', '**/*.yaml', 'py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
    ],
    install_requires=[
        'setuptools',
        'matplotlib',
        'numpy',
        'opencv-python-headless',
        'pyyaml',
        'rich',
        'rosbags',
        'typer',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description='Recording and replaying the ROS graph; the decision log.',
    license='Apache-2.0',
    extras_require={'foxglove': ['foxglove-sdk'], 'view': ['rerun-sdk'], 'test': ['pytest']},
    entry_points={
        'console_scripts': [
            'calibrate = likeme_replay.camera_tools.calibrate:main',
            'foxglove = likeme_replay.foxglove_console:main',
            'record = likeme_replay.record:main',
            'replay = likeme_replay.replay:main',
            'see = likeme_replay.camera_tools.see:main',
            'teach = likeme_replay.camera_tools.teach:main',
            'view = likeme_replay.view:main',
            'policies = likeme_replay.policies.console:main',
            'policy_monitor_node = likeme_replay.ros.policy_monitor_node:main',
        ],
    },
)
