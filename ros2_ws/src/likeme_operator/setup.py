from setuptools import find_packages, setup

package = 'likeme_operator'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['py.typed', '*.tcss']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
    ],
    install_requires=[
        'setuptools',
        'numpy',
        'rich',
        'typer',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description="The operator's desk: answers, hold, what-if and the state of a running cell.",
    license='Apache-2.0',
    extras_require={'test': ['pytest'], 'screen': ['aiohttp', 'textual', 'textual-serve']},
    entry_points={
        'console_scripts': [
            'ask_human = likeme_operator.ros.question_commands:main',
            'operator = likeme_operator.ros.operator_commands:main',
        ],
    },
)
