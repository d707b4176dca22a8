from setuptools import find_packages, setup

package = 'likeme_experiments'

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
        'rich',
        'scipy',
        'typer',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description="The paper's figures and tables, learning, executed imitation, physics fit.",
    license='Apache-2.0',
    extras_require={'cluster': ['distributed'], 'test': ['pytest']},
    entry_points={
        'console_scripts': [
            'fit_physics = likeme_experiments.commands.fit_physics:run',
            'gaze = likeme_experiments.commands.gaze:run',
            'learn = likeme_experiments.commands.learn:run',
            'reproduce = likeme_experiments.commands.reproduce:run',
        ],
    },
)
