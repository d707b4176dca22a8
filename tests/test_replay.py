"""Replays as a user runs them: real nodes, real DDS, every byte of the log compared."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from domain_coordinator import domain_id
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo
from typer.testing import CliRunner

from busy_cores import busy_cores
from graph import LATCHED, Graph
from likeme_bags.images import COMPRESSED, IMAGE, decode_image
from likeme_bags.reading import open_bag
from likeme_bags.typestores import jazzy
from likeme_bags.values import Record, Topic
from likeme_bags.writing import BagWriter
from likeme_msgs.msg import Decision
from likeme_replay.offline_replay import replay_offline
from likeme_replay.replay import app

BAGS = Path(__file__).parents[1] / 'bags'


def replay(
    *arguments: str, domain: int = 0, keys: str = '', wait: float = 200
) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, '-m', 'likeme_replay.replay', *arguments]
    env = os.environ | {'ROS_DOMAIN_ID': str(domain)}
    return subprocess.run(
        command, capture_output=True, text=True, timeout=wait, input=keys, env=env, check=False
    )


@pytest.mark.graph
@pytest.mark.slow
def test_in_lockstep_the_log_is_the_same_at_any_rate_and_load(tmp_path: Path) -> None:
    """Two of the bags; `bench.sh bags --only lockstep` plays them all, at four rates."""
    log = tmp_path / 'log.jsonl'
    with domain_id() as domain:
        told = replay(str(BAGS / 'story_asks'), '--log', str(log), domain=domain)
        assert told.returncode == 0, told.stderr
        assert log.read_bytes() == (BAGS / 'story_asks.jsonl').read_bytes()
        with busy_cores(300):
            # What perception is not quite sure of goes to inference, too.
            bag, options = str(BAGS / 'dropped_short'), ('--rate', '4', '--clock')
            told = replay(bag, '--log', str(log), *options, domain=domain)
        assert told.returncode == 0, told.stderr
        assert log.read_bytes() == (BAGS / 'dropped_short.jsonl').read_bytes(), 'all cores busy'


@pytest.mark.graph
@pytest.mark.slow
def test_running_nodes_start_anew_for_every_replay_and_are_let_go(tmp_path: Path) -> None:
    log = tmp_path / 'log.jsonl'
    with Graph(tmp_path) as graph:
        graph.start('likeme_perception.perception_node')
        inference = graph.start('likeme_inference.inference_node')
        decisions = graph.collect(Decision, 'decision', LATCHED)
        for name in ('two_objects', 'story_acts'):
            told = replay(str(BAGS / name), '--running', '--log', str(log), domain=graph.domain)
            assert told.returncode == 0, told.stderr
            assert log.read_bytes() == (BAGS / f'{name}.jsonl').read_bytes()
        graph.until(lambda: decisions, 10, 'a decision')
        # Another one who publishes images would make the outcome depend on the hour.
        graph.publisher(CameraInfo, 'camera/rgb/camera_info')
        told = replay(str(BAGS / 'put_back'), '--running', '--log', str(log), domain=graph.domain)
        assert told.returncode == 1
        assert 'Expected nobody else to publish camera/rgb/camera_info, got 1' in told.stderr
        freed = 'replayed = False'
        graph.until(lambda: inference.said.count(freed) == 3, 10, 'inference let go')


@pytest.mark.graph
def test_a_bag_plays_into_the_graph_byte_by_byte_and_time_only_goes_on(tmp_path: Path) -> None:
    """In a loop, at ten times the speed, until q."""
    bag = BAGS / 'passed_through'
    with open_bag(bag) as opened:
        topic = next(t.name for t in opened.topics if t.name.endswith('camera_info'))
        recorded = [record.data for record in opened.records([topic])]
    with Graph(tmp_path) as graph:
        received: list[bytes] = []
        graph.node.create_subscription(CameraInfo, topic, received.append, 100, raw=True)
        clock = graph.collect(Clock, '/clock', 100)
        player = graph.run(
            'player', sys.executable, '-m', 'likeme_replay.replay', str(bag),
            '--topics', topic, '--rate', '10', '--loop', '--clock',
        )  # fmt: skip
        wanted = len(recorded) + 20
        graph.until(lambda: len(received) >= wanted, 60, 'a round and the next one')
        player.stop()
    rounds = [*recorded, *recorded[:20]]
    # The network rounds lengths up to words; nothing else may differ.
    assert {len(got) - len(sent) for got, sent in zip(received, rounds, strict=False)} <= {
        0,
        1,
        2,
        3,
    }
    assert [got[: len(sent)] for got, sent in zip(received, rounds, strict=False)] == rounds
    times = [c.clock.sec * 10**9 + c.clock.nanosec for c in clock]
    assert times == sorted(times)
    assert len(set(times)) > len(recorded)


@pytest.mark.graph
def test_a_paused_player_goes_on_key_by_key(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        infos = graph.collect(CameraInfo, 'camera/rgb/camera_info', 100)
        arguments = str(BAGS / 'lifted'), '--topics', 'camera/rgb/camera_info', '--pause'
        told = replay(*arguments, domain=graph.domain, keys='nnnq')
        assert told.returncode == 0, told.stderr
        assert '3 messages played' in told.stderr
        graph.until(lambda: len(infos) == 3, 10, 'three messages')


@pytest.mark.parametrize(
    ('arguments', 'code', 'sentence'),
    [
        (('/nowhere/bag', '--offline'), 2, 'Expected a bag, got /nowhere/bag'),
        ((str(BAGS / 'README.md'), '--offline'), 1, 'README.md'),
        ((str(BAGS / 'lifted'), '--offline', '--loop'), 2, '--offline take no --loop'),
        ((str(BAGS / 'lifted'), '--start', '3', '--end', '2'), 2, 'Expected --start before --end'),
        ((str(BAGS / 'lifted'), '--offline', '--remap', 'a=b'), 2, "FROM:=TO, got 'a=b'"),
        ((str(BAGS / 'lifted'), '--offline', '--remap', 'a:=b'), 1, 'a: expected a topic'),
        ((str(BAGS / 'lifted'), '--topics', 'nothing'), 1, 'nothing: expected one of'),
        (
            (str(BAGS / 'lifted'), '--offline', '--params', '/nowhere'),
            2,
            '/nowhere cannot be read',
        ),
        ((str(BAGS / 'lifted'), '--offline', '--start', '500'), 1, 'Expected frames to show'),
        ((str(BAGS / 'lifted'), '--log', '/nowhere/a/log'), 2, 'Expected a folder for --log'),
    ],
)
def test_what_cannot_be_replayed_is_refused_in_a_sentence(
    arguments: tuple[str, ...], code: int, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', '0')
    told = CliRunner().invoke(app, arguments)
    assert (told.exit_code, sentence in told.stderr) == (code, True), told.stderr
    # Nothing but what ends a command.
    assert isinstance(told.exception, SystemExit)


def test_parameters_before_those_of_the_recording(tmp_path: Path) -> None:
    file = tmp_path / 'params.yaml'
    file.write_text('inference_node:\n  ros__parameters:\n    help_threshold: 0.99\n')
    told = replay(
        str(BAGS / 'put_back'), '--offline', '--params', str(file), '--log', '-', wait=200
    )
    assert told.returncode == 0, told.stderr
    assert '"threshold": 0.99' in told.stdout
    assert '"kind": 1' in told.stdout


@pytest.mark.parametrize(
    ('colour', 'options'),
    [('/camera/color/image_raw', ()), ('/eye', ('--remap', '/eye:=camera/rgb/image_rect_color'))],
)
def test_another_drivers_names_lead_to_the_same_log(
    colour: str, options: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Names that are known by themselves, and one that only the user knows."""
    names = {
        'camera/rgb/image_rect_color': colour,
        'camera/depth_registered/image_rect': '/camera/aligned_depth_to_color/image_raw',
        'camera/rgb/camera_info': '/camera/color/camera_info',
    }
    with open_bag(BAGS / 'put_back') as bag, BagWriter(tmp_path / 'other') as writer:
        for topic in bag.topics:
            writer.add(replace(topic, name=names[topic.name]))
        for record in bag.records():
            writer.write(record._replace(topic=names[record.topic]))
    log = tmp_path / 'log.jsonl'
    monkeypatch.setenv('ROS_DOMAIN_ID', '0')
    words = [str(tmp_path / 'other'), '--offline', '--log', str(log)]
    told = CliRunner().invoke(app, [*words, *options])
    assert told.exit_code == 0, told.stderr
    assert log.read_bytes() == (BAGS / 'put_back.jsonl').read_bytes()
    if options:
        told = CliRunner().invoke(app, words)
        assert told.exit_code == 1
        assert 'Expected camera/rgb/image_rect_color' in told.stderr


def packed(record: Record) -> Record:
    """An image as image_transport packs it without loss: PNG, for depth behind twelve bytes."""
    image = decode_image(record)
    depth = image.encoding == '16UC1'
    pixels = image.pixels if depth else image.pixels[:, :, ::-1]
    png = cv2.imencode('.png', pixels, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes()
    form = '16UC1; compressedDepth png' if depth else 'rgb8; png compressed bgr8'
    message = jazzy().types[COMPRESSED](
        jazzy().deserialize_cdr(record.data, IMAGE).header,
        form,
        np.frombuffer(bytes(12) + png if depth else png, np.uint8),
    )
    topic = f'{record.topic}/{"compressedDepth" if depth else "compressed"}'
    data = bytes(jazzy().serialize_cdr(message, COMPRESSED))
    return Record(topic, COMPRESSED, record.stamp, data)


def test_packed_pictures_lead_to_the_same_log(tmp_path: Path) -> None:
    with open_bag(BAGS / 'dropped_short') as bag, BagWriter(tmp_path / 'packed') as writer:
        for record in bag.records():
            record = packed(record) if record.type == IMAGE else record
            writer.add(Topic(record.topic, record.type))
            writer.write(record)
    replayed = replay_offline(tmp_path / 'packed')
    assert replayed.log == (BAGS / 'dropped_short.jsonl').read_text(encoding='utf-8')
