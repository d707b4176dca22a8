from setuptools import find_packages, setup

package = 'likeme_bags'

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
        'apsw',
        'backports.zstd',
        'lz4',
        'numpy',
        'opencv-python-headless',
        'pillow',
        'pyyaml',
        # Exactly this version: its writers are subclassed, its readers get indexes of ours.
        'rosbags==0.11.9',
        'typer',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description='Recorded files: reading any bag, mending, cutting, checking and exporting it.',
    license='Apache-2.0',
    extras_require={'lerobot': ['pyarrow'], 'test': ['pytest']},
    entry_points={'console_scripts': ['bag = likeme_bags.bag_console:main']},
)
