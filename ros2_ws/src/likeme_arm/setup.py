from setuptools import find_packages, setup

package = 'likeme_arm'

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
        'typer',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description='Action primitives (place, push) against an injected motion interface.',
    license='Apache-2.0',
    extras_require={'test': ['pytest']},
    entry_points={
        'console_scripts': [
            'hold_keeper_node = likeme_arm.hold_keeper_node:main',
            'stop = likeme_arm.ros.stop_command:main',
        ],
    },
)
