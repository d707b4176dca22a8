"""Processes of a start and their ROS arguments; the launch file with stand-ins for `launch`."""

from __future__ import annotations

import ast
import runpy
import sys
import types
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import typer
import yaml
from typer.testing import CliRunner

from likeme_arm_sim.simulated_parts import SimulatedPart
from likeme_bringup.respawn import REFUSED
from likeme_bringup.start_cell import (
    Part,
    StartOptions,
    children,
    command,
    executable,
    parameter_file,
)
from likeme_core.paper_world import WORLD
from likeme_core.tabletop import Mode
from likeme_core.typer_app import App
from likeme_inference import node_settings as inference_settings
from likeme_perception import node_settings as perception_settings

PACKAGE = Path(__file__).parents[1]
SOURCES = PACKAGE.parent


def test_all_parts_by_default() -> None:
    assert [child.name for child in children()] == ['hold', 'arm', 'perception', 'inference']


def test_only_the_overridden_parameters_are_passed() -> None:
    settings = StartOptions(mode=Mode.GOAL_BASED, threshold=0.25, seed=4, real_time_factor=0.0)
    assert settings.overrides(Part.ARM) == {'seed': 4, 'real_time_factor': 0.0}
    assert settings.overrides(Part.INFERENCE) == {'mode': 'goal_based', 'help_threshold': 0.25}
    assert StartOptions().overrides(Part.INFERENCE) == {}


def test_the_command_line_comes_after_the_parameter_file(tmp_path: Path) -> None:
    mine = tmp_path / 'mine.yaml'
    mine.write_text('arm_driver: {ros__parameters: {seed: 3}}')
    words = command(Part.ARM, StartOptions(seed=4, parameter_files=(mine,)))
    assert words[:2] == ['env', '--block-signal=INT']
    assert words[3:] == [
        '-m', 'likeme_core.program', 'arm_driver', 'likeme_arm_sim.arm_driver_node', '--ros-args',
        '-p', 'use_sim_time:=true', '--params-file', str(mine), '-p', 'seed:=4'
    ]  # fmt: skip


@pytest.mark.parametrize(
    ('simulate', 'lines', 'simulated'),
    [
        (None, '{}', True),
        (tuple(SimulatedPart), '{}', True),
        ((SimulatedPart.ARM,), '{}', False),
        (None, 'arm_driver: {ros__parameters: {simulate: [camera, person]}}', False),
        (None, '/**: {ros__parameters: {publish_clock: false}}', False),
        (None, '/lab/arm_driver: {ros__parameters: {publish_clock: true}}', True),
        (tuple(SimulatedPart), 'arm_driver: {ros__parameters: {simulate: [arm]}}', True),
    ],
)
def test_nodes_run_on_the_clock_that_the_driver_publishes(
    tmp_path: Path, simulate: tuple[SimulatedPart, ...] | None, lines: str, simulated: bool
) -> None:
    file = tmp_path / 'mine.yaml'
    file.write_text(lines)
    options = StartOptions(simulate=simulate, parameter_files=(file,))
    assert options.simulated_clock == simulated
    for part in Part:
        assert ('use_sim_time:=true' in command(part, options)) == simulated


def test_the_parts_to_simulate_are_a_list() -> None:
    options = StartOptions(simulate=(SimulatedPart.CAMERA, SimulatedPart.PERSON))
    assert options.overrides(Part.ARM) == {'simulate': ['camera', 'person']}
    assert command(Part.ARM, options)[-1] == "simulate:=['camera', 'person']"


def test_a_real_arm_takes_the_place_of_the_simulated_cell() -> None:
    options = StartOptions(arm='panda', step=True, world='three_bins')
    assert executable(Part.ARM, options) == ('likeme_arm', 'arm_driver_node')
    assert options.overrides(Part.ARM) == {'world': 'three_bins', 'arm': 'panda', 'step': True}
    assert not options.simulated_clock
    assert executable(Part.PERCEPTION, options) == executable(Part.PERCEPTION)


def test_discovery_is_local_by_default() -> None:
    assert 'ROS_AUTOMATIC_DISCOVERY_RANGE' not in children()[0].environment
    assert children(network=True)[0].environment['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'SUBNET'


def test_all_nodes_of_a_start_are_of_one_run() -> None:
    first, second = ({child.environment['LIKEME_RUN'] for child in children()} for _ in range(2))
    assert len(first) == len(second) == 1
    assert first != second


@pytest.mark.parametrize('part', Part)
def test_every_part_is_a_module_and_an_entry_point(part: Part) -> None:
    package, name = executable(part)
    assert (SOURCES / package / package / f'{name}.py').is_file()
    assert f"'{name} = {package}.{name}:main'" in (SOURCES / package / 'setup.py').read_text()


@pytest.mark.parametrize(
    'arguments',
    [
        ['--only', 'legs'],
        ['--simulate', 'legs'],
        ['--threshold', '1.5'],
        ['--mode', 'x'],
        ['--seed', '-1'],
        ['--step'],
        ['--dry-run'],
        ['--arm', 'panda', '--simulate', 'camera'],
        ['--arm', 'panda', '--seed', '1'],
    ],
)
def test_wrong_usage_is_refused_before_anything_starts(arguments: list[str]) -> None:

    from likeme_bringup.start_cell import start_cell

    app = App()
    app.command()(start_cell)
    assert CliRunner().invoke(app, arguments).exit_code == 2


class Stand:
    """Stand-in for any launch entity: keeps its arguments."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self.args, self.kwargs = args, kwargs


def stand_in(name: str, **members: type) -> types.ModuleType:
    module = types.ModuleType(name)
    vars(module).update(members)
    return module


class Performed(Stand):
    """A substitution; its value is in the context."""

    def perform(self, context: dict[str, str]) -> str:
        return context[self.args[0]]


@pytest.fixture
def launch(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The launch file's names; stand-ins for `launch` and `launch_ros`, not on PyPI."""

    def kind(name: str) -> type:
        return type(name, (Stand,), {})

    actions = ('DeclareLaunchArgument', 'OpaqueFunction', 'SetEnvironmentVariable', 'Shutdown')
    modules = [
        stand_in('launch', LaunchContext=dict, LaunchDescription=kind('LaunchDescription')),
        stand_in('launch.actions', **{name: kind(name) for name in actions}),
        stand_in('launch.events'),
        stand_in('launch.events.process', ProcessExited=kind('ProcessExited')),
        stand_in('launch.substitutions', LaunchConfiguration=Performed),
        stand_in('launch_ros'),
        stand_in('launch_ros.actions', Node=kind('Node')),
        stand_in(
            'launch_ros.substitutions', ExecutableInPackage=Performed, FindPackageShare=Performed
        ),
    ]
    for module in modules:
        monkeypatch.setitem(sys.modules, module.__name__, module)
    names = runpy.run_path(str(PACKAGE / 'launch' / 'cell.launch.py'))
    planned = names['planned']

    def planned_here(command: list[str]) -> Any:
        return planned([sys.executable, '-m', 'likeme_bringup.start_cell', *command[1:]])

    monkeypatch.setitem(names['start'].__globals__, 'planned', planned_here)
    return names


def started(launch: dict[str, Any], **given: str) -> tuple[list[Any], dict[str, str]]:
    """The nodes and the environment that the launch file's arguments lead to."""
    context = {name: default for name, (default, _) in launch['ARGUMENTS'].items()} | given
    programs = {'start_cell': 'start_cell', 'likeme_bringup': str(PACKAGE)}
    entities = launch['start'](context | programs)
    nodes = [each for each in entities if type(each).__name__ == 'Node']
    return nodes, dict(each.args for each in entities if each not in nodes)


def parameters(node: Stand) -> dict[str, Any]:
    """What the parameter files and values of a node say together."""
    merged: dict[str, Any] = {}
    for given in node.kwargs['parameters']:
        merged |= given if isinstance(given, dict) else yaml.safe_load(Path(given).read_text())
    return merged


def test_the_launch_file_imports_launch_and_nothing_that_its_python_may_lack() -> None:
    path = PACKAGE / 'launch' / 'cell.launch.py'
    trees = ast.walk(ast.parse(path.read_text(encoding='utf-8')))
    modules = {
        name.partition('.')[0]
        for node in trees
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in (
            [node.module] if isinstance(node, ast.ImportFrom) else [a.name for a in node.names]
        )
    }
    assert modules - sys.stdlib_module_names == {'launch', 'launch_ros'}


def test_the_launch_file_starts_the_same_nodes(launch: dict[str, Any]) -> None:
    nodes, _ = started(launch)
    assert [(n.kwargs['package'], n.kwargs['executable']) for n in nodes] == [
        executable(p) for p in Part
    ]
    assert all(node.kwargs['remappings'] == [] for node in nodes)
    on_clock = {'/**': {'ros__parameters': {'use_sim_time': True}}}
    assert all(parameters(node) == on_clock for node in nodes)


def test_the_launch_files_arguments_reach_the_nodes(
    launch: dict[str, Any], tmp_path: Path
) -> None:
    mine = tmp_path / 'mine.yaml'
    mine.write_text('inference_node: {ros__parameters: {turn_timeout: 7e1}}\n')
    nodes, environment = started(
        launch, only='inference, arm', mode='trajectory', params_file=str(mine), domain='7',
        network='true', use_sim_time='True', autostart='false', simulate='arm',
    )  # fmt: skip
    # ROS reads 7e1 as a number, PyYAML as a text: it stays as it is written.
    assert '7e1' in Path(nodes[0].kwargs['parameters'][0]).read_text()
    assert 'turn_timeout' in mine.read_text()
    assert parameters(nodes[0]) == {
        '/arm_driver': {'ros__parameters': {'simulate': ['arm']}},
        '/inference_node': {'ros__parameters': {'mode': 'trajectory'}},
        'use_sim_time': True,
        'autostart': False,
    }
    assert environment['ROS_DOMAIN_ID'] == '7'
    assert environment['LIKEME_RUN']
    assert environment['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'SUBNET'
    assert Path(environment['FASTRTPS_DEFAULT_PROFILES_FILE']).is_file()


def test_a_cell_in_a_namespace_has_parameters_and_a_clock_of_its_own(
    launch: dict[str, Any], tmp_path: Path
) -> None:
    mine = tmp_path / 'mine.yaml'
    mine.write_text(
        'arm_driver: {ros__parameters: {seed: 4}}\n/**: {ros__parameters: {seed: 5}}\n'
    )
    nodes, _ = started(launch, namespace='left', params_file=str(mine))
    assert {node.kwargs['namespace'] for node in nodes} == {'left'}
    assert all(node.kwargs['remappings'] == [('/clock', 'clock')] for node in nodes)
    assert set(parameters(nodes[0])) == {'/left/arm_driver', '/**'}


@pytest.mark.parametrize(
    ('given', 'sentence'),
    [
        ({'params_file': '/no/such.yaml'}, "Invalid value for 'params_file': "),
        ({'params_file': 'FILE'}, "inference_node has no parameter 'moed'; mode?"),
        ({'threshold': '2'}, "Invalid value for '--threshold': "),
        ({'world': 'nowhere'}, 'nowhere'),
    ],
)
def test_the_launch_file_refuses_in_one_sentence_what_start_cell_refuses(
    launch: dict[str, Any], tmp_path: Path, given: dict[str, str], sentence: str
) -> None:
    mine = tmp_path / 'mine.yaml'
    mine.write_text('inference_node: {ros__parameters: {moed: direct}}\n')
    with pytest.raises(RuntimeError) as refused:
        started(launch, **{n: str(mine) if v == 'FILE' else v for n, v in given.items()})
    assert sentence in str(refused.value)
    assert '\n' not in str(refused.value)


def exits(node: Stand, *codes: int, shut_down: bool = False) -> list[Any]:
    """What a node's ends lead to: actions, or the sentence of an error."""
    found: list[Any] = []
    for code in codes:
        event, context = SimpleNamespace(returncode=code), SimpleNamespace(is_shutdown=shut_down)
        try:
            found.append(node.kwargs['on_exit'](event, context))
        except RuntimeError as error:
            found.append(str(error))
    return found


def test_the_launch_file_respawns_with_a_limit(launch: dict[str, Any]) -> None:
    (_, arm, perception, _), _ = started(launch)
    assert arm.kwargs['respawn'] is True
    assert arm.kwargs['respawn_delay'] > 0
    row = 'arm was ended by SIGKILL, death 5 in a row within 30 s of a start.'
    assert exits(arm, *[-9] * 5) == [[], [], [], [], row]
    # Once a node has started, a refusal is a death like any other.
    assert exits(perception, -9, REFUSED) == [[], []]
    (arm,), _ = started(launch, respawn='false', only='arm')
    assert arm.kwargs['respawn'] is False
    assert exits(arm, -9) == ['arm was ended by SIGKILL.']


def test_launch_fails_with_a_node_that_fails_and_ends_well_with_one_that_was_told_to(
    launch: dict[str, Any],
) -> None:
    (_, arm, perception, inference), _ = started(launch)
    assert exits(inference, REFUSED) == ['inference ended with exit code 78.']
    ((told,),) = exits(perception, 0)
    assert told.kwargs['reason'] == 'perception ended with exit code 0'
    # Killed after its time to end: no failure of its own.
    assert exits(arm, *[-9] * 9, REFUSED, 0, shut_down=True) == [[]] * 11


def test_the_launch_file_declares_what_start_cell_takes(launch: dict[str, Any]) -> None:
    import inspect

    from likeme_bringup.start_cell import start_cell

    ours = {'namespace', 'params_file', 'use_sim_time', 'autostart'}
    theirs = {'params', 'launch_plan_of'}
    assert (
        set(launch['ARGUMENTS']) - ours == set(inspect.signature(start_cell).parameters) - theirs
    )
    assert len(launch['generate_launch_description']().args[0]) == len(launch['ARGUMENTS']) + 1


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('x: [', 'cannot be read'),
        ('perception_node: {min_height: 1.0}', 'ros__parameters'),
        ('inference: {ros__parameters: {mode: direct}}', "expected one of .* got 'inference'"),
        ('inference_node: {ros__parameters: {threshold: 1.0}}', "'threshold'; help_threshold?"),
        ('/**: {ros__parameters: {moed: direct}}', r"no parameter 'moed'; mode\?"),
    ],
)
def test_an_invalid_parameter_file_is_refused(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text(text)
    with pytest.raises(typer.BadParameter, match=reason):
        parameter_file(path)


def test_a_namespace_and_what_every_node_has_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text(
        '/lab/inference_node: {ros__parameters: {use_sim_time: true, mode: sequential}}\n'
        '/**: {ros__parameters: {seed: 3, qos_overrides./clock.publisher.depth: 1}}\n'
    )
    assert parameter_file(path) == path


def test_all_parameters_of_a_node_are_accepted(tmp_path: Path) -> None:
    """A replay starts its nodes with all parameters of the recorded ones."""
    settings = {
        'perception_node': perception_settings.settings_of(WORLD),
        'inference_node': inference_settings.settings_of(WORLD),
        'arm_driver': {'initial_states': None},
    }
    path = tmp_path / 'recorded.yaml'
    nodes = {node: {'ros__parameters': dict.fromkeys(names)} for node, names in settings.items()}
    path.write_text(yaml.safe_dump(nodes))
    assert parameter_file(path) == path


def test_the_shipped_parameter_file_is_accepted() -> None:
    path = PACKAGE / 'config' / 'cell.yaml'
    assert parameter_file(path) == path.resolve()
