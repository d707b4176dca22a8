from setuptools import find_packages, setup

package = 'likeme_arm_sim'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
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
        ],
    },
)
