"""Stand-in robot, driver and hold keeper as processes on a ROS domain of their own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
import yaml
from domain_coordinator import domain_id
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from likeme_arm.real_arm.arm_config import CONFIGS, ArmConfig, load_arm_config
from likeme_core.heartbeats import HOLD_TIMEOUT
from likeme_core.paper_world import WORLD
from likeme_core.processes import die_with_parent
from likeme_core.ros.qos import LATCHED
from likeme_core.world import World, load_world
from likeme_core.yaml_files import read_yaml
from likeme_msgs.action import ExecuteAction as ExecuteActionAction
from likeme_msgs.msg import HoldState, TableState
from likeme_msgs.srv import ExecuteAction

MODULES = (
    'likeme_arm_sim.robot_stand_in_node', 'likeme_arm.hold_keeper_node',
    'likeme_arm.arm_driver_node',
)  # fmt: skip
#: s for processes to start, and to end.
START, GRACE = 90.0, 30.0
#: Distance of each joint from home at which the arm is there, rad.
AT_HOME = 0.05
#: s for the driver to hear of a hold on a loaded machine.
HEARD = 0.8
#: s for an arm to get home after a resume, and how often that is tried: a fault may meet it there.
HOME, HOME_TRIES = 8.0, 5


class LiveArm:
    """The processes, and a node of this one to talk to them.

    Attributes:
        report: the stand-in's last, see RobotStandInNode.
        table: the last table state.
        joints: time (s, monotonic) and positions of each joint_states since `forget`.
        next_motion: what waits to be allowed in step mode; empty: nothing.
        held: whether the keeper holds.
    """

    def __init__(
        self, folder: Path, domain: int, context: Any, config: ArmConfig, world: World
    ) -> None:
        self._folder, self._domain, self._config, self.world = folder, domain, config, world
        self.node = Node('arm_trials', context=context, start_parameter_services=False)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._processes: list[subprocess.Popen[bytes]] = []
        self.report: dict[str, Any] = {}
        self.table: TableState | None = None
        self.joints: list[tuple[float, np.ndarray]] = []
        self.next_motion, self.held = '', True
        node = self.node
        node.create_subscription(String, 'stand_in/report', self._on_report, 1)
        node.create_subscription(TableState, 'table_state', self._on_table, 1)
        node.create_subscription(JointState, 'joint_states', self._on_joints, 100)
        node.create_subscription(String, 'arm/next_motion', self._on_next, LATCHED)
        node.create_subscription(HoldState, 'cell/hold_state', self._on_hold, LATCHED)
        self._control_pub = node.create_publisher(String, 'stand_in/control', 10)
        self._stop_pub = node.create_publisher(String, 'cell/stop', 10)
        self._act = node.create_client(ExecuteAction, 'arm/execute_action')
        self._allow = node.create_client(SetBool, 'arm/allow_motion')
        self._resume = node.create_client(Trigger, 'cell/resume')
        self.action = ActionClient(node, ExecuteActionAction, 'arm/execute_action')

    def start(self, parameters: Mapping[str, Any], arm: str, world: str) -> None:
        """Start the processes and wait until they can act."""
        for module in MODULES:
            own = dict(parameters) if module.endswith('arm_driver_node') else {}
            if 'keeper' not in module:
                own |= {'arm': arm, 'world': world}
            words = [w for k, v in own.items() for w in ('-p', f'{k}:={json.dumps(v)}')]
            self._run(module, ['--ros-args', *words] if words else [])
        self.until(
            lambda: self.table is not None and self.report and self._act.service_is_ready()
            and self._control_pub.get_subscription_count() and self.action.server_is_ready()
            and self._stop_pub.get_subscription_count() >= 2,
            START, 'the processes',
        )  # fmt: skip

    def control(self, **told: Any) -> None:
        """Tell the stand-in."""
        self._control_pub.publish(String(data=json.dumps(told)))

    def act(self, name: str, action: str) -> Any:
        """Ask for an action; the future of its answer."""
        return self._act.call_async(ExecuteAction.Request(object=name, action=action))

    def allow(self, allowed: bool) -> Any:
        """Answer in step mode; the future of the answer."""
        return self._allow.call_async(SetBool.Request(data=allowed))

    def stop(self) -> None:
        """Stop the cell as stop.sh does."""
        self._stop_pub.publish(String(data='trial'))

    def resume(self) -> None:
        """Allow motion again."""
        future = self._resume.call_async(Trigger.Request())
        self.until(future.done, GRACE, 'a resume')
        self.until(lambda: not self.held, GRACE, 'motion to be allowed')

    def go_home(self) -> None:
        """Hold and resume, after which the arm leaves the table, until it is at home."""
        for attempt in range(HOME_TRIES):
            deadline = time.monotonic() + (HOME if attempt else HEARD)
            while not self._at_home and time.monotonic() < deadline:
                self.during(0.2)
            if self._at_home:
                return
            self.stop()
            self.until(lambda: self.held, GRACE, 'a hold')
            # A driver that has not heard of the hold takes the resume for an older one.
            self.during(HEARD)
            self.resume()
        raise TimeoutError(f'Expected the arm at home after {HOME_TRIES} resumes.\n{self.said()}')

    @property
    def _at_home(self) -> bool:
        last = [joints for _, joints in self.joints[-20:]]
        return len(last) > 1 and bool(np.abs(np.array(last) - self._config.home).max() < AT_HOME)

    def until(self, condition: Callable[[], Any], timeout: float, what: str) -> Any:
        """Spin until a condition holds; its value."""
        deadline = time.monotonic() + timeout
        while not (value := condition()):
            if time.monotonic() > deadline:
                raise TimeoutError(f'Expected {what} within {timeout:g} s.\n{self.said()}')
            self._executor.spin_once(timeout_sec=0.05)
        return value

    def during(self, seconds: float) -> None:
        """Spin for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.02)

    def said(self) -> str:
        """The ends of all that the processes printed."""
        return '\n'.join(p.read_text('utf-8', 'replace')[-2000:] for p in self._logs())

    def close(self) -> None:
        """End the processes and the node."""
        for process in reversed(self._processes):
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            try:
                process.wait(GRACE)
            except subprocess.TimeoutExpired:
                process.kill()
        self._executor.shutdown()
        self.node.destroy_node()

    def _logs(self) -> list[Path]:
        return sorted(self._folder.glob('*.log'))

    def _run(self, module: str, words: list[str]) -> None:
        env = os.environ | {
            'ROS_DOMAIN_ID': str(self._domain), 'LIKEME_STATE': str(self._folder / 'state'),
            'PYTHONUNBUFFERED': '1',
        }  # fmt: skip
        with (self._folder / f'{module}.log').open('wb') as log:
            self._processes.append(
                subprocess.Popen(
                    [sys.executable, '-m', module, *words], env=env, stdin=subprocess.DEVNULL,
                    stdout=log, stderr=subprocess.STDOUT, start_new_session=True,
                    preexec_fn=die_with_parent(os.getpid()),
                )
            )  # fmt: skip

    def _on_report(self, message: String) -> None:
        self.report = json.loads(message.data)

    def _on_table(self, message: TableState) -> None:
        self.table = message

    def _on_joints(self, message: JointState) -> None:
        self.joints.append((time.monotonic(), np.array(message.position[:-1])))

    def _on_next(self, message: String) -> None:
        self.next_motion = message.data

    def _on_hold(self, message: HoldState) -> None:
        self.held = message.held


def changed_config(folder: Path, arm: str, patience: float, haste: float) -> str:
    """A shipped configuration with longer time-outs and a faster arm; the file."""
    given = read_yaml(CONFIGS / f'{arm}.yaml')
    for name in ('state_timeout', 'lag', 'goal_time'):
        given['tolerances'][name] *= patience
    for name, values in given['limits'].items():
        given['limits'][name] = [haste * value for value in values]
    given['speed'] *= haste
    gripper = given['gripper']
    if gripper['kind'] == 'gripper_command' and find_spec('control_msgs') is None:
        gripper |= {'kind': 'commands', 'name': 'gripper_controller/commands'}
    path = folder / 'changed.yaml'
    path.write_text(yaml.safe_dump(given), encoding='utf-8')
    return str(path)


@contextmanager
def live_arm(
    patience: float = 1.0,
    haste: float = 1.0,
    arm: str = 'panda',
    world: str = WORLD.name,
    **parameters: Any,
) -> Iterator[LiveArm]:
    """The processes, ended at the end.

    Args:
        patience: factor on the times after which a motion is given up: on a loaded machine a
            process may have to wait for longer.
        haste: factor on the arm's speeds.
        arm: name of a shipped configuration. Without control_msgs its gripper is one with a topic.
        world: name or file of a world.
        parameters: of the driver.
    """
    stack = ExitStack()
    # Closed without the exception of a failed trial, which domain_id does not pass on.
    try:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix='likeme_arm_')))
        config = changed_config(folder, arm, patience, haste)
        domain = stack.enter_context(domain_id())
        context = rclpy.Context()
        context.init(domain_id=domain)
        stack.callback(context.try_shutdown)
        live = LiveArm(folder, domain, context, load_arm_config(config), load_world(world))
        stack.callback(live.close)
        times = {'hold_timeout': HOLD_TIMEOUT * patience}
        live.start({'controller_interface': 'topic'} | times | parameters, config, world)
        yield live
    finally:
        stack.close()
