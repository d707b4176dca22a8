"""Checks of `bag.sh doctor` that apply to any topic."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Qos, QosDurability, QosReliability

from likeme_bags.camera_topics import without_slash
from likeme_bags.check_results import CheckResult, fail, ok, warn
from likeme_bags.errors import LIBRARY_ERRORS, BagError, UnsupportedError
from likeme_bags.reading import Bag
from likeme_bags.sampling import CLOCK_SET
from likeme_bags.topic_statistics import TopicStatistics
from likeme_bags.typestores import typestore_of

# Topics of the cell whose subscribers ask for more than best effort: see the table of topics.
_RELIABLE = ('table_state', 'demonstration', 'goal_belief', 'decision', 'outcome')
_LATCHED = ('goal_belief', 'decision', 'outcome')
_DAY = 86_400 * 10**9


def _messages(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    if not bag.count:
        return fail('Expected messages, got none.')
    empty = [f.topic.name for f in statistics if not f.stamps]
    if empty:
        return warn(f'{len(empty)} of {len(statistics)} topics have no message: {_few(empty)}.')
    return ok('Every topic has messages.')


def _checksums(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    if bag.checksums:
        return ok('Checksums cover every message.')
    return warn('Not every message is under a checksum: a flipped bit in one may go unseen.')


def _log_times(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    if not bag.count:
        return ok('No messages, no times.')
    if bag.start < CLOCK_SET:
        return warn(f'The log times begin at {bag.start / 1e9:.3f} s, before the year 2000.')
    if bag.end > time.time_ns() + _DAY:
        return warn(f'The log times end at {bag.end / 1e9:.3f} s, in the future.')
    return ok('The log times are those of a set clock.')


def _headers_rise(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    falling = {f: int((np.diff(f.header_times) < 0).sum()) for f in statistics}
    falling = {f: n for f, n in falling.items() if n}
    if not falling:
        return ok('Header stamps never go back.')
    # Several publishers on one topic, as on /tf, mix their stamps; a camera is alone.
    worst = next((f for f in falling if f.is_camera), next(iter(falling)))
    tell = fail if worst.is_camera else warn
    more = f' ({len(falling)} topics in all)' if len(falling) > 1 else ''
    return tell(f'Header stamps go back {falling[worst]} times on {worst.topic.name}{more}.')


def _headers_near(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    far = {}
    for stats in statistics:
        if len(stats.headers) == len(stats.stamps) and stats.headers:
            far[stats.topic.name] = float(np.abs(stats.log_times - stats.header_times).max()) / 1e9
    name = max(far, key=far.__getitem__, default='')
    if name and far[name] > 1.0:
        return warn(f'Header stamps and log times of {name} lie up to {far[name]:.3g} s apart.')
    return ok('Header stamps lie within 1 s of the log times.')


def _headers_set(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    zero = [f.topic.name for f in statistics if f.headers and not f.header_times.any()]
    if zero:
        return fail(f'Header stamps are all zero on {_few(zero)}.')
    return ok('Header stamps are set.')


def _gaps(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    """Cameras must be without gaps; other steady streams may have been stopped."""
    gaps = [(stats, _gaps_of(stats.times)) for stats in statistics]
    found = [(stats, steps) for stats, steps in gaps if len(steps)]
    if not found:
        return ok('No gaps in steady streams.')
    stats, steps = max(found, key=lambda pair: (pair[0].is_camera, pair[1].max()))
    period = float(np.median(np.diff(stats.times)))
    lost = int((steps / period - 1).round().sum())
    tell = fail if stats.is_camera else warn
    return tell(
        f'{stats.topic.name} ({1e9 / period:.1f} Hz) lacks about {lost} messages in {len(steps)} '
        f'gaps, the longest {steps.max() / 1e9:.2f} s.'
    )


def _gaps_of(times: NDArray[np.int64]) -> NDArray[np.int64]:
    """Steps of more than 2.5 periods in a steady stream, ns; none where it is not steady.

    The step from a clock that was not set to one that was is no gap.
    """
    steps = np.diff(times)[(times[:-1] >= CLOCK_SET) | (times[1:] < CLOCK_SET)]
    period = float(np.median(steps)) if len(steps) >= 10 else 0.0
    # Steady: nine in ten steps near the median.
    if period <= 0 or (np.abs(steps - period) < 0.5 * period).mean() < 0.9:
        return steps[:0]
    return steps[steps > 2.5 * period]


def _repeats(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    repeated = {f.topic.name: f.repeated for f in statistics if f.repeated}
    if repeated:
        total = sum(repeated.values())
        return warn(f'{total} messages are recorded twice, on {_few(list(repeated))}.')
    return ok('No message is recorded twice.')


def _clock(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    clocks = [f for f in statistics if f.topic.type == 'rosgraph_msgs/msg/Clock']
    if not clocks:
        return ok('No clock is recorded.')
    if len({f.topic.name for f in clocks}) > 1:
        return fail(f'Expected one clock, got {_few([f.topic.name for f in clocks])}.')
    return ok(f'One clock is recorded, on {clocks[0].topic.name}.')


def _decodes(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    for stats in statistics:
        if stats.errors:
            return fail(stats.errors[0])
    if unsupported := [s for s in statistics if s.unsupported]:
        more = f' ({len(unsupported)} topics in all)' if len(unsupported) > 1 else ''
        return warn(f'Not checked: {unsupported[0].unsupported}{more}')
    return ok('Messages decode by their definitions (25 a topic).')


def _definitions(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    missing = []
    for topic in bag.topics:
        try:
            typestore_of(topic)
            if not topic.definition:
                missing.append(topic.type)
        except UnsupportedError as error:
            return warn(str(error))
    if missing:
        return warn(f'Not embedded, known from Jazzy: {_few(sorted(set(missing)))}.')
    return ok('Every type is defined in the bag.')


def _hashes(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    checked = 0
    for topic in bag.topics:
        if not (topic.definition and topic.type_hash.startswith('RIHS01_')):
            continue
        try:
            found = typestore_of(topic).hash_rihs01(topic.type)
        except (*LIBRARY_ERRORS, BagError):
            continue
        checked += 1
        if found != topic.type_hash:
            return warn(f'{topic.type}: expected {topic.type_hash[:20]}..., got {found[:20]}...')
    return ok(f'{checked} type hashes agree with their definitions.')


def _names(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    relative = [t.name for t in bag.topics if not t.name.startswith('/')]
    if relative:
        return warn(f'Names that a player will make absolute: {_few(relative)}.')
    types = {(topic.name, topic.type) for topic in bag.topics}
    twice = [t.name for t in bag.topics if sum(name == t.name for name, _ in types) > 1]
    if twice:
        return fail(f'Expected one type a topic, got two on {twice[0]}.')
    return ok('Topic names are absolute, each with one type.')


def _matches(bag: Bag, statistics: Sequence[TopicStatistics]) -> CheckResult:
    """Whether the cell's own subscribers would match what a player offers."""
    for topic in bag.topics:
        name = without_slash(topic.name)
        for problem in _mismatches(name, topic.qos):
            return fail(f'{topic.name} {problem}, so subscribers in the cell would not match it.')
    bare_topics = [t.name for t in bag.topics if not t.qos]
    if bare_topics:
        return warn(f'No QoS is recorded for {_few(bare_topics)}: a player will take defaults.')
    return ok("Every recorded QoS matches the cell's subscribers.")


def _mismatches(name: str, qos: Sequence[Qos]) -> Iterator[str]:
    if name in _RELIABLE and any(q.reliability == QosReliability.BEST_EFFORT for q in qos):
        yield 'is best effort'
    if name in _LATCHED and any(q.durability == QosDurability.VOLATILE for q in qos):
        yield 'is volatile'


def _few(names: Sequence[str]) -> str:
    """The first three of a list, and how many more."""
    more = f' and {len(names) - 3} more' if len(names) > 3 else ''
    return ', '.join(names[:3]) + more


TOPIC_CHECKS: dict[str, Callable[[Bag, Sequence[TopicStatistics]], CheckResult]] = {
    'checksums': _checksums,
    'messages': _messages,
    'log times': _log_times,
    'header order': _headers_rise,
    'header offset': _headers_near,
    'header set': _headers_set,
    'gaps': _gaps,
    'repeats': _repeats,
    'clock': _clock,
    'decoding': _decodes,
    'definitions': _definitions,
    'type hashes': _hashes,
    'names': _names,
    'qos match': _matches,
}
