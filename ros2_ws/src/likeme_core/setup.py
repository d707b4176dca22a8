from setuptools import find_packages, setup

package = 'likeme_core'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['py.typed', 'worlds/**/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
    ],
    install_requires=[
        'setuptools',
        'jsonschema',
        'numpy',
        'pyyaml',
        'rich',
        'shapely',
        'typer',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description='States, actions and outcomes that all packages share; ROS helpers.',
    license='Apache-2.0',
    extras_require={'test': ['pytest']},
)
