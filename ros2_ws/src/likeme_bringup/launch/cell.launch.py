"""Start the nodes: `ros2 launch likeme_bringup cell.launch.py only:=arm,inference seed:=3`.

Imports launch and launch_ros alone: this file runs in the Python of `ros2`, which need not have
what the nodes need. What to start is asked of `start_cell`, which also refuses what is wrong.
"""

from __future__ import annotations

import atexit
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Any
from uuid import uuid4

from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable, Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare

from launch import LaunchContext, LaunchDescription

#: s from the death of a node to its next start; launch knows only one pause.
RESPAWN_DELAY = 0.5
#: Has the kernel end a node when `ros2 launch` is gone: it leaves its nodes behind at SIGTERM.
#: SIGINT is blocked until the node can take it, which would else print a traceback of its imports.
PREFIX = 'setpriv --pdeathsig SIGTERM env --block-signal=INT'
#: Exit code of a node that refuses its parameters: EX_CONFIG.
REFUSED = 78
BOOLEAN = ['true', 'false', 'True', 'False']
ARGUMENTS: dict[str, tuple[str, str]] = {
    'only': (
        '',
        'Parts to start, separated by commas: hold, arm, perception, inference; empty: all.',
    ),
    'simulate': ('', 'Parts to simulate, separated by commas: arm, person, camera; empty: all.'),
    'namespace': ('', 'Of all nodes: a cell in a namespace has a clock of its own.'),
    'network': ('false', 'true: let nodes on other machines of the subnet take part.'),
    'mode': ('', 'How the robot imitates: trajectory, goal_based, interactive, sequential.'),
    'threshold': ('', 'Ask for help below this predicted success.'),
    'actions': ('', 'Budget of the sequential mode.'),
    'seed': ('', 'Seed of the simulated cell.'),
    'real_time_factor': ('', '1: real time; 0: as fast as possible.'),
    'model': ('', 'Transition model file of the robot.'),
    'experience': ('', 'Experience store: executed imitations improve the model.'),
    'world': ('', 'A shipped world or a world file.'),
    'arm': ('', 'Drive a real arm: a shipped configuration or a file, not the simulator.'),
    'dry_run': ('false', 'true: with arm: plan and show motions, move nothing.'),
    'step': ('false', 'true: with arm: ask before each motion.'),
    'params_file': ('', 'ROS parameter file; config/cell.yaml has all names.'),
    'use_sim_time': (
        '',
        'true: nodes run on /clock; empty: as the parameter file says, else if all is simulated.',
    ),
    'autostart': (
        '',
        'false: managed nodes wait for `ros2 lifecycle`; empty: as the file says, or true.',
    ),
    'respawn': ('true', 'false: end all when a node dies, instead of starting it again.'),
    'domain': ('', 'ROS domain; empty: ROS_DOMAIN_ID or 0.'),
}
#: Arguments that are parameters of the nodes where they are not empty.
PARAMETERS = ('use_sim_time', 'autostart')
CHOICES = dict.fromkeys(('network', 'respawn', 'dry_run', 'step'), BOOLEAN) | {
    name: ['', *BOOLEAN] for name in PARAMETERS
}
#: Arguments that start_cell takes under their own names.
PASSED = (
    'mode', 'threshold', 'actions', 'seed', 'real_time_factor', 'model', 'experience', 'world',
    'arm', 'domain',
)  # fmt: skip


def generate_launch_description() -> LaunchDescription:
    declared = [
        DeclareLaunchArgument(
            name, default_value=default, description=description, choices=CHOICES.get(name)
        )
        for name, (default, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])


def start(context: LaunchContext) -> list[SetEnvironmentVariable | Node]:
    given = {name: LaunchConfiguration(name).perform(context).strip() for name in ARGUMENTS}
    program = ExecutableInPackage('start_cell', 'likeme_bringup').perform(context)
    plan = planned([program, *options(given)])
    files = written(plan['parameter_files'])
    config = os.path.join(FindPackageShare('likeme_bringup').perform(context), 'config')
    nodes = (node(*each, given, files, plan) for each in plan['nodes'])
    return [*environment(given, config), *nodes]


def options(given: dict[str, str]) -> Iterator[str]:
    """The options of start_cell."""
    yield from ('--launch-plan', given['namespace'])
    for name in ('only', 'simulate'):
        for part in given[name].split(','):
            if part.strip():
                yield from (f'--{name}', part.strip())
    for name in PASSED:
        if given[name]:
            yield from (f'--{name.replace("_", "-")}', given[name])
    for name in ('dry_run', 'step'):
        if is_true(given[name]):
            yield f'--{name.replace("_", "-")}'
    if given['params_file']:
        yield from ('--params', given['params_file'])


def planned(command: list[str]) -> dict[str, Any]:
    """What start_cell answers; raises its sentence if it refuses."""
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    if answer.returncode:
        *_, sentence = answer.stderr.strip().splitlines() or ['start_cell failed.']
        raise RuntimeError(sentence.removeprefix('Error: ').replace('--params', 'params_file'))
    plan: dict[str, Any] = json.loads(answer.stdout)
    return plan


def written(texts: list[str]) -> list[str]:
    """Files with these texts, which go when this process ends."""
    folder = tempfile.mkdtemp(prefix='likeme_launch_')
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    paths = [os.path.join(folder, f'{number}.yaml') for number in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text)
    return paths


def environment(given: dict[str, str], config: str) -> list[SetEnvironmentVariable]:
    chosen = {
        'FASTRTPS_DEFAULT_PROFILES_FILE': os.environ.get(
            'FASTRTPS_DEFAULT_PROFILES_FILE', os.path.join(config, 'fastdds.xml')
        ),
        # As start_cell has it, see likeme_core.run_memory.
        'LIKEME_RUN': uuid4().hex,
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET' if is_true(given['network']) else 'LOCALHOST',
    }
    if given['domain']:
        chosen['ROS_DOMAIN_ID'] = given['domain']
    return [SetEnvironmentVariable(name, value) for name, value in chosen.items()]


def is_true(word: str) -> bool:
    return word.lower() == 'true'


def node(
    part: str,
    package: str,
    executable: str,
    given: dict[str, str],
    files: list[str],
    plan: dict[str, Any],
) -> Node:
    respawn = is_true(given['respawn'])
    chosen = {name: is_true(given[name]) for name in PARAMETERS if given[name]}
    return Node(
        package=package,
        executable=executable,
        exec_name=part,
        namespace=given['namespace'],
        output='screen',
        parameters=[*files, chosen] if chosen else files,
        # Absolute by convention: two cells would set each other's time.
        remappings=[('/clock', 'clock')] if given['namespace'] else [],
        prefix=PREFIX,
        respawn=respawn,
        respawn_delay=RESPAWN_DELAY,
        # Not respawn_max_retries: it counts deaths over the whole life of the cell.
        on_exit=on_exit(part, plan['pauses'] if respawn else 0, plan['stable']),
    )


def on_exit(
    part: str, pauses: int, stable: float
) -> Callable[[ProcessExited, LaunchContext], list[Shutdown]]:
    """When all are to end with a node: as under start_cell, see likeme_bringup.respawn.

    Raises where the node failed: Shutdown has no exit code, and `ros2 launch` ends with 1 after an
    exception alone; it ends the other nodes in the same way.

    pauses: deaths in a row that are mended. stable: s of life that end the row.
    """
    started, in_a_row, restarts = time.monotonic(), 0, 0

    def shut_down(event: ProcessExited, context: LaunchContext) -> list[Shutdown]:
        nonlocal started, in_a_row, restarts
        code, now = event.returncode, time.monotonic()
        if context.is_shutdown:
            return []
        if code == 0:
            return [Shutdown(reason=f'{part} ended with exit code 0')]
        if code == REFUSED and not restarts:
            raise RuntimeError(f'{part} {how(code)}.')
        in_a_row = 1 if now - started >= stable else in_a_row + 1
        started = now + RESPAWN_DELAY
        if in_a_row <= pauses:
            restarts += 1
            return []
        row = f', death {in_a_row} in a row within {stable:g} s of a start' if pauses else ''
        raise RuntimeError(f'{part} {how(code)}{row}.')

    return shut_down


def how(code: int) -> str:
    if code >= 0:
        return f'ended with exit code {code}'
    return f'was ended by {signal.Signals(-code).name}'
