"""The Foxglove bridge, with a WebSocket client that speaks its protocol."""

from __future__ import annotations

import asyncio
import json
import struct
import threading
from array import array
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from domain_coordinator import domain_id
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Image
from std_msgs.msg import String

from likeme_core.ros.qos import LATCHED
from likeme_msgs.msg import TableState

for _name in ('foxglove', 'websockets'):
    pytest.importorskip(_name, reason=f'{_name}: scripts/foxglove.sh installs it')

import websockets  # noqa: E402

from likeme_replay.ros.foxglove_bridge_node import FoxgloveBridgeNode, read_asset  # noqa: E402

PROTOCOL: Any = 'foxglove.sdk.v1'
#: Opcode, subscription and log time before the bytes of a message.
HEADER, MESSAGE = struct.Struct('<BIQ'), 1
TOPICS = {'/table_state': TableState, '/picture': Image, '/latched': String}


@pytest.fixture
def bridge() -> Iterator[FoxgloveBridgeNode]:
    """A bridge, and a node that publishes images, table states and a latched text."""
    with domain_id() as domain:
        rclpy.init(domain_id=domain)
        node, talker = FoxgloveBridgeNode('127.0.0.1', 0), Node('talker')
        image = Image(height=2, width=2, encoding='rgb8', step=6, data=array('B', range(12)))
        table = TableState(reference_frame='base_link', settled=True)
        senders = [(talker.create_publisher(type(m), n, 1), m) for n, m in (
            ('picture', image), ('table_state', table)
        )]  # fmt: skip
        talker.create_publisher(String, 'latched', LATCHED).publish(String(data='once'))
        talker.create_timer(0.05, lambda: [publisher.publish(m) for publisher, m in senders])
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.add_node(talker)
        thread = threading.Thread(target=executor.spin, daemon=True)
        thread.start()
        yield node
        executor.shutdown()
        thread.join(5.0)
        node.destroy_node()
        talker.destroy_node()
        rclpy.try_shutdown()


async def advertised(socket: Any) -> dict[str, Any]:
    """The channels that a new client is told of, by topic."""
    while True:
        message = json.loads(await socket.recv())
        if message['op'] == 'advertise':
            return {channel['topic']: channel for channel in message['channels']}


async def first_messages(port: int) -> dict[str, Any]:
    """The first message of each topic, decoded, as a new client receives it."""
    while True:
        # Until the bridge has found them: the server refuses who asks for a channel too soon.
        uri = f'ws://127.0.0.1:{port}'
        async with websockets.connect(uri, subprotocols=[PROTOCOL]) as socket:
            channels = await advertised(socket)
            if TOPICS.keys() <= channels.keys():
                return await subscribed(socket, channels)


async def subscribed(socket: Any, channels: dict[str, Any]) -> dict[str, Any]:
    topics = {channels[topic]['id']: topic for topic in TOPICS}
    wanted = [{'id': number, 'channelId': number} for number in topics]
    await socket.send(json.dumps({'op': 'subscribe', 'subscriptions': wanted}))
    got: dict[str, Any] = {}
    while got.keys() != TOPICS.keys():
        data = await socket.recv()
        if isinstance(data, bytes) and data[0] == MESSAGE:
            _, number, _ = HEADER.unpack_from(data)
            got[topics[number]] = deserialize_message(data[HEADER.size :], TOPICS[topics[number]])
    for topic, kind in TOPICS.items():
        channel = channels[topic]
        assert (channel['encoding'], channel['schemaEncoding']) == ('cdr', 'ros2msg')
        assert channel['schemaName'] == f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}'
    assert 'MSG: likeme_msgs/ObjectState' in channels['/table_state']['schema']
    return got


def test_each_client_receives_tables_images_and_what_is_latched(
    bridge: FoxgloveBridgeNode,
) -> None:
    for _ in range(2):
        got = asyncio.run(asyncio.wait_for(first_messages(bridge.port), 60))
        assert got['/table_state'].settled
        assert got['/picture'].data.tolist() == list(range(12))
        assert got['/latched'].data == 'once'


def test_only_files_of_packages_are_served() -> None:
    found = read_asset('package://likeme_replay/package.xml')
    assert found is not None
    assert b'<name>likeme_replay</name>' in found
    for uri in (
        'file:///etc/hosts',
        'package://likeme_replay/../../../../../../../../../../etc/hosts',
        'package://likeme_replay//etc/hosts',
        'package://no_such_package/package.xml',
        'package://likeme_replay/not_there',
    ):
        assert read_asset(uri) is None, uri
