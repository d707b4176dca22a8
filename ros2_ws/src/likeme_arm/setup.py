from setuptools import find_packages, setup

package = 'likeme_arm'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['py.typed', 'arms/*.yaml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
    ],
    install_requires=[
        'setuptools',
        'numpy',
        'scipy',
        'shapely',
        'typer',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description='Action primitives (place, push), the hold, and the driver of a real arm.',
    license='Apache-2.0',
    # The last is where the shipped configurations find their URDFs.
    extras_require={
        'real_arm': ['pin', 'coal', 'ruckig', 'example-robot-data'],
        'test': ['pytest'],
    },
    entry_points={
        'console_scripts': [
            'allow = likeme_arm.ros.allow_command:main',
            'arm_driver_node = likeme_arm.arm_driver_node:main',
            'hold_keeper_node = likeme_arm.hold_keeper_node:main',
            'stop = likeme_arm.ros.stop_command:main',
        ],
    },
)
