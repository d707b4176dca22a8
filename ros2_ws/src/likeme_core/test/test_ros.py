"""ROS helpers: parameters, time, diagnostics, and running a node."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import time
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

rclpy = pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus  # noqa: E402
from domain_coordinator import domain_id  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402

from likeme_core.ros import parameters  # noqa: E402
from likeme_core.ros.diagnostics import DiagnosticsPublisher, diagnostics_msg  # noqa: E402
from likeme_core.ros.heartbeat import HEARTBEAT_QOS, HeartbeatPublisher  # noqa: E402
from likeme_core.ros.spin import _check_clock  # noqa: E402
from likeme_core.ros.time import stamp_ns, time_msg  # noqa: E402
from likeme_core.run_memory import RUN_VARIABLE, RunMemory  # noqa: E402
from likeme_core.settings import Setting, defaults  # noqa: E402
from likeme_core.state_folder import state_folder  # noqa: E402
from likeme_msgs.msg import Heartbeat  # noqa: E402

SETTINGS = {
    'threshold': Setting(0.5, 'a probability', (0, 1)),
    'count': Setting(3, 'a number', (1, 10)),
    'area': Setting([], 'x_min x_max, m'),
    'file': Setting('', 'a path', read_only=True),
}


@pytest.fixture
def node() -> Iterator[Node]:
    with domain_id() as domain:
        rclpy.init(domain_id=domain)
        made = rclpy.create_node('test_parameters')
        parameters.declare(made, SETTINGS)
        yield made
        made.destroy_node()
        rclpy.try_shutdown()


def test_parameters_are_declared_with_their_defaults(node: Node) -> None:
    assert parameters.values(node, SETTINGS) == defaults(SETTINGS)
    described = node.describe_parameter('threshold')
    assert described.description == 'a probability'
    assert (
        described.floating_point_range[0].from_value,
        described.floating_point_range[0].to_value,
    ) == (0.0, 1.0)


@pytest.mark.parametrize(
    ('name', 'value', 'accepted'),
    [
        ('threshold', 0.9, True),
        ('threshold', 1.5, False),
        ('count', 10, True),
        ('count', 11, False),
        ('count', 2.5, False),
        ('area', [1, 2], True),
        ('area', [1.0, 2.0], True),
        ('file', 'other', False),
    ],
)
def test_range_type_and_read_only_are_enforced(
    node: Node, name: str, value: object, accepted: bool
) -> None:
    result = node.set_parameters([Parameter(name, value=value)])[0]
    assert result.successful is accepted, result.reason


def test_what_a_restarted_node_refuses_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(RUN_VARIABLE, 'a')
    monkeypatch.setenv('LIKEME_STATE', str(tmp_path))
    with domain_id() as domain:
        memory = RunMemory(lambda: state_folder(domain), 'test_parameters')
        memory.parameters |= {'threshold': 0.9, 'count': 99, 'file': 'read-only', 'gone': 1}
        memory.save()
        rclpy.init(domain_id=domain)
        node = rclpy.create_node('test_parameters')
        parameters.declare(node, SETTINGS)
        after = parameters.values(node, SETTINGS)
        node.destroy_node()
        rclpy.try_shutdown()
    assert after == defaults(SETTINGS) | {'threshold': 0.9}
    told = ''.join(capfd.readouterr())
    assert 'with what was set in it: threshold = 0.9.' in told
    assert 'count is 3: 99, as set in this run, is refused: ' in told


def test_values_after_a_change_leave_the_parameters_alone(node: Node) -> None:
    changes = [Parameter('count', value=7), Parameter('use_sim_time', value=True)]
    after = parameters.values(node, SETTINGS, changes)
    assert after == defaults(SETTINGS) | {'count': 7}
    assert node.get_parameter('count').value == 3


@pytest.mark.parametrize('stamp', [0, 1, 999_999_999, 1_000_000_000, 1_764_000_000_123_456_789])
def test_stamps_and_messages_are_inverse(stamp: int) -> None:
    message = time_msg(stamp)
    assert 0 <= message.nanosec < 1_000_000_000
    assert stamp_ns(message) == stamp


@pytest.mark.parametrize('simulated', [True, False])
def test_simulated_time_without_a_clock_is_reported(
    node: Node, capfd: pytest.CaptureFixture[str], simulated: bool
) -> None:
    node.set_parameters([Parameter('use_sim_time', value=simulated)])
    _check_clock(node)
    told = capfd.readouterr()
    reported = 'use_sim_time is set, and no /clock is heard' in told.out + told.err
    assert reported is simulated


def test_heartbeats_go_on_while_simulated_time_stands_still(node: Node) -> None:
    node.set_parameters([Parameter('use_sim_time', value=True)])
    beats: list[Heartbeat] = []
    node.create_subscription(Heartbeat, 'heartbeat', beats.append, HEARTBEAT_QOS)
    publisher = HeartbeatPublisher(node)
    for _ in range(500):
        rclpy.spin_once(node, timeout_sec=0.1)
        if len(beats) >= 3:
            break
    assert len(beats) >= 3
    assert {stamp_ns(beat.header.stamp) for beat in beats} == {0}
    assert {beat.run for beat in beats} == {publisher.run}


def test_diagnostics_hold_one_status_with_its_values() -> None:
    array = diagnostics_msg('camera', DiagnosticStatus.WARN, 'slow', {'rate': 3.5}, time_msg(5))
    (status,) = array.status
    assert (status.name, status.level, status.message) == ('camera', DiagnosticStatus.WARN, 'slow')
    assert [v.key for v in status.values] == ['rate', 'version']
    assert status.values[0].value == '3.5'
    assert stamp_ns(array.header.stamp) == 5


def test_diagnostics_of_cells_in_namespaces_are_named_apart() -> None:
    sent: list[str] = []
    node = SimpleNamespace(
        get_namespace=lambda: '/left/cell',
        create_publisher=lambda *_: SimpleNamespace(
            publish=lambda array: sent.append(array.status[0].name)
        ),
    )
    status = diagnostics_msg('camera', DiagnosticStatus.OK, 'good', {}, time_msg(5))
    DiagnosticsPublisher(node).publish(status)
    node.get_namespace = lambda: '/'
    status = diagnostics_msg('camera', DiagnosticStatus.OK, 'good', {}, time_msg(5))
    DiagnosticsPublisher(node).publish(status)
    assert sent == ['left/cell/camera', 'camera']


NODE = """
import os, signal, sys
from rclpy.node import Node
from std_msgs.msg import Empty
from likeme_core.ros.spin import run_node


class Busy(Node):
    def __init__(self):
        super().__init__('busy')
        {body}
        self.publisher = self.create_publisher(Empty, 'topic', 1)
        self.timer = self.create_timer(0.001, self.tick)
        self.ticks = 0

    def tick(self):
        self.publisher.publish(Empty())
        self.ticks += 1
        if self.ticks == 5:
            print('running', flush=True)

    def stop(self):
        print('stopped', flush=True)


class AtTheEnd:
    # Collected when the interpreter has put its signal handlers away: a second Ctrl-C then.
    def __del__(self, kill=os.kill, pid=os.getpid(), number=int(signal.SIGINT)):
        kill(pid, number)


at_the_end = AtTheEnd()
sys.exit(run_node('busy', Busy))
"""


def run(body: str = 'pass', *prefix: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*prefix, sys.executable, '-c', NODE.format(body=body)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_and_a_second_one_end_a_publishing_node_without_output(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    with domain_id() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        with run() as process:
            assert process.stdout is not None
            assert process.stdout.readline() == 'running\n'
            process.send_signal(number)
            out, _ = process.communicate(timeout=60)
    assert (process.returncode, out) == (0, 'stopped\n')


def test_a_signal_that_was_blocked_while_modules_were_imported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with domain_id() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        with run('pass', 'env', '--block-signal=INT') as process:
            process.send_signal(signal.SIGINT)
            out, _ = process.communicate(timeout=60)
    # Before `env` has begun it is the signal that ends it.
    assert (process.returncode, out) in ((0, 'stopped\n'), (-signal.SIGINT, ''))


WAITING = """
from rclpy.node import Node
from likeme_core.ros.spin import join_graph, run_node

preload = join_graph
main = lambda: run_node('late', lambda: Node('late'))
"""


@pytest.mark.parametrize('becomes', [True, False])
def test_a_standby_is_known_before_its_node(
    becomes: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / 'waiting_node.py').write_text(WAITING)
    with domain_id() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        rclpy.init(domain_id=domain)
        node = rclpy.create_node('test_standby')
        with subprocess.Popen(
            [sys.executable, '-m', 'likeme_core.standby', 'waiting_node'],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=tmp_path,
        ) as process:  # fmt: skip
            waiting = f'_standby_{process.pid}'

            def others() -> list[str]:
                return [n for n in node.get_node_names() if n in (waiting, 'late')]

            try:
                assert came_true(node, lambda: others() == [waiting]), node.get_node_names()
                if becomes:
                    assert process.stdin is not None
                    process.stdin.write(b'\n')
                    process.stdin.flush()
                    assert came_true(node, lambda: others() == ['late'])
                    process.send_signal(signal.SIGINT)
                out, _ = process.communicate(timeout=60)
                assert came_true(node, lambda: others() == [])
            finally:
                process.kill()
                node.destroy_node()
                rclpy.try_shutdown()
    assert (process.returncode, out) == (0, b'')


def came_true(node: Node, condition: Callable[[], bool], bound: float = 60.0) -> bool:
    deadline = time.monotonic() + bound
    while not condition() and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.01)
    return condition()


def test_bad_parameters_are_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    with domain_id() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        with run("raise ValueError('Expected 1, got 2.')") as process:
            out, _ = process.communicate(timeout=60)
    assert (process.returncode, out) == (os.EX_CONFIG, 'busy does not start: Expected 1, got 2.\n')


def test_a_node_with_parameters_is_not_kept_alive(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(RUN_VARIABLE, 'a')
    with domain_id() as domain:
        rclpy.init(domain_id=domain)
        node = rclpy.create_node('test_parameters')
        parameters.declare(node, SETTINGS)
        gone = weakref.ref(node)
        node.destroy_node()
        del node
        gc.collect()
        rclpy.try_shutdown()
    assert gone() is None
