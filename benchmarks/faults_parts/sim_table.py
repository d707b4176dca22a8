"""The table in simulated time: camera with perception, and the person who shows and helps."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from std_msgs.msg import Header

from faults_parts.sim_graph import Graph
from faults_parts.sim_node import SimNode, time_msg
from faults_parts.sim_time import EPOCH, SECOND, SIM_TIME
from likeme_core.ros.heartbeat import HeartbeatPublisher
from likeme_core.ros.world import WorldPublisher
from likeme_core.world import World

FRAME_PERIOD = 0.2
#: s for which a hand is over the table when it moves something.
HAND = 0.3


class Table:
    """What is where, seen by a camera, at whose stamps (ROS time, ns) `ros_now` looks.

    Attributes:
        states: region of each object by its name.
        arm_over, hand_over: whether a limb hides the table.
        blocked: names of the actions that are not free.
        jump: ns by which ROS time, of camera and arm, has been set forwards.
        process: of camera and perception.
    """

    def __init__(self, graph: Graph, world: World) -> None:
        self.world, self._graph = world, graph
        self.states = dict.fromkeys(world.objects, 0)
        self.arm_over = self.hand_over = False
        self.blocked: set[str] = set()
        self.jump = 0
        self._due = False
        self.start()

    @property
    def ros_now(self) -> int:
        """ROS time of camera and arm, ns."""
        return EPOCH + SIM_TIME.now + self.jump

    def start(self) -> None:
        """Start camera and perception."""
        with self._graph.process('perception_node') as self.process:
            node = SimNode('perception_node')
            # A type as annotated by rclpy.
            given: Any = node
            WorldPublisher(given, self.world)
            HeartbeatPublisher(given)
            self._tables = node.create_publisher(None, 'table_state', 1)
            self._shown = node.create_publisher(None, 'demonstration', 10)
            node.create_timer(FRAME_PERIOD, self._look)
        self._acts: list[tuple[str, int, int, int, bool]] = []

    def move(self, name: str, region: int, shown: bool = True) -> None:
        """A person moves an object; shown: as one act that perception sees whole."""
        before, begun = self.states[name], self.ros_now
        self.hand_over = True

        def end() -> None:
            self.hand_over = False
            self.states[name] = region
            if before != region and self.process.alive and not self.process.paused:
                self._acts.append((name, before, region, begun, shown))

        self._graph.after(HAND, end)

    def _look(self) -> None:
        stamp, settled = self.ros_now, not (self.arm_over or self.hand_over)
        header = Header(stamp=time_msg(stamp), frame_id='camera')
        share = np.eye(len(self.world.states))
        self._tables.publish(
            SimpleNamespace(
                header=header, world=self.world.label, reference_frame='base_link',
                hand_in_view=self.hand_over, arm_in_view=self.arm_over, settled=settled,
                objects=[
                    SimpleNamespace(
                        name=name, state=state, state_probability=share[state].tolist(),
                        visible=True, settled=settled, last_seen=header.stamp,
                    )
                    for name, state in self.states.items()
                ],
            )
        )  # fmt: skip
        if not settled:
            return
        acts, self._acts = self._acts, []
        for name, x_i, x_f, begun, shown in acts:
            if shown and begun < stamp and self.states[name] == x_f:
                self._shown.publish(self._demonstration(header, name, x_i, x_f, begun))

    def _demonstration(self, header: Header, name: str, x_i: int, x_f: int, begun: int) -> Any:
        share = np.eye(len(self.world.states))
        end = begun + round(HAND * SECOND)
        return SimpleNamespace(
            header=header, world=self.world.label, object=name, x_i=x_i, x_f=x_f,
            x_i_probability=share[x_i].tolist(), x_f_probability=share[x_f].tolist(), manner=0,
            manner_probability=1.0, rise=0.1, start=time_msg(begun), end=time_msg(end),
        )  # fmt: skip
