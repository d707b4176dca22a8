"""Starts the cell's nodes in the foreground, under the supervisor."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple
from uuid import uuid4

import typer

import likeme_core.program
import likeme_core.standby
from likeme_arm_sim.simulated_parts import ALL_PARTS, SimulatedPart
from likeme_bringup.child import Child
from likeme_bringup.doctor_checks import buffer_findings
from likeme_bringup.launch_plan import PlannedNode, launch_plan
from likeme_bringup.parameter_files import last_value, validated
from likeme_bringup.respawn import Respawn
from likeme_bringup.supervisor import Supervisor
from likeme_core.cli import MAX_SEED, Domain, OptionalWorld
from likeme_core.instance_lock import AlreadyRunningError, claim
from likeme_core.run_memory import RUN_VARIABLE
from likeme_core.tabletop import Mode
from likeme_core.typer_app import App


class Part(StrEnum):
    """The processes of the cell: who allows motion, then in the order in which data flows."""

    HOLD = 'hold'
    ARM = 'arm'
    PERCEPTION = 'perception'
    INFERENCE = 'inference'


MODULES = {
    Part.HOLD: 'likeme_arm.hold_keeper_node',
    Part.ARM: 'likeme_arm_sim.arm_driver_node',
    Part.PERCEPTION: 'likeme_perception.perception_node',
    Part.INFERENCE: 'likeme_inference.inference_node',
}
#: What takes the place of the simulated arm with `--arm`.
REAL_ARM = 'likeme_arm.arm_driver_node'
NODES = {
    Part.HOLD: 'hold_keeper',
    Part.ARM: 'arm_driver',
    Part.PERCEPTION: 'perception_node',
    Part.INFERENCE: 'inference_node',
}
PROGRAM, STANDBY = likeme_core.program.__name__, likeme_core.standby.__name__


class StartOptions(NamedTuple):
    """Options of a start; None leaves the node's default or the parameter file's value.

    world: see World.source. arm: configuration of a real arm, whose driver then takes the place of
    the simulated cell. dry_run, step: of that driver.
    """

    simulate: tuple[SimulatedPart, ...] | None = None
    mode: Mode | None = None
    threshold: float | None = None
    actions: int | None = None
    seed: int | None = None
    real_time_factor: float | None = None
    model: Path | None = None
    experience: str | None = None
    parameter_files: tuple[Path, ...] = ()
    world: str | None = None
    arm: str | None = None
    dry_run: bool = False
    step: bool = False

    def module(self, part: Part) -> str:
        """The module of a part's node."""
        return REAL_ARM if part is Part.ARM and self.arm is not None else MODULES[part]

    @property
    def simulated_clock(self) -> bool:
        """Whether the arm driver publishes /clock: every part is simulated."""
        if self.arm is not None:
            return False
        told = partial(last_value, self.parameter_files, 'arm_driver')
        parts = self.simulate or told('simulate') or ALL_PARTS
        return {*parts} == ALL_PARTS and told('publish_clock') is not False

    def overrides(self, part: Part) -> dict[str, object]:
        """ROS parameters of one node that override the files."""
        if part is Part.HOLD:
            return {}
        simulated: dict[str, object | None] = {
            'simulate': [part.value for part in self.simulate] if self.simulate else None,
            'seed': self.seed,
            'real_time_factor': self.real_time_factor,
        }
        real: dict[str, object | None] = {
            'arm': self.arm, 'dry_run': self.dry_run or None, 'step': self.step or None,
        }  # fmt: skip
        values: dict[Part, dict[str, object | None]] = {
            Part.ARM: simulated if self.arm is None else real,
            Part.PERCEPTION: {},
            Part.INFERENCE: {
                'mode': self.mode.value if self.mode else None,
                'help_threshold': self.threshold,
                'action_budget': self.actions,
                'model_file': str(self.model) if self.model else None,
                'experience_store': self.experience,
            },
        }
        given = {'world': self.world} | values[part]
        return {name: value for name, value in given.items() if value is not None}


DEFAULTS = StartOptions()


def executable(part: Part, options: StartOptions = DEFAULTS) -> tuple[str, str]:
    """Package and executable of a part, as for `ros2 run`."""
    package, _, module = options.module(part).partition('.')
    return package, module


def children(
    parts: tuple[Part, ...] = tuple(Part), options: StartOptions = DEFAULTS, network: bool = False
) -> list[Child]:
    """The processes to start, with their ROS arguments."""
    environment = {RUN_VARIABLE: uuid4().hex}
    if network:
        environment['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET'
    return [
        Child(
            part.value, command(part, options), environment, command(part, options, standby=True)
        )
        for part in parts
    ]


def command(part: Part, options: StartOptions, standby: bool = False) -> list[str]:
    """The command line of one node; `python -m` also serves a tree that is not installed.

    standby: of the process that waits to become the node; it is killed, not interrupted.
    """
    interpreter = [sys.executable, '-m']
    # Blocked until the program can take a signal.
    program = ['env', '--block-signal=INT', *interpreter, PROGRAM, NODES[part]]
    runner = [*interpreter, STANDBY] if standby else program
    arguments = [*runner, options.module(part), '--ros-args']
    if options.simulated_clock:
        # Before the files, which may say otherwise.
        arguments += ['-p', 'use_sim_time:=true']
    for path in options.parameter_files:
        arguments += ['--params-file', str(path)]
    for name, value in options.overrides(part).items():
        arguments += ['-p', f'{name}:={value}']
    return arguments


def plan(parts: Sequence[Part], options: StartOptions, namespace: str) -> str:
    """See likeme_bringup.launch_plan."""
    nodes = [
        PlannedNode(part.value, NODES[part], *executable(part, options), options.overrides(part))
        for part in parts
    ]
    return launch_plan(nodes, options.parameter_files, namespace, options.simulated_clock)


def parameter_file(path: Path) -> Path:
    """The absolute path of a valid ROS parameter file.

    Raises:
        typer.BadParameter: see `parameter_files.validated`.
    """
    try:
        return validated(path)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint='--params') from None


def check_arm(options: StartOptions) -> None:
    """Refuse options of the simulated cell with a real arm, and the other way round.

    Raises:
        typer.BadParameter: expected and got.
    """
    if options.arm is None:
        if options.dry_run or options.step:
            raise typer.BadParameter(
                'Expected --arm CONFIG with it, got none.',
                param_hint='--dry-run' if options.dry_run else '--step',
            )
        return
    for name, value in (
        ('--simulate', options.simulate), ('--seed', options.seed),
        ('--real-time-factor', options.real_time_factor),
    ):  # fmt: skip
        if value is not None:
            raise typer.BadParameter(
                'Expected none of it with --arm: nothing is simulated.', param_hint=name
            )


def start_cell(
    only: Annotated[
        list[Part] | None, typer.Option(help='Start this part alone; may be repeated.')
    ] = None,
    simulate: Annotated[
        list[SimulatedPart] | None,
        typer.Option(help='Simulate this part alone, the others are real; may be repeated.'),
    ] = None,
    network: Annotated[
        bool,
        typer.Option('--network', help='Let nodes on other machines of the subnet take part.'),
    ] = False,
    mode: Annotated[Mode | None, typer.Option(help='How the robot imitates.')] = None,
    threshold: Annotated[
        float | None,
        typer.Option(min=0.0, max=1.0, help='Ask for help below this predicted success.'),
    ] = None,
    actions: Annotated[
        int | None, typer.Option(min=1, max=100, help='Budget of the sequential mode.')
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=MAX_SEED, help='Seed of the simulated cell.')
    ] = None,
    real_time_factor: Annotated[
        float | None, typer.Option(min=0.0, help='1: real time; 0: as fast as possible.')
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(exists=True, dir_okay=False, help='Transition model file of the robot.'),
    ] = None,
    experience: Annotated[
        str | None,
        typer.Option(help='SQLite file or database URL: executed imitations improve the model.'),
    ] = None,
    params: Annotated[
        list[Path] | None,
        typer.Option(
            exists=True, dir_okay=False, help='ROS parameter file; config/cell.yaml has all names.'
        ),
    ] = None,
    world: OptionalWorld = None,
    arm: Annotated[
        str | None,
        typer.Option(
            help='Drive a real arm: a shipped configuration or a file, not the simulator.'
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option('--dry-run', help='With --arm: plan and show motions, move nothing.')
    ] = False,
    step: Annotated[
        bool, typer.Option('--step', help='With --arm: ask before each motion (allow.sh).')
    ] = False,
    respawn: Annotated[
        bool,
        typer.Option(
            ' /--no-respawn', help='End the cell when a node dies, instead of starting it again.'
        ),
    ] = True,
    domain: Domain = 0,
    launch_plan_of: Annotated[
        str | None,
        typer.Option(
            '--launch-plan',
            hidden=True,
            metavar='NAMESPACE',
            help='Start nothing, print what the launch file is to start in a namespace.',
        ),
    ] = None,
) -> None:
    """Start hold keeper, arm driver, perception and inference; Ctrl-C ends them all."""
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    parts = tuple(part for part in Part if not only or part in only)
    options = StartOptions(
        tuple(simulate) if simulate else None,
        mode,
        threshold,
        actions,
        seed,
        real_time_factor,
        model.resolve() if model else None,
        experience,
        tuple(parameter_file(path) for path in params or ()),
        None if world is None else world.source,
        arm if arm is None or not Path(arm).is_file() else str(Path(arm).resolve()),
        dry_run,
        step,
    )
    check_arm(options)
    if launch_plan_of is not None:
        print(plan(parts, options, launch_plan_of))
        return
    supervisor = Supervisor(
        children(parts, options, network), respawn=Respawn() if respawn else None
    )
    reach = 'the subnet' if network else 'this host only'
    names = ', '.join(part.value for part in parts)
    try:
        with claim(domain, parts):
            supervisor.log(f'{names} on ROS domain {domain}, {reach}; Ctrl-C ends them.')
            for finding in buffer_findings(os.environ) if network else ():
                if finding.cure:
                    supervisor.log(f'{finding.sentence} {finding.cure}')
            code = supervisor.run()
    except AlreadyRunningError as error:
        print(error, file=sys.stderr)
        raise typer.Exit(1) from None
    raise typer.Exit(code)


def main() -> None:
    """Entry point of `start_cell`."""
    app = App(add_completion=False, rich_markup_mode=None)
    app.command()(start_cell)
    app()


if __name__ == '__main__':
    main()
