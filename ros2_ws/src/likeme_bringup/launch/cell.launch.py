"""Start the nodes: `ros2 launch likeme_bringup cell.launch.py only:=arm,inference seed:=3`."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable, Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription
from likeme_arm_sim.simulated_parts import SimulatedPart
from likeme_bringup.child import Ended
from likeme_bringup.respawn import Lives, Respawn
from likeme_bringup.start_cell import Part, StartOptions, executable
from likeme_core.tabletop import Mode
from likeme_core.world import load_world

#: s from the death of a node to its next start; launch knows only one pause.
RESPAWN_DELAY = 0.5
ARGUMENTS = {
    'only': (
        '',
        'Parts to start, separated by commas: hold, arm, perception, inference; empty: all.',
    ),
    'simulate': ('', 'Parts to simulate, separated by commas: arm, person, camera; empty: all.'),
    'network': ('false', 'true: let nodes on other machines of the subnet take part.'),
    'mode': ('', 'How the robot imitates: trajectory, goal_based, interactive, sequential.'),
    'threshold': ('', 'Ask for help below this predicted success.'),
    'actions': ('', 'Budget of the sequential mode.'),
    'seed': ('', 'Seed of the simulated cell.'),
    'real_time_factor': ('', '1: real time; 0: as fast as possible.'),
    'model': ('', 'Transition model file of the robot.'),
    'experience': ('', 'Experience store: executed imitations improve the model.'),
    'world': ('', 'A shipped world or a world file.'),
    'params': ('', 'ROS parameter file; config/cell.yaml has all names.'),
    'respawn': ('true', 'false: end all when a node dies, instead of starting it again.'),
    'domain': ('', 'ROS domain; empty: ROS_DOMAIN_ID or 0.'),
}


def generate_launch_description() -> LaunchDescription:
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])


def start(context: LaunchContext) -> list[SetEnvironmentVariable | Node]:
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    simulate = tuple(SimulatedPart(name) for name in names(given['simulate']))
    options = StartOptions(
        simulate=simulate or None,
        mode=Mode(given['mode']) if given['mode'] else None,
        threshold=float(given['threshold']) if given['threshold'] else None,
        actions=int(given['actions']) if given['actions'] else None,
        seed=int(given['seed']) if given['seed'] else None,
        real_time_factor=float(given['real_time_factor']) if given['real_time_factor'] else None,
        experience=given['experience'] or None,
        model=Path(given['model']) if given['model'] else None,
        world=load_world(given['world']).source if given['world'] else None,
    )
    parts = [Part(name) for name in names(given['only'])] or list(Part)
    respawn = given['respawn'] == 'true'
    nodes = (node(part, options, given['params'], respawn) for part in parts)
    return [*environment(given), *nodes]


def names(text: str) -> list[str]:
    return [name.strip() for name in text.split(',') if name.strip()]


def environment(given: dict[str, str]) -> list[SetEnvironmentVariable]:
    config = os.path.join(get_package_share_directory('likeme_bringup'), 'config')
    chosen = {
        'FASTRTPS_DEFAULT_PROFILES_FILE': os.environ.get(
            'FASTRTPS_DEFAULT_PROFILES_FILE', os.path.join(config, 'fastdds.xml')
        ),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET' if given['network'] == 'true' else 'LOCALHOST',
    }
    if given['domain']:
        chosen['ROS_DOMAIN_ID'] = given['domain']
    return [SetEnvironmentVariable(name, value) for name, value in chosen.items()]


def node(part: Part, options: StartOptions, params: str, respawn: bool) -> Node:
    package, name = executable(part)
    return Node(
        package=package,
        executable=name,
        output='screen',
        parameters=[*([params] if params else []), options.overrides(part)],
        respawn=respawn,
        respawn_delay=RESPAWN_DELAY,
        # Not respawn_max_retries: it counts deaths over the whole life of the cell.
        on_exit=on_exit(part, Respawn() if respawn else Respawn(pauses=())),
    )


def on_exit(
    part: Part, policy: Respawn
) -> Callable[[ProcessExited, LaunchContext], list[Shutdown]]:
    """When all are to end with a node: as under start_cell."""
    lives = Lives(policy)
    lives.start(time.monotonic())

    def shut_down(event: ProcessExited, _: LaunchContext) -> list[Shutdown]:
        now = time.monotonic()
        pause = lives.death(event.returncode, now)
        if pause is None:
            end = Ended(part.value, event.returncode, lives.exhausted)
            return [Shutdown(reason=end.message)]
        lives.start(now + RESPAWN_DELAY)
        return []

    return shut_down
