"""From the key on the operator's screen to the arm's last motion command, all cores busy.

    ./scripts/bench.sh hold [--n N] [--json]

Starts a hold keeper, the simulated arm's driver and `operator.sh` in a pseudo-terminal of 80x24 on
a ROS domain of its own, and a process on each core that never rests. N times (default 1000) the
arm is under way when SPACE is pressed. Measured from the write of the key until this process has
received the driver's report that the motion ended as HELD: the last motion command came before it.
Whether a joint moves on after that is seen in joint_states.
"""

from __future__ import annotations

import os
import pty
import select
import struct
import sys
import tempfile
import termios
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from fcntl import ioctl
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rclpy
from domain_coordinator import domain_id
from geometry_msgs.msg import Point
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from likeme_core.processes import interrupt, start
from likeme_core.progress_bar import counted
from likeme_core.ros.qos import LATCHED, kept
from likeme_core.ros.time import stamp_ns
from likeme_msgs.msg import HoldState, Motion, ObjectState, TableState
from likeme_msgs.srv import ExecuteAction
from report import Bar, option_parser, publish, whole_number

sys.path.append(str(Path(__file__).resolve().parents[1] / 'tools'))
from busy_cores import busy_cores

#: s from the key to the end of the motion, the 99th percentile.
BAR = 0.1
#: s within which anything has to happen, or the benchmark gives up.
PATIENCE = 120.0
#: s of the driver's clock after the end of a motion in which the arm brakes; joint_states that are
#: looked at then.
BRAKE, LOOKS = 0.1, 10
#: Joints of the arm; those of the fingers come after them, and settle on what they hold.
JOINTS = 7
#: Moves of a joint that are none, rad.
STILL = 2e-3
NODES = ('likeme_arm.hold_keeper_node', 'likeme_arm_sim.arm_driver_node')
#: Where the chicken is said to be: the arm goes there.
CHICKEN = Point(x=0.44, y=-0.2, z=0.03)


class Press(NamedTuple):
    """One press.

    Attributes:
        keeper: s until the keeper was heard to hold.
        delay: s until the motion was heard to have ended.
        moved: how far a joint of the arm moved later than BRAKE after that, rad.
    """

    keeper: float
    delay: float
    moved: float


class Observer(Node):
    """Asks the arm for motions, and hears how they end."""

    def __init__(self) -> None:
        super().__init__('hold_benchmark')
        self.ended: dict[str, tuple[Motion, float]] = {}
        self.held_at, self.late_holds = 0.0, 0
        self.poses: deque[tuple[int, np.ndarray]] = deque(maxlen=300)
        self.begun: set[str] = set()
        self.held = True
        self.joints: np.ndarray = np.zeros(0)
        self._clock = Clock().clock
        self._arm = self.create_client(ExecuteAction, 'arm/execute_action')
        self._resume = self.create_client(Trigger, 'cell/resume')
        self._tables = self.create_publisher(TableState, 'table_state', 1)
        self.create_subscription(Clock, '/clock', self._on_clock, 10)
        self.create_subscription(Motion, 'motion', self._on_motion, kept(100))
        self.create_subscription(JointState, 'joint_states', self._on_joints, 10)
        self.create_subscription(HoldState, 'cell/hold_state', self._on_hold, LATCHED)

    def begin_moving(self, request_id: str) -> str:
        """Begin a motion, again if it is refused, until the arm moves; the id of its request.

        The screen's own hold may come after the resume, on a busy host: it is resumed, too.
        """
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            if self.held:
                self.late_holds += 1
                self.resume()
            request = self.begin(request_id)
            resting = self.joints
            moves = lambda: np.abs(self.joints - resting).max() > STILL  # noqa: B023, E731
            until(lambda: moves() or request in self.ended, 'a moving arm')  # noqa: B023
            if request not in self.ended:
                return request
            request_id += 'x'
        raise TimeoutError(f'Expected a moving arm within {PATIENCE:g} s, got none.')

    def begin(self, request_id: str) -> str:
        """Ask the arm, again while it still leaves the table, until a motion is under way."""
        request = ExecuteAction.Request(object='chicken', action='push_left')
        tries = 0

        def begins() -> bool:
            nonlocal tries
            tries += 1
            request.id = f'{request_id}_{tries}'
            answer = self._arm.call_async(request)
            until(lambda: answer.done() or request.id in self.begun, 'an answer')
            return request.id in self.begun

        until(begins, 'a motion')
        return str(request.id)

    def resume(self) -> None:
        """Allow motion again."""
        answer = self._resume.call_async(Trigger.Request())
        until(answer.done, 'an answer of cell/resume')
        until(lambda: not self.held, 'a resume')

    @property
    def ready(self) -> bool:
        """Whether driver and keeper are there."""
        services = self._arm.service_is_ready() and self._resume.service_is_ready()
        return bool(services and self.joints.size and not self.held)

    def _on_clock(self, message: Clock) -> None:
        self._clock = message.clock

    def _on_motion(self, message: Motion) -> None:
        if message.state == Motion.ENDED:
            self.ended[message.id] = message, time.monotonic()
        else:
            self.begun.add(message.id)

    def _on_joints(self, message: JointState) -> None:
        self.joints = np.asarray(message.position)
        self.poses.append((stamp_ns(message.header.stamp), self.joints))
        chicken = ObjectState(name='chicken', state=1, centroid=CHICKEN, last_seen=self._clock)
        table = TableState(reference_frame='base_link', objects=[chicken], settled=True)
        table.header.stamp, table.header.frame_id = self._clock, 'base_link'
        self._tables.publish(table)

    def _on_hold(self, message: HoldState) -> None:
        if message.held and not self.held:
            self.held_at = time.monotonic()
        self.held = message.held


def until(condition: Callable[[], Any], what: str) -> None:
    """Wait for what the other thread hears."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f'Expected {what} within {PATIENCE:g} s, got none.')
        time.sleep(0.002)


@contextmanager
def screen(usual: list[str]) -> Iterator[tuple[int, list[bytes]]]:
    """The operator's screen in a pseudo-terminal: where keys are written, and what it shows.

    usual: words before its command.
    """
    master, slave = pty.openpty()
    ioctl(slave, termios.TIOCSWINSZ, struct.pack('HHHH', 24, 80, 0, 0))
    command = [*usual, sys.executable, '-m', 'likeme_operator', '--by', 'benchmark']
    process = start(command, slave, {'TERM': 'xterm-256color'}, stdin=slave)
    os.close(slave)
    shown, ends = [b''], threading.Event()

    def read() -> None:
        while not ends.is_set():
            if select.select([master], [], [], 0.1)[0]:
                try:
                    shown[0] = (shown[0] + os.read(master, 65536))[-200_000:]
                except OSError:
                    return

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    try:
        yield master, shown
    finally:
        interrupt(process, 10.0)
        ends.set()
        reader.join()
        os.close(master)


def press(observer: Observer, keys: int, name: str, rng: np.random.Generator) -> Press:
    """Hold a motion that is under way, see that it rests, and resume."""
    request = observer.begin_moving(name)
    time.sleep(rng.uniform(0.0, 0.8))
    pressed = time.monotonic()
    os.write(keys, b' ')
    until(lambda: request in observer.ended, 'the end of the motion')
    motion, ended = observer.ended[request]
    if motion.outcome != ExecuteAction.Request.HELD:
        raise RuntimeError(f'Expected HELD, got outcome {motion.outcome}.')
    until(lambda: observer.held, 'a hold of the keeper')
    # By the driver's clock, as messages come late on a busy host.
    rests = stamp_ns(motion.finished) + round(BRAKE * 1e9)
    later = lambda: [joints for stamp, joints in list(observer.poses) if stamp > rests]  # noqa: E731
    until(lambda: len(later()) >= LOOKS, 'joint_states after the end')
    moved = float(np.ptp(later(), axis=0)[:JOINTS].max())
    observer.resume()
    return Press(observer.held_at - pressed, ended - pressed, moved)


def presses(count: int) -> tuple[list[Press], int]:
    """Start everything and press the key; also how often a hold came after the resume."""
    rng, found, usual = np.random.default_rng(0), [], []
    with suppress(OSError):
        # What this process hears is not to wait for a core; all others have the usual priority.
        os.setpriority(os.PRIO_PROCESS, 0, -10)
        usual = ['nice', '-n', '10']
    with ExitStack() as stack:
        out = stack.enter_context(tempfile.TemporaryFile())
        for module in NODES:
            node = start([*usual, sys.executable, '-m', module], out)
            stack.callback(interrupt, node, 10.0)
        rclpy.init()
        stack.callback(rclpy.try_shutdown)
        observer = Observer()
        executor = SingleThreadedExecutor()
        executor.add_node(observer)
        stack.callback(executor.shutdown)
        threading.Thread(target=executor.spin, daemon=True).start()
        until(lambda: observer.ready, 'a driver that may move')
        keys, shown = stack.enter_context(screen(usual))
        until(lambda: b'MOTION' in shown[0] and b'ALLOWED' in shown[0], 'the screen')
        stack.enter_context(busy_cores(48 * 3600.0, niceness=10 if usual else 0))
        for number in counted(range(count), 'presses', count):
            found.append(press(observer, keys, f'press_{number}_{os.getpid()}', rng))
    return found, observer.late_holds


def main() -> None:
    """Press, and publish."""
    parser = option_parser('hold', description=__doc__)
    parser.add_argument('--n', type=whole_number, default=1000, help='presses of the key')
    count = parser.parse_args().n
    if not count:
        parser.error(f'argument --n: expected 1 or more, got {count}')
    with domain_id() as domain, tempfile.TemporaryDirectory() as state:
        os.environ |= {'ROS_DOMAIN_ID': str(domain), 'LIKEME_STATE': state}
        found, late = presses(count)
    delays = np.array([each.delay for each in found]) * 1e3
    keeper = np.array([each.keeper for each in found]) * 1e3
    peer = 'requirement'
    bars = [
        Bar('key to the end of the motion, p50', float(np.median(delays)), None, 'ms', n=count),
        Bar(
            'key to the end of the motion, p99', float(np.percentile(delays, 99)), BAR * 1e3, 'ms',
            peer, count,
        ),
        Bar('key to the end of the motion, longest', float(delays.max()), None, 'ms', n=count),
        Bar('key to the keeper hold, p50', float(np.median(keeper)), None, 'ms', n=count),
        Bar('key to the keeper hold, p99', float(np.percentile(keeper, 99)), None, 'ms', n=count),
        Bar(
            'presses after which a joint moved on', sum(each.moved > STILL for each in found), 0.0,
            '', peer, count,
        ),
    ]  # fmt: skip
    notes = {
        'busy processes': len(os.sched_getaffinity(0)),
        'holds that came after the resume': late,
    }
    publish('hold', bars, notes)


if __name__ == '__main__':
    main()
