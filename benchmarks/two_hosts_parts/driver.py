"""Acts as the person on the camera's host and prints what the other host reported of each act.

A line of JSON for each act: {object, by, frames, tables, demonstrations: [...], outcomes: [...]}.
An act begins with the object set RIGHT by cell/reset; the person moves it LEFT. With `--story` it
is then put back, and the robot acts by the goal it inferred.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from itertools import cycle, islice
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo

from likeme_core.ros.qos import LATCHED
from likeme_core.ros.time import stamp_ns
from likeme_msgs.msg import Demonstration, Outcome, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

#: s. A message that is lost is sent again later, so the bounds are wide.
TIMEOUT = 120.0
#: s after an act in which it must have been reported; perception waits 1 s for the object to rest.
REPORT_TIMEOUT = 5.0
ACTS = tuple((name, by) for by in ('place', 'push') for name in ('pear', 'lemon', 'chicken'))


class Driver(Node):
    """Client of the simulated person, and listener to what perception and inference publish."""

    def __init__(self) -> None:
        super().__init__('two_hosts')
        self.frames: set[int] = set()
        self.tables: dict[int, TableState] = {}
        self.demonstrations: list[Demonstration] = []
        self.outcomes: list[Outcome] = []
        self._human = self.create_client(ExecuteAction, 'human/execute_action')
        self._reset = self.create_client(ResetCell, 'cell/reset')
        self.create_subscription(
            CameraInfo, 'camera/rgb/camera_info', self._on_frame, qos_profile_sensor_data
        )
        self.create_subscription(TableState, 'table_state', self._on_table, 100)
        self.create_subscription(Demonstration, 'demonstration', self.demonstrations.append, 10)
        self.create_subscription(Outcome, 'outcome', self.outcomes.append, LATCHED)

    def _on_frame(self, message: CameraInfo) -> None:
        self.frames.add(stamp_ns(message.header.stamp))

    def _on_table(self, message: TableState) -> None:
        self.tables[stamp_ns(message.header.stamp)] = message

    def until(self, done: Callable[[], Any], timeout: float = TIMEOUT) -> bool:
        """Spin until done; False after `timeout` s."""
        deadline = time.monotonic() + timeout
        while not done():
            if time.monotonic() > deadline:
                return False
            rclpy.spin_once(self, timeout_sec=0.05)
        return True

    def call(self, client: Any, request: Any) -> None:
        """Call a service of the simulated cell; exit when it is refused."""
        self.until(client.service_is_ready)
        future = client.call_async(request)
        if not self.until(future.done) or not future.result().success:
            raise SystemExit(f'Expected {client.srv_name} to succeed, got {future.result()}.')

    def place(self, name: str, seed: int) -> None:
        """Set one object RIGHT."""
        self.call(self._reset, ResetCell.Request(objects=[name], states=['right'], seed=seed))

    def act(self, name: str, by: str, seed: int, story: bool) -> dict[str, Any]:
        """One act, and what was reported of it."""
        self.place(name, seed)
        self.until(self._rests, REPORT_TIMEOUT)
        self.frames.clear()
        self.tables.clear()
        self.demonstrations.clear()
        self.call(self._human, ExecuteAction.Request(object=name, action=f'{by}_left'))
        self.until(lambda: self.demonstrations, REPORT_TIMEOUT)
        if story and self.demonstrations:
            self.outcomes.clear()
            self.place(name, seed)
            self.until(lambda: self.outcomes)
        self.until(lambda: False, 0.5)
        # The last frame may still be on its way.
        frames = {stamp for stamp in self.frames if stamp <= max(self.tables, default=stamp)}
        return {
            'object': name, 'by': by, 'frames': len(frames),
            'tables': len(frames & self.tables.keys()),
            'demonstrations': [_demonstration(d) for d in self.demonstrations],
            'outcomes': [o.result == Outcome.REACHED for o in self.outcomes] if story else [],
        }  # fmt: skip

    def _rests(self) -> bool:
        return bool(self.tables) and self.tables[max(self.tables)].settled


def _demonstration(seen: Demonstration) -> dict[str, Any]:
    return {
        'object': seen.object, 'x_i': list(seen.x_i_probability),
        'x_f': list(seen.x_f_probability), 'manner': seen.manner, 'p': seen.manner_probability,
    }  # fmt: skip


def main() -> None:
    """Print a line for every act."""
    parser = argparse.ArgumentParser()
    parser.add_argument('--acts', type=int, required=True)
    parser.add_argument('--story', action='store_true')
    given = parser.parse_args()
    rclpy.init()
    driver = Driver()
    try:
        # Perception has learned its background, or cannot.
        driver.until(lambda: len(driver.tables) > 30, 30.0)
        for seed, (name, by) in enumerate(islice(cycle(ACTS), given.acts)):
            print(json.dumps(driver.act(name, by, seed, given.story)), flush=True)
    finally:
        driver.destroy_node()  # type: ignore[no-untyped-call]
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
