"""Recording as a user does it: real topics, real files, kill -9 and a live run replayed."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml
from rosbags.rosbag2 import Reader
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from typer.testing import CliRunner

from graph import HOLD_KEEPER, LATCHED, Graph, NodeProcess
from likeme_bags.headers import header_stamp
from likeme_bags.reading import Bag, open_bag
from likeme_msgs.msg import Decision, Demonstration, Outcome, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell
from likeme_replay.message_definitions import definitions
from likeme_replay.offline_replay import replay_offline
from likeme_replay.record import app

#: s that a killed recorder may lose.
LOSS = 1.0
RATE = 30.0


def recorder(graph: Graph, path: Path, *options: str) -> NodeProcess:
    module = 'likeme_replay.record'
    return graph.run('recorder', sys.executable, '-m', module, str(path), *options)


class Camera:
    """Publishes numbered images at 30 Hz while the test spins, and knows when it did."""

    def __init__(self, graph: Graph, topic: str) -> None:
        self._pub = graph.publisher(Image, topic)
        self.times: list[float] = []
        graph.node.create_timer(1 / RATE, self._publish)

    def _publish(self) -> None:
        header = Header(frame_id='camera')
        header.stamp.sec = len(self.times)
        self.times.append(time.monotonic())
        self._pub.publish(
            Image(header=header, height=48, width=64, encoding='rgb8', step=192, data=bytes(9216))
        )


def numbers(bag: Bag) -> list[int]:
    return [header_stamp(record.data) // 10**9 for record in bag.records()]


@pytest.mark.graph
@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_killed_recorder_leaves_all_but_the_last_second(tmp_path: Path, storage: str) -> None:
    path = tmp_path / 'bag'
    with Graph(tmp_path) as graph:
        process = recorder(graph, path, '--topics', 'images', '--storage', storage)
        camera = Camera(graph, 'images')
        graph.until(lambda: len(camera.times) >= 4 * RATE, 60, 'four seconds of images')
        killed = time.monotonic()
        process.signal(signal.SIGKILL)
        process.wait(10)
    safe = [n for n, sent in enumerate(camera.times) if sent < killed - LOSS]
    with open_bag(path) as bag:
        found = numbers(bag)
        assert bag.complete, bag.warnings
        definition = bag.topics[0].definition
    # Nothing between the first that was heard and the last second is missing.
    assert found == list(range(found[0], found[-1] + 1))
    assert found[0] < RATE
    assert found[-1] >= safe[-1]
    assert 'std_msgs/Header header' in definition
    with Reader(path) as reader:
        assert reader.message_count == len(found)


@pytest.mark.graph
def test_qos_and_definitions_are_those_of_the_publishers(tmp_path: Path) -> None:
    path = tmp_path / 'bag'
    with Graph(tmp_path) as graph:
        graph.node.create_publisher(Decision, 'decision', LATCHED).publish(
            Decision(object='pear', sentence='From before the recorder came.')
        )
        process = recorder(graph, path, '--topics', 'decision', '--topics', 'outcome')
        graph.until(lambda: 'Recording to' in process.said, 60, 'the recorder')
        graph.until(lambda: open_count(path), 30, 'the decision in the bag')
        assert process.stop() == 0, process.said
    assert 'never published: /outcome' in process.said
    with open_bag(path) as bag:
        (record,) = bag.records()
        (topic,) = bag.topics
    assert definitions().read(record.data, record.type).object == 'pear'
    assert topic.name == '/decision'
    assert (topic.qos[0].durability.name, topic.qos[0].reliability.name) == (
        'TRANSIENT_LOCAL', 'RELIABLE'
    )  # fmt: skip
    assert 'float64[] goal_posterior' in topic.definition
    told = yaml.safe_load((path / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert (told['version'], told['storage_identifier'], told['message_count']) == (9, 'mcap', 1)


def open_count(path: Path) -> int:
    with open_bag(path) as bag:
        return bag.count


@pytest.mark.graph
@pytest.mark.slow
def test_a_live_runs_own_recording_replays_to_its_decisions(tmp_path: Path) -> None:
    """The arm and its words included: the cell, a demonstration, a put back, the robot's act."""
    path = tmp_path / 'live'
    with Graph(tmp_path) as graph:
        process = recorder(graph, path)
        graph.until(lambda: 'Recording to' in process.said, 60, 'the recorder')
        tables = graph.collect(TableState, 'table_state')
        acts = graph.collect(Demonstration, 'demonstration')
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        graph.start('likeme_perception.perception_node')
        graph.start('likeme_inference.inference_node', mode='goal_based')
        # In real time: as fast as it goes, frames come faster than a recorder can promise to keep.
        graph.start(HOLD_KEEPER)
        graph.start('likeme_arm_sim.arm_driver_node', seed=3)
        graph.until(lambda: tables and tables[-1].settled, 60, 'a settled table')
        # The recorder may come half a second after perception; by what it heard perception must
        # have learned the background and seen the table at rest, too.
        seen = len(tables)
        graph.until(lambda: len(tables) > seen + 60, 60, 'two seconds of rest')
        place = ExecuteAction.Request(object='pear', action='place_left')
        graph.call(ExecuteAction, 'human/execute_action', place, 60)
        graph.until(lambda: acts, 30, 'a demonstration')
        graph.call(
            ResetCell, 'cell/reset', ResetCell.Request(objects=['pear'], states=['right']), 30
        )
        graph.until(lambda: outcomes, 90, 'an outcome')
        graph.during(0.5)
        process.signal(signal.SIGINT)
        assert process.wait(60) == 0, process.said
    replayed = replay_offline(path, json_parameters(path))
    assert replayed.complete, replayed.warnings
    # Which of its first frames perception missed decides the last digits of what it measured.
    demonstrated, *decided = replayed.agreements
    assert (demonstrated.event, demonstrated.live, demonstrated.replayed) == (
        'demonstration',
        1,
        1,
    )
    assert [(a.event, a.whole) for a in decided] == [
        ('belief', True), ('decision', True), ('outcome', True)
    ]  # fmt: skip
    assert acts[0].rise == pytest.approx(
        json.loads(replayed.log.splitlines()[0])['rise'], abs=1e-3
    )
    assert '"mode": "goal_based"' in replayed.log


def json_parameters(path: Path) -> dict[str, dict[str, object]]:
    """The parameters as the recorder left them in the bag."""
    from likeme_replay import recorded_parameters as settings

    with open_bag(path) as bag:
        assert json.loads(bag.custom[settings.KEY])['arm_driver']['seed'] == 3
        return settings.recorded(bag.custom)


@pytest.mark.parametrize(
    ('arguments', 'sentence'),
    [
        (('{}',), 'exists already'),
        (('a', 'b'), 'unexpected extra argument'),
        (('{}/new', '--storage', 'tape'), 'tape'),
        (
            ('{}/new', '--storage', 'sqlite3', '--compression', 'lz4'),
            "sqlite3 bag packed by zstd or none, got 'lz4'",
        ),
        (('{}/new', '--all', '--topics', 'x'), '--all without --topics'),
    ],
)
def test_what_cannot_be_recorded_is_refused(
    arguments: tuple[str, ...], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', '0')
    told = CliRunner().invoke(app, [word.format(tmp_path) for word in arguments])
    assert told.exit_code == 2
    assert sentence in ' '.join(told.stderr.split())
    # Nothing but what ends a command.
    assert isinstance(told.exception, SystemExit)


def sizes_in(drawn: str) -> list[float]:
    return [float(s) for s in re.findall(r'Recording: \d+ messages, ([\d.]+) MB', drawn)]


@pytest.mark.graph
def test_a_terminal_shows_the_growing_size_and_a_pipe_nothing_of_it(tmp_path: Path) -> None:
    drawn = ''

    def sizes() -> list[float]:
        nonlocal drawn
        if select.select([ours], [], [], 0)[0]:
            drawn += os.read(ours, 1 << 20).decode('utf-8', 'replace')
        return sizes_in(drawn)

    with Graph(tmp_path) as graph:
        ours, theirs = pty.openpty()
        out = tmp_path / 'out.txt'
        options = ['--topics', 'picture', '--duration', '600', '--compression', 'none']
        command = [sys.executable, '-m', 'likeme_replay.record', str(tmp_path / 'bag'), *options]
        with out.open('wb') as stdout:
            process = subprocess.Popen(command, stdout=stdout, stderr=theirs, env=graph.env)
        os.close(theirs)
        Camera(graph, 'picture')
        graph.until(lambda: len(set(sizes())) > 2, 30, 'a size that grows')
        process.send_signal(signal.SIGINT)
        process.wait(60)
        os.close(ours)
    assert sizes_in(drawn) == sorted(sizes_in(drawn))
    assert 'left' in drawn
    said = out.read_text('utf-8')
    assert 'Recording:' not in said
    assert re.search(r'\d+ messages, [\d.]+ MB in ', said)
