"""Bags that rosbag2 and others wrote: every one read in full, or refused with the reason."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import pytest

from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag
from likeme_bags.typestores import decode

ROOT = Path(__file__).parents[4]
SHARED = Path(os.environ.get('LIKEME_SHARED', ROOT.parent / 'shared')) / 'data' / 'bags'
PY, TESTS, TRANSPORT = (
    f'rosbag2/{name}/resources'
    for name in ('rosbag2_py/test', 'rosbag2_tests', 'rosbag2_transport/test')
)
CPP = 'rosbag2/rosbag2_cpp/test/rosbag2_cpp/bags'
AB = {'a_empty': 100, 'b_basictypes': 50}
AC = {'a_empty': 25, 'c_strings': 50}
TALKER = {'/topic': 10, '/rosout': 10}
EVENTS = {
    '/test_service1/_service_event': 4,
    '/test_service2/_service_event': 4,
    '/test_topic1': 1,
    '/test_topic2': 1,
}
WBAG = {'AAA': 804, 'BBB': 742, 'CCC': 742, 'DDD': 753, 'EEE': 804, 'FFF': 772, 'GGG': 731}
WBAG['HHH'] = 6074 - sum(WBAG.values())
CDR = {'/array_topic': 4, '/test_topic': 3}
TURTLE = {
    '/rosout': 10,
    '/tf': 2688,
    '/tf_static': 1,
    '/turtle1/cmd_vel': 357,
    '/turtle1/color_sensor': 1351,
    '/turtle1/pose': 1344,
    '/turtle2/cmd_vel': 208,
    '/turtle2/color_sensor': 1344,
    '/turtle2/pose': 1344,
}
# Messages by topic; a sentence: refused with it.
EXPECTED: dict[str, dict[str, int] | str] = {
    'rosbag2/ros2bag/test/resources/empty_bag': {},
    f'{PY}/mcap/convert_a': AB,
    f'{PY}/mcap/convert_b': AC,
    f'{PY}/mcap/reindex_test_bags/multiple_files': {'/chatter': 3177},
    f'{PY}/mcap/talker': TALKER,
    f'{PY}/mcap/wbag': WBAG,
    f'{PY}/sqlite3/convert_a': AB,
    f'{PY}/sqlite3/convert_b': AC,
    f'{PY}/sqlite3/reindex_test_bags/multiple_files': {'/chatter': 3177},
    f'{PY}/sqlite3/talker': TALKER,
    f'{PY}/sqlite3/wbag': WBAG,
    f'{TESTS}/mcap/bag_with_topics_and_service_events': EVENTS,
    f'{TESTS}/mcap/cdr_test': CDR,
    f'{TESTS}/mcap/wrong_rmw_test': "serialised as cdr, the file says 'wrong_format'",
    f'{TESTS}/sqlite3/bag_with_topics_and_service_events': EVENTS,
    f'{TESTS}/sqlite3/cdr_test': CDR,
    f'{TESTS}/sqlite3/wrong_rmw_test': "serialised as cdr, metadata.yaml says 'wrong_format'",
    f'{TRANSPORT}/mcap/rewriter_a': AB,
    f'{TRANSPORT}/mcap/rewriter_b': AC,
    f'{TRANSPORT}/mcap/test_bag_for_seek': {'topic1': 5},
    f'{TRANSPORT}/sqlite3/rewriter_a': AB,
    f'{TRANSPORT}/sqlite3/rewriter_b': AC,
    f'{TRANSPORT}/sqlite3/test_bag_for_seek': {'topic1': 5},
    f'{CPP}/only_services.mcap': {'/add_two_ints/_service_event': 12},
    f'{CPP}/only_topics.mcap': {'/parameter_events': 7},
    f'{CPP}/topics_and_services.mcap': {
        '/add_two_ints/_service_event': 6,
        '/parameter_events': 7,
    },
    f'{CPP}/topics_and_services.db3': {
        '/add_two_ints/_service_event': 6,
        '/parameter_events': 7,
    },
    'ros1/empty-file.bag': '0 bytes',
    'ros1/example.bag': TURTLE,
    'ros1/example-bz2.bag': TURTLE,
    'ros1/example-lz4.bag': TURTLE,
    'ros1/example-unsorted-chunks.bag': {'foo': 3},
    'ros1/no-messages.bag': {},
}

# Their types are known, or defined in the bag.
DECODED = [
    name
    for name, expected in EXPECTED.items()
    if name.endswith(('talker', '.bag')) and not isinstance(expected, str)
]

pytestmark = pytest.mark.skipif(not SHARED.is_dir(), reason=f'no bags of others in {SHARED}')


def test_no_bag_is_left_out() -> None:
    folders = {p.parent for end in ('mcap', 'db3') for p in SHARED.rglob(f'*.{end}')}
    loose = set((SHARED / CPP).iterdir()) | set((SHARED / 'ros1').glob('*.bag'))
    lying = (folders - {SHARED / CPP}) | loose
    assert {str(p.relative_to(SHARED)) for p in lying} == set(EXPECTED)


@pytest.mark.parametrize('name', EXPECTED)
def test_every_message_is_read_or_the_bag_refused(name: str) -> None:
    expected = EXPECTED[name]
    if isinstance(expected, str):
        with pytest.raises(BagError, match=expected):
            open_bag(SHARED / name)
        return
    with open_bag(SHARED / name) as bag:
        records = list(bag.records())
        assert Counter(record.topic for record in records) == expected
        assert bag.count == len(records)
        assert bag.complete
        assert [r.stamp for r in records] == sorted(r.stamp for r in records)


@pytest.mark.parametrize('name', DECODED)
def test_messages_decode_by_the_definitions_that_came_with_them(name: str) -> None:
    with open_bag(SHARED / name) as bag:
        topics = {(t.name, t.type): t for t in bag.topics}
        for record in bag.records():
            decode(topics[record.topic, record.type], record.data)


def test_the_same_bag_in_both_storages_has_the_same_messages() -> None:
    for name in ('convert_a', 'convert_b', 'wbag', 'talker'):
        with (
            open_bag(SHARED / PY / 'mcap' / name) as one,
            open_bag(SHARED / PY / 'sqlite3' / name) as other,
        ):
            assert Counter(one.records()) == Counter(other.records())
