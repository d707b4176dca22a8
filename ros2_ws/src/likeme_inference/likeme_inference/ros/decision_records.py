"""The topic decision_record: all that each decision follows from, as in the decision log."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.node import Node
from std_msgs.msg import String

from likeme_core.ros.qos import kept
from likeme_core.world import World
from likeme_inference.decision_record import world_record
from likeme_inference.value_json import to_text

#: Records that a late subscriber receives.
RECORDS_KEPT = 20


class DecisionRecordPublisher:
    """Publishes `decision_record` (String, reliable, transient local): a JSON document each.

    Its keys are those of decision_record.decision_record, and `names`, of the world.
    """

    def __init__(self, node: Node, world: World) -> None:
        self._world = world
        self._publisher = node.create_publisher(String, 'decision_record', kept(RECORDS_KEPT))

    def publish(self, record: Mapping[str, Any] | None) -> None:
        """Publish a record; None: there is none."""
        if record is not None:
            document = {**record, 'names': world_record(self._world)}
            self._publisher.publish(String(data=to_text(document)))


class DecisionRecordSubscriber:
    """Receives `decision_record`.

    Attributes:
        records: the newest ones by the decisions' numbers.
    """

    def __init__(self, node: Node, heard: Callable[[], None] = lambda: None) -> None:
        """heard: called after each record."""
        self.records: dict[int, Mapping[str, Any]] = {}
        self._heard = heard
        node.create_subscription(String, 'decision_record', self._on_record, kept(RECORDS_KEPT))

    def _on_record(self, message: String) -> None:
        try:
            record = json.loads(message.data)
            number = int(record['decision']['id'])
        except (ValueError, KeyError, TypeError):
            # Of another version of the inference node: as if there were none.
            return
        self.records.pop(number, None)
        self.records[number] = record
        while len(self.records) > RECORDS_KEPT:
            self.records.pop(next(iter(self.records)))
        self._heard()
