from setuptools import find_packages, setup

package = 'likeme_inference'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['**/*.csv', 'py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
    ],
    install_requires=[
        'setuptools',
        'numpy',
        'scipy',
        'sqlalchemy',
        'typer',
    ],
    zip_safe=False,
    maintainer='LikeMe maintainers',
    maintainer_email='likeme-maintainers@users.noreply.github.com',
    description='Goal inference, action selection and requests for help (Chung et al. 2015).',
    license='Apache-2.0',
    extras_require={'arviz': ['arviz', 'h5netcdf'], 'test': ['pytest']},
    entry_points={
        'console_scripts': [
            'inference_node = likeme_inference.inference_node:main',
            'log = likeme_inference.log_commands:main',
        ],
    },
)
