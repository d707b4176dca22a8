"""Node of `view --live`: receives what the viewer shows."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.qos import QoSProfile

from likeme_bags.camera_topics import COLOUR, DEPTH, INFO
from likeme_bags.values import Record
from likeme_core.ros.message_types import message_class
from likeme_core.ros.qos import CAMERA, LATCHED, kept
from likeme_core.world.values import label_of
from likeme_msgs.msg import World
from likeme_replay.ros.waiting_node import WaitingNode
from likeme_replay.viewer.message_scene import TOPICS, WORLD

#: Latched topics, with how many messages a late subscriber needs: tf_static has one publisher for
#: the arm and one for the camera.
_LATCHED = {'robot_description': 1, 'tf_static': 20} | dict.fromkeys(
    ('goal_belief', 'joint_goal_belief', 'decision', 'outcome'), 1
)
_BEST_EFFORT = (COLOUR, DEPTH, INFO, 'joint_states')
_DEPTH = 10


class ViewNode(WaitingNode):
    """Passes messages on as they are received.

    Subscribes: world; after `follow`, message_scene.TOPICS.

    Attributes:
        world_label: of the cell's world, see World.label; '' before it was heard.
        count: messages passed on.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__('viewer', **options)
        self.world_label = ''
        self.count = 0
        self.create_subscription(World, WORLD, self._on_world, LATCHED)

    def follow(self, hear: Callable[[Record], None]) -> None:
        """Pass every message to `hear` from now on."""
        for topic, kind in TOPICS.items():
            receive = partial(self._receive, hear, topic, kind)
            self.create_subscription(
                message_class(kind), topic, receive, _profile(topic), raw=True
            )

    def _receive(self, hear: Callable[[Record], None], topic: str, kind: str, data: bytes) -> None:
        self.count += 1
        hear(Record(topic, kind, 0, data))

    def _on_world(self, world: World) -> None:
        self.world_label = label_of(world.name, world.digest)


def _profile(topic: str) -> QoSProfile:
    if topic in _BEST_EFFORT:
        return CAMERA
    return kept(_LATCHED[topic]) if topic in _LATCHED else QoSProfile(depth=_DEPTH)
