"""Message definitions in the forms that recorders write them, and those that cannot be used."""

from __future__ import annotations

import csv
import struct
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag1 import Writer as Writer1
from sample_bags import BEGIN
from typer.testing import CliRunner

from likeme_bags.bag_console import app
from likeme_bags.doctor import examine
from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag
from likeme_bags.typestores import decode
from likeme_bags.values import Topic

LINE = '=' * 80 + '\n'
TWO = b'\0\1\0\0' + struct.pack('<ii', 1, 2)
MSG = {
    'line ends of Windows': 'int32 a\r\nint32 b\r\n',
    'line ends of old Macs': 'int32 a\rint32 b\r',
    'byte order mark': '\ufeffint32 a\nint32 b\n',
    'no-break spaces and form feeds': 'int32\u00a0a\n\x0c\nint32 b\u00a0\n',
    'comments': '# "x\n  # ünïcode\nint32 a # b\n\n\tint32\tb#c\n',
    'constants of ROS 1': "int32 lower=3\nstring EMPTY=\nstring IT='it''s'\nint32 a\nint32 b\n",
    'defaults and bounds': 'int32 a 5\nint32 b\n',
    'its own heading': f'{LINE}MSG: p/msg/T\nint32 a\nint32 b\n',
    'a nested type': f'int32 a\nB b\n{LINE}MSG: p/B\nint32 x\n',
    'a nested type, Windows': f'int32 a\nB b\n{LINE}MSG: p/B\nint32 x\n'.replace('\n', '\r\n'),
    'a separator of another length': f'int32 a\nB b\n{"=" * 40}  \nMSG: p/msg/B\nint32 x\n',
    "Jazzy's types not embedded": 'std_msgs/Int32 a\nint32 b\n',
}
EVENT = f'int32 a\np/srv/T_Request b\n{LINE}MSG: p/srv/T_Request\nint32 x\n'
STRUCT = 'module p { module msg { struct T { long a; long b; }; }; };\n'
IDL = {
    'include': f'// from p/msg/T.msg\n#include "p/msg/B.idl"\n{STRUCT}',
    'include guards': f'#ifndef P_T\n # define P_T 1 \\\n  more\n{STRUCT}#endif // P_T\n',
    'comments': '/* a\n#b */\n' + STRUCT.replace('long a;', 'long /* c */ a; // # d\n'),
    'annotations': STRUCT.replace('long b', '@verbatim (language="comment", text=\n"# /* x" "\\n")'
                                  ' @default (value=3) long b'),
    'line ends of Windows': f'#include "x"\n{STRUCT}'.replace('\n', '\r\n'),
    'a nested type later': (
        f'{LINE}IDL: p/msg/T\n#include "p/msg/B.idl"\n{STRUCT.replace("long a", "p::msg::B a")}'
        f'{LINE}IDL: p/msg/B\nmodule p {{ module msg {{ struct B {{ long x; }}; }}; }};\n'
    ),
    'a nested type of another language': (
        f'{LINE}IDL: p/msg/T\n{STRUCT.replace("long a", "p::msg::B a")}'
        f'{LINE}MSG: p/B\nint32 x\n'
    ),
}  # fmt: skip
UNUSABLE = {
    'service event': ('p/srv/T_Event', f'{LINE}SRV: p/srv/T\nint64 a\n---\nint64 b\n', 'ros2msg'),
    'action': ('p/action/T_Goal', f'{LINE}ACTION: p/action/T\nint64 a\n---\n---\n', 'ros2msg'),
    'wide string': ('p/msg/T', 'wstring text\n', 'ros2msg'),
    'bounded wide string': ('p/msg/T', 'wstring<=5[] text\n', 'ros2msg'),
    'wide string in IDL': ('p/msg/T', STRUCT.replace('long a', 'wstring a'), 'ros2idl'),
    'union': ('p/msg/T', 'module p { union U switch (long) { case 1: long a; }; };', 'ros2idl'),
    'a type that is missing': ('p/msg/T', 'q_msgs/Own own\n', 'ros2msg'),
    'another language': ('p/msg/T', '{"type": "object"}', 'jsonschema'),
    'many lines of nothing': ('p/msg/T', 'no\n' * 50, 'ros2msg'),
}


def ints(message: Any) -> list[int]:
    return [getattr(each, 'x', getattr(each, 'data', each)) for each in (message.a, message.b)]


@pytest.mark.parametrize('form', MSG)
def test_message_definitions(form: str) -> None:
    topic = Topic('/x', 'p/msg/T', definition=MSG[form], encoding='ros2msg')
    assert ints(decode(topic, TWO)) == [1, 2]


@pytest.mark.parametrize('name', ['p/srv/T_Event', 'p/action/T_Goal'])
def test_messages_of_services_and_actions(name: str) -> None:
    text = EVENT if name.endswith('Event') else EVENT.replace('/srv/', '/action/')
    topic = Topic('/x', name, definition=text, encoding='ros2msg')
    assert ints(decode(topic, TWO)) == [1, 2]


@pytest.mark.parametrize('form', IDL)
def test_idl_definitions(form: str) -> None:
    topic = Topic('/x', 'p/msg/T', definition=IDL[form], encoding='ros2idl')
    assert ints(decode(topic, TWO)) == [1, 2]


def write_mcap(path: Path, kind: str, definition: str, language: str) -> Path:
    """One message of two ints in an MCAP file without chunks."""

    def text(value: str) -> bytes:
        return struct.pack('<I', len(value.encode())) + value.encode()

    def record(code: int, body: bytes) -> bytes:
        return struct.pack('<BQ', code, len(body)) + body

    magic = b'\x89MCAP0\r\n'
    path.write_bytes(
        magic
        + record(1, text('ros2') + text('test'))
        + record(3, struct.pack('<H', 1) + text(kind) + text(language) + text(definition))
        + record(4, struct.pack('<HH', 1, 1) + text('/x') + text('cdr') + struct.pack('<I', 0))
        + record(5, struct.pack('<HIQQ', 1, 0, BEGIN, BEGIN) + TWO)
        + record(15, bytes(4))
        + record(2, bytes(20))
        + magic
    )
    return path


@pytest.mark.parametrize('name', UNUSABLE)
def test_definitions_that_cannot_be_used_are_a_warning(name: str, tmp_path: Path) -> None:
    """The bag is whole: doctor exits with 0 and prints one line per check."""
    path = write_mcap(tmp_path / 'x.mcap', *UNUSABLE[name])
    done = CliRunner().invoke(app, ['doctor', str(path)])
    assert done.exit_code == 0, done.stdout
    lines = {line[6:20].strip(): line[:5].strip() for line in done.stdout.splitlines()}
    assert len(done.stdout.splitlines()) == len(lines) == len(examine(path))
    assert lines['decoding'] == lines['definitions'] == 'warn'
    done = CliRunner().invoke(
        app, ['export', str(path), '--format', 'csv', '--out', str(tmp_path / 'csv')]
    )
    assert done.exit_code == 1
    assert done.stderr.startswith('bag: /x: expected a definition of p/')
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / 'csv').exists()
    with open_bag(path) as bag, pytest.raises(BagError, match='/x: expected a definition of p/'):
        decode(bag.topics[0], TWO)


def test_idl_with_an_include_becomes_a_table(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / 'x.mcap', 'p/msg/T', IDL['a nested type later'], 'ros2idl')
    out = tmp_path / 'csv'
    done = CliRunner().invoke(app, ['export', str(path), '--format', 'csv', '--out', str(out)])
    assert done.exit_code == 0, done.stderr
    with (out / 'x.csv').open() as file:
        assert list(csv.DictReader(file)) == [{'log_time': str(BEGIN), 'a.x': '1', 'b': '2'}]
    assert CliRunner().invoke(app, ['doctor', str(path)]).exit_code == 0


@pytest.mark.parametrize(
    'definition',
    [
        'Header header\r\nint32 lower=3\r\nint32 a\r\n',
        'int32 lower=3\nHeader header\nint32 a\n',
    ],
)
def test_definitions_in_ros_1_bags(tmp_path: Path, definition: str) -> None:
    """Line ends of Windows, and constants that ROS 2 does not allow."""
    header = f'{LINE}MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n'
    if '\r' in definition:
        header = header.replace('\n', '\r\n')
    path = tmp_path / 'x.bag'
    with Writer1(path) as writer:
        connection = writer.add_connection(
            '/x', 'p/msg/T', msgdef=definition + header, md5sum='0' * 32
        )
        writer.write(connection, BEGIN, struct.pack('<IIIIi', 9, 8, 7, 0, 42))
    with open_bag(path) as bag:
        message: Any = decode(bag.topics[0], next(bag.records()).data)
        assert bag.complete
    assert (message.header.stamp.sec, message.header.stamp.nanosec, message.a) == (8, 7, 42)
