"""The messages of a cell, recorded or live, as a scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import cv2

from likeme_bags.camera_topics import CAMERA_INFO, COLOUR, DEPTH, INFO
from likeme_bags.images import IMAGE
from likeme_bags.values import Record
from likeme_core.stamps import stamp_ns
from likeme_core.world import World
from likeme_core.world.values import label_of
from likeme_inference.joint_belief import marginals_by_object
from likeme_perception.frame_reader import colour_of, depth_of, intrinsics_of
from likeme_replay import decision_log
from likeme_replay.decision_log import LogEvent, entry_of_message
from likeme_replay.message_definitions import definitions
from likeme_replay.viewer.scene import Scene
from likeme_replay.viewer.seen_table import of_message

TABLE_STATE, WORLD, JOINT_BELIEF = 'table_state', 'world', 'joint_goal_belief'
#: Topics that are shown, with their types.
TOPICS: Mapping[str, str] = {
    COLOUR: IMAGE, DEPTH: IMAGE, INFO: CAMERA_INFO,
    TABLE_STATE: 'likeme_msgs/msg/TableState', WORLD: 'likeme_msgs/msg/World',
    JOINT_BELIEF: 'likeme_msgs/msg/JointGoalBelief',
    'robot_description': 'std_msgs/msg/String', 'joint_states': 'sensor_msgs/msg/JointState',
    'tf_static': 'tf2_msgs/msg/TFMessage',
    **{topic: kind for topic, (_, kind) in decision_log.TOPICS.items()},
}  # fmt: skip


class MessageScene:
    """Shows records of TOPICS.

    Attributes:
        shown: messages shown.
        unreadable: messages that do not fit their type, or show nothing that can be drawn.
        other_world: sentence on messages of another world, whose numbers mean something else.
    """

    def __init__(self, scene: Scene, world: World) -> None:
        self.shown = self.unreadable = 0
        self.other_world = ''
        self._scene, self._world = scene, world
        self._roots: dict[str, Any] = {}
        self._receivers: dict[str, Callable[[Any], None]] = {
            COLOUR: self._on_colour, DEPTH: self._on_depth, INFO: self._on_info,
            TABLE_STATE: self._on_table, WORLD: self._on_world,
            JOINT_BELIEF: self._on_joint_belief,
            'robot_description': self._on_description, 'joint_states': self._on_joints,
            'tf_static': self._on_frames,
            **{topic: partial(self._on_event, event, topic)
               for topic, (event, _) in decision_log.TOPICS.items()},
        }  # fmt: skip

    def hear(self, record: Record) -> None:
        """Show one message; those of other topics or types are passed over."""
        topic = record.topic.lstrip('/')
        if TOPICS.get(topic) != record.type:
            return
        try:
            self._receivers[topic](definitions().read(record.data, record.type))
        except (ValueError, cv2.error):
            self.unreadable += 1
        else:
            self.shown += 1

    def _is_ours(self, label: str) -> bool:
        try:
            self._world.check_label(label)
        except ValueError as error:
            self.other_world = f'{error} Name its file by --world.'
            return False
        return True

    def _on_colour(self, image: Any) -> None:
        stamp = stamp_ns(image.header.stamp)
        if self._scene.pictures.wants_colour(stamp):
            self._scene.pictures.show_colour(stamp, colour_of(image))

    def _on_depth(self, image: Any) -> None:
        stamp = stamp_ns(image.header.stamp)
        if self._scene.pictures.wants_depth(stamp):
            self._scene.pictures.show_depth(stamp, depth_of(image))

    def _on_info(self, info: Any) -> None:
        self._scene.pictures.set_intrinsics(intrinsics_of(info))

    def _on_table(self, message: Any) -> None:
        if self._is_ours(message.world):
            self._scene.show_table(of_message(message, len(self._world.states)))

    def _on_world(self, message: Any) -> None:
        self._is_ours(label_of(message.name, message.digest))

    def _on_joint_belief(self, message: Any) -> None:
        if not self._is_ours(message.world):
            return
        states = len(self._world.states)
        marginals = marginals_by_object(message.objects, message.marginals, states)
        stamp = stamp_ns(message.header.stamp)
        self._scene.story.show_joint_belief(stamp, marginals, message.sentence)

    def _on_event(self, event: LogEvent, topic: str, message: Any) -> None:
        if self._is_ours(message.world):
            names = [name for name, _ in definitions().store.fielddefs[TOPICS[topic]][1]]
            self._scene.story.show_event(entry_of_message(event, message, names))

    def _on_description(self, text: Any) -> None:
        self._scene.arm.load(text.data)
        self._place_arm()

    def _on_joints(self, message: Any) -> None:
        positions = dict(zip(message.name, map(float, message.position), strict=True))
        self._scene.arm.move(stamp_ns(message.header.stamp), positions)

    def _on_frames(self, message: Any) -> None:
        self._roots |= {each.child_frame_id: each for each in message.transforms}
        self._place_arm()

    def _place_arm(self) -> None:
        """Where the root link is, once model and frames are known, whichever comes first."""
        found = self._roots.get(self._scene.arm.root)
        if found is not None:
            at, turn = found.transform.translation, found.transform.rotation
            self._scene.arm.place(
                found.header.frame_id, (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)
            )
