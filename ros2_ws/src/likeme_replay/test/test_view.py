"""`view`: what it writes is read again and compared with what was put in."""

from __future__ import annotations

import json
import socket
import urllib.request
from array import array
from itertools import count
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from geometry_msgs.msg import Point, Transform, TransformStamped
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage
from typer.testing import CliRunner

from graph import LATCHED, Graph
from likeme_bags.values import Record
from likeme_core.ros.time import time_msg
from likeme_core.stamps import SECOND
from likeme_core.world import load_world
from likeme_msgs.msg import (
    Decision,
    GoalBelief,
    JointGoalBelief,
    ObjectState,
    Outcome,
    TableState,
    UnknownObject,
)
from likeme_msgs.msg import World as WorldMsg

for _name in ('rerun', 'rerun_cli'):
    pytest.importorskip(_name, reason=f'{_name}: scripts/view.sh installs it')

from viewer_file import ViewerFile  # noqa: E402

from likeme_replay.view import app  # noqa: E402
from likeme_replay.viewer.display import display  # noqa: E402
from likeme_replay.viewer.message_scene import TOPICS, MessageScene  # noqa: E402
from likeme_replay.viewer.viewer_process import PortError, viewer  # noqa: E402

BAGS = Path(__file__).parents[4] / 'bags'
WORLD = load_world('chung2015')
LEFT, RIGHT, OFFTABLE = WORLD.states
START = 1_700_000_000 * SECOND
#: One joint that turns about z, 1 m along x.
URDF = """<robot name="stick"><link name="root"/><link name="tip"><visual><geometry>
<box size="0.1 0.1 0.1"/></geometry></visual></link><joint name="hinge" type="revolute">
<parent link="root"/><child link="tip"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"""


def view(*words: object) -> Any:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(scope='module')
def computed(tmp_path_factory: pytest.TempPathFactory) -> ViewerFile:
    """A recording of a camera alone, as a scene."""
    path = tmp_path_factory.mktemp('view') / 'pear.rrd'
    ended = view(BAGS / 'pear_right_left_place', '--save', path)
    assert ended.exit_code == 0, ended.output
    assert 'were computed' in ended.output
    return ViewerFile(path)


def logged(event: str) -> list[dict[str, Any]]:
    """The events of a kind in the decision log that is expected of the recording."""
    lines = (BAGS / 'pear_right_left_place.jsonl').read_text('utf-8').splitlines()
    return [entry for entry in map(json.loads, lines) if entry['event'] == event]


def test_beliefs_and_decisions_are_those_of_the_decision_log(computed: ViewerFile) -> None:
    (belief,) = logged('belief')
    first = computed.rows('beliefs/pear')[0]
    assert first.stamp == belief['stamp']
    assert first.values['scalars'] == pytest.approx(belief['posterior'])
    asked = logged('decision')[-1]
    shown = [row for row in computed.rows('decisions/pear') if row.stamp == asked['stamp']]
    pair = [asked['predicted_success'], asked['threshold']]
    assert shown[0].values['scalars'] == pytest.approx(pair)
    assert computed.rows('beliefs/lemon') == []
    told = [entry['sentence'] for entry in logged('decision')]
    assert [sentence for sentence in computed.story if sentence in told] == told
    assert any(
        line.startswith('Seen: pear from RIGHT to LEFT by place') for line in computed.story
    )


def test_states_follow_the_pear_to_the_left_and_back(computed: ViewerFile) -> None:
    sure = [
        int(np.argmax(row.values['scalars']))
        for row in computed.rows('states/pear')
        if max(row.values['scalars']) > 0.9
    ]
    changes = [a for a, b in zip(sure, [None, *sure], strict=False) if a != b]
    assert changes == [RIGHT, LEFT, RIGHT]
    assert computed.static('states/pear')['names'] == ['LEFT', 'RIGHT', 'OFFTABLE']
    last = computed.rows('cell/objects/pear')[-1].values
    (label,), (centre,) = last['labels'], last['centers']
    assert label.startswith('pear RIGHT')
    assert WORLD.regions.work_area.contains(*centre[:2])


def test_pictures_are_whole_and_no_more_than_five_a_second(computed: ViewerFile) -> None:
    colour, depth = computed.rows('cell/camera/colour'), computed.rows('cell/camera/depth')
    for rows, least in ((colour, SECOND // 5), (depth, SECOND // 2)):
        stamps = [row.stamp for row in rows if row.stamp is not None]
        assert len(stamps) > 10
        assert min(np.diff(stamps)) >= least
    picture = cv2.imdecode(np.frombuffer(bytes(colour[0].values['blob'][0]), np.uint8), -1)
    assert picture.shape == (480, 640, 3)
    readings = cv2.imdecode(np.frombuffer(bytes(depth[0].values['blob'][0]), np.uint8), -1)
    assert readings.shape == (240, 320)
    assert 500 < np.median(readings[readings > 0]) < 3000
    assert computed.static('cell/camera/colour')['resolution'] == [[640.0, 480.0]]


def test_the_scene_is_the_worlds(computed: ViewerFile) -> None:
    for entry in WORLD.region_entries:
        assert (f'cell/regions/{entry.state.name}' in computed.entities) == (
            entry.area is not None
        )
        if entry.area is not None:
            (strip,) = computed.static(f'cell/regions/{entry.state.name}')['strips']
            assert np.allclose(np.array(strip)[:-1, :2], entry.area.corners(), atol=1e-6)
    pose = WORLD.camera.pose()
    assert computed.static('cell/camera')['translation'][0] == pytest.approx(pose[:3, 3])
    assert not any(entity.startswith('arm/') and entity != 'arm' for entity in computed.entities)


def header(seconds: float, frame: str = 'base_link') -> Header:
    return Header(stamp=time_msg(START + round(seconds * SECOND)), frame_id=frame)


#: serialize_message adds bytes to empty arrays of doubles, which rosbags refuses; DDS does not.
NOT_EMPTY = {'velocity': [0.0], 'effort': [0.0]}


def record(topic: str, message: Any) -> Record:
    return Record(f'/{topic}', TOPICS[topic], 0, serialize_message(message))


def pear(seconds: float, **fields: Any) -> TableState:
    given = {'name': 'pear', 'state': 0, 'state_probability': [0.9, 0.1, 0.0], 'visible': True,
             'centroid': Point(x=0.4, y=0.1, z=0.05), 'height': 0.06}  # fmt: skip
    return TableState(
        header=header(seconds), world=WORLD.label, objects=[ObjectState(**given | fields)]
    )


def written(path: Path, *records: Record) -> tuple[ViewerFile, MessageScene]:
    with display(path, None) as opened:
        scene = MessageScene(opened.open_scene(WORLD), WORLD)
        for each in records:
            scene.hear(each)
    return ViewerFile(path), scene


def test_the_arm_stands_on_its_frame_and_turns_its_joints(tmp_path: Path) -> None:
    place = TransformStamped(header=header(0), child_frame_id='root', transform=Transform())
    place.transform.translation.z, place.transform.rotation.w = 0.5, 1.0
    turns = [
        JointState(header=header(s), name=['hinge', 'other'], position=[a, 7.0], **NOT_EMPTY)
        for s, a in ((0, 0.0), (0.01, 9.0), (1, 1.0))
    ]
    file, scene = written(
        tmp_path / 'a.rrd',
        record('tf_static', TFMessage(transforms=[place])),
        record('robot_description', String(data=URDF)),
        *(record('joint_states', turn) for turn in turns),
    )
    assert scene.unreadable == 0
    base = file.static('arm/base')
    assert base['translation'][0] == pytest.approx([0, 0, 0.5])
    assert (base['parent_frame'], base['child_frame']) == (['base_link'], ['root'])
    assert any('visual_geometries/tip' in entity for entity in file.entities)
    # The second came too soon.
    first, last = file.rows('arm/joints/hinge')
    assert first.values['quaternion'][0] == pytest.approx([0, 0, 0, 1])
    assert last.values['translation'][0] == pytest.approx([1, 0, 0])
    assert last.values['quaternion'][0] == pytest.approx(
        [0, 0, np.sin(0.5), np.cos(0.5)], abs=1e-6
    )
    assert file.rows('joints')[-1].values['scalars'] == [1.0, 7.0]
    assert file.static('joints')['names'] == ['hinge', 'other']


def test_tables_and_events_are_shown_as_they_were_recorded(tmp_path: Path) -> None:
    unknown = UnknownObject(name='unknown_1', centroid=Point(x=0.3, y=0.0, z=0.02), height=0.04)
    hidden = pear(2, state=ObjectState.UNKNOWN, state_probability=[1 / 3] * 3, visible=False)
    dark = pear(3)
    dark.reason, dark.hand_in_view, dark.unknown_objects = 'image too dark', True, [unknown]
    common = {'world': WORLD.label, 'object': 'pear'}
    belief = GoalBelief(header=header(1), prior=[1.0], posterior=[0.2, 0.7, 0.1], **common)
    arrays = ('goal_posterior', 'action_probability', 'predicted', 'plan_success')
    choice = Decision(header=header(1), kind=1, success_probability=[0.1, 0.4], sentence='I ask.',
                      predicted_success=0.4, threshold=0.5, **common,
                      **{name: [0.5] for name in arrays})  # fmt: skip
    wanted = JointGoalBelief(
        header=header(1), world=WORLD.label, objects=['pear', 'lemon', 'chicken'],
        marginals=[0.7, 0.1, 0.0, 0.2, *[0.25] * 8], sentence='I believe pear LEFT.',
        probability=[1.0], description=['pear LEFT'], changes=[0, 255, 255],
    )  # fmt: skip
    unseen = Outcome(header=header(2), result=2, sentence='Not seen.', **common)
    file, scene = written(
        tmp_path / 'a.rrd',
        *(record('table_state', t) for t in (pear(0), pear(0.01), hidden, dark)),
        record('goal_belief', belief),
        record('decision', choice),
        record('outcome', unseen),
        record('joint_goal_belief', wanted),
        Record('/table_state', TOPICS['table_state'], 0, b'\0\1\0\0nonsense'),
        Record('/chatter', 'std_msgs/msg/String', 0, b''),
    )
    assert (scene.shown, scene.unreadable, scene.other_world) == (8, 1, '')
    rows = file.rows('states/pear')
    assert [row.stamp for row in rows] == [START + n * SECOND for n in (0, 2, 3)]
    assert rows[1].values['scalars'] == pytest.approx([1 / 3] * 3)
    labels = [row.values['labels'][0] for row in file.rows('cell/objects/pear')]
    assert labels == ['pear LEFT 0.90', 'pear UNKNOWN (not seen now)', 'pear LEFT 0.90']
    assert file.rows('cell/unknown_objects')[-1].values['labels'] == ['unknown_1']
    assert file.rows('beliefs/pear')[0].values['scalars'] == pytest.approx([0.2, 0.7, 0.1])
    assert file.rows('joint_beliefs/pear')[0].values['scalars'] == pytest.approx(
        [0.7, 0.1, 0, 0.2]
    )
    assert file.static('joint_beliefs/pear')['names'][-1] == 'P(pear need not change)'
    assert file.rows('decisions/pear')[0].values['scalars'] == [0.4, 0.5]
    levels = {row.values['text'][0]: row.values['level'][0] for row in file.rows('story')}
    assert levels == {
        'Goal of the pear: P(G | x_i, x_f) = LEFT 0.20, RIGHT 0.70, OFFTABLE 0.10.': 'INFO',
        'I believe pear LEFT.': 'INFO', 'I ask.': 'WARN', 'Not seen.': 'WARN',
        'A hand is in view.': 'INFO',
        'All states are UNKNOWN: image too dark.': 'WARN',
    }  # fmt: skip


def test_what_is_of_another_world_is_not_shown(tmp_path: Path) -> None:
    other = pear(0)
    other.world = 'elsewhere@0123456789ab'
    file, scene = written(tmp_path / 'a.rrd', record('table_state', other))
    assert scene.other_world.startswith(f'Expected the world {WORLD.label}, got elsewhere@')
    assert file.rows('states/pear') == []


def test_the_page_for_a_browser_is_served_to_this_host_alone(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(('127.0.0.1', 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(PortError, match=f'port {port} of 127.0.0.1'), viewer(port):
            pass
    with viewer(port) as shown:
        address = shown.page.partition('?')[0]
        with urllib.request.urlopen(address, timeout=20) as answer:
            assert b'rerun' in answer.read().lower()
        pid = shown.process.pid
        listening = Path(f'/proc/{pid}/net/tcp').read_text().splitlines()[1:]
        ours = {f'{int(p):04X}' for p in (port, shown.url.split(':')[2].split('/')[0])}
        places = {line.split()[1] for line in listening if line.split()[3] == '0A'}
        assert {place for place in places if place[-4:] in ours} == {f'0100007F:{p}' for p in ours}
    assert shown.process.poll() is not None


@pytest.mark.parametrize(
    ('words', 'code', 'said'),
    [
        (['no_bag', '--save', 'a.rrd'], 1, 'no_bag'),
        (['a.rrd', '--web'], 1, 'Expected a file, got a.rrd, which does not exist.'),
        (['bag'], 1, 'Expected a display for the window, got none'),
        (['bag', '--live'], 2, 'got both --live and bag'),
        ([], 2, 'got neither'),
        (['bag', '--save', 'a.txt'], 2, 'Expected --save FILE.rrd, got a.txt.'),
        (['bag', '--save', 'nowhere/a.rrd'], 2, 'in a folder that exists, got nowhere.'),
        (['a.rrd', '--save', 'b.rrd'], 2, 'which is saved already'),
        (['bag', '--seconds', '3'], 2, 'Expected --seconds with --live'),
    ],
)
def test_wrong_usage_is_one_sentence(
    words: list[str], code: int, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / 'bag').symlink_to(BAGS / 'passed_through')
    monkeypatch.chdir(tmp_path)
    for variable in ('DISPLAY', 'WAYLAND_DISPLAY'):
        monkeypatch.delenv(variable, raising=False)
    ended = view(*words)
    assert (ended.exit_code, ended.output.count('\n')) == (code, 1), ended.output
    assert said in ended.output
    assert not list(tmp_path.glob('*.rrd'))


@pytest.mark.graph
def test_a_running_cell_is_written_as_it_is_heard(tmp_path: Path) -> None:
    out = tmp_path / 'live.rrd'
    with Graph(tmp_path) as graph:
        world = WorldMsg(name=WORLD.name, digest=WORLD.digest)
        create = graph.node.create_publisher
        create(WorldMsg, 'world', LATCHED).publish(world)
        create(String, 'robot_description', LATCHED).publish(String(data=URDF))
        pixels = array('B', bytes([200, 40, 90] * 64))
        sent = [
            (create(type(m), topic, 10), m) for topic, m in (
                ('table_state', pear(0)),
                ('camera/rgb/image_rect_color',
                 Image(header=header(0), height=8, width=8, encoding='rgb8', data=pixels)),
                ('joint_states', JointState(header=header(0), name=['hinge'], position=[1.0])),
            )
        ]  # fmt: skip
        stamps = count()

        def publish() -> None:
            now = header(next(stamps))
            for publisher, message in sent:
                message.header.stamp = now.stamp
                publisher.publish(message)

        graph.node.create_timer(0.1, publish)
        run = graph.start('likeme_replay.view', '--live', '--save', str(out), '--seconds', '3')
        graph.until(lambda: not run.alive, 30, 'its end')
        assert run.wait(1) == 0, run.said
        assert f'Written: {out}' in run.said
    file = ViewerFile(out)
    assert file.rows('states/pear')[0].values['scalars'] == pytest.approx([0.9, 0.1, 0.0])
    assert file.rows('arm/joints/hinge')
    assert any('visual_geometries/tip' in entity for entity in file.entities)
    picture = bytes(file.rows('cell/camera/colour')[0].values['blob'][0])
    assert cv2.imdecode(np.frombuffer(picture, np.uint8), -1).shape == (8, 8, 3)
