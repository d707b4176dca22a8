"""Checks of what is in a bag, topic by topic."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Qos, QosDurability, QosReliability

from likeme_bags.adapting import bare
from likeme_bags.check_results import Verdict, fail, fine, warn
from likeme_bags.errors import LIBRARY_ERRORS, BagError, DamagedError
from likeme_bags.reading import Bag
from likeme_bags.topic_statistics import TopicFacts
from likeme_bags.typestores import typestore_of

# Topics of the cell whose subscribers want more than best effort: see the table of topics.
_RELIABLE = ('table_state', 'demonstration', 'goal_belief', 'decision', 'outcome')
_LATCHED = ('goal_belief', 'decision', 'outcome')
# 2000-01-01: an earlier log time was taken from a clock that was not set, ns.
_YEAR_2000 = 946_684_800 * 10**9
_DAY = 86_400 * 10**9


def _messages(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    if not bag.count:
        return fail('Expected messages, got none.')
    empty = [f.topic.name for f in facts if not f.stamps]
    if empty:
        return warn(f'{len(empty)} of {len(facts)} topics have no message: {_few(empty)}.')
    return fine('Every topic has messages.')


def _checksums(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    if bag.checksums:
        return fine('Checksums cover every message.')
    return warn('Not every message is under a checksum: a flipped bit in one may go unseen.')


def _start(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    if not bag.count:
        return fine('No messages, no times.')
    if bag.start < _YEAR_2000:
        return warn(f'The log times begin at {bag.start / 1e9:.3f} s, before the year 2000.')
    if bag.end > time.time_ns() + _DAY:
        return warn(f'The log times end at {bag.end / 1e9:.3f} s, in the future.')
    return fine('The log times are those of a set clock.')


def _headers_rise(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    falling = {f: int((np.diff(f.header_times) < 0).sum()) for f in facts}
    falling = {f: n for f, n in falling.items() if n}
    if not falling:
        return fine('Header stamps never go back.')
    # Several publishers on one topic, as on /tf, mix their stamps; a camera is alone.
    worst = next((f for f in falling if f.is_camera), next(iter(falling)))
    tell = fail if worst.is_camera else warn
    more = f' ({len(falling)} topics in all)' if len(falling) > 1 else ''
    return tell(f'Header stamps go back {falling[worst]} times on {worst.topic.name}{more}.')


def _headers_near(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    far = {}
    for fact in facts:
        if len(fact.headers) == len(fact.stamps) and fact.headers:
            far[fact.topic.name] = float(np.abs(fact.log_times - fact.header_times).max()) / 1e9
    name = max(far, key=far.__getitem__, default='')
    if name and far[name] > 1.0:
        return warn(f'Header stamps and log times of {name} lie up to {far[name]:.3g} s apart.')
    return fine('Header stamps lie within 1 s of the log times.')


def _headers_set(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    zero = [f.topic.name for f in facts if f.headers and not f.header_times.any()]
    if zero:
        return fail(f'Header stamps are all zero on {_few(zero)}.')
    return fine('Header stamps are set.')


def _gaps(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    """Cameras must be without gaps; other steady streams may have been stopped."""
    gaps = [(fact, _gaps_of(fact.times)) for fact in facts]
    found = [(fact, steps) for fact, steps in gaps if len(steps)]
    if not found:
        return fine('No gaps in steady streams.')
    fact, steps = max(found, key=lambda pair: (pair[0].is_camera, pair[1].max()))
    period = float(np.median(np.diff(fact.times)))
    lost = int((steps / period - 1).round().sum())
    tell = fail if fact.is_camera else warn
    return tell(
        f'{fact.topic.name} ({1e9 / period:.1f} Hz) lacks about {lost} messages in {len(steps)} '
        f'gaps, the longest {steps.max() / 1e9:.2f} s.'
    )


def _gaps_of(times: NDArray[np.int64]) -> NDArray[np.int64]:
    """Steps of more than 2.5 periods in a steady stream, ns; none where it is not steady."""
    steps = np.diff(times)
    period = float(np.median(steps)) if len(steps) >= 10 else 0.0
    # Steady: nine in ten steps near the median.
    if period <= 0 or (np.abs(steps - period) < 0.5 * period).mean() < 0.9:
        return steps[:0]
    return steps[steps > 2.5 * period]


def _repeats(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    repeated = {f.topic.name: f.repeated for f in facts if f.repeated}
    if repeated:
        total = sum(repeated.values())
        return warn(f'{total} messages are recorded twice, on {_few(list(repeated))}.')
    return fine('No message is recorded twice.')


def _clock(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    clocks = [f for f in facts if f.topic.type == 'rosgraph_msgs/msg/Clock']
    if not clocks:
        return fine('No clock is recorded.')
    if len({f.topic.name for f in clocks}) > 1:
        return fail(f'Expected one clock, got {_few([f.topic.name for f in clocks])}.')
    return fine(f'One clock is recorded, on {clocks[0].topic.name}.')


def _decodes(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    broken = [f for f in facts if f.errors]
    if broken:
        return fail(f'{broken[0].topic.name}: {broken[0].errors[0]}')
    return fine('Messages decode by their definitions (25 a topic).')


def _definitions(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    unknown, missing = [], []
    for topic in bag.topics:
        try:
            typestore_of(topic)
            if not topic.definition:
                missing.append(topic.type)
        except DamagedError as error:
            unknown.append(str(error))
    if unknown:
        return warn(unknown[0])
    if missing:
        return warn(f'Not embedded, known from Jazzy: {_few(sorted(set(missing)))}.')
    return fine('Every type is defined in the bag.')


def _hashes(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
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
    return fine(f'{checked} type hashes agree with their definitions.')


def _names(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    relative = [t.name for t in bag.topics if not t.name.startswith('/')]
    if relative:
        return warn(f'Names that a player will make absolute: {_few(relative)}.')
    twice = [t.name for t in bag.topics if sum(o.name == t.name for o in bag.topics) > 1]
    if twice:
        return fail(f'Expected one type a topic, got two on {twice[0]}.')
    return fine('Topic names are absolute, each with one type.')


def _matches(bag: Bag, facts: Sequence[TopicFacts]) -> Verdict:
    """Whether the cell's own subscribers would match what a player offers."""
    for topic in bag.topics:
        name = bare(topic.name)
        for problem in _mismatches(name, topic.qos):
            return fail(f'{topic.name} {problem}, so subscribers in the cell would not match it.')
    bare_topics = [t.name for t in bag.topics if not t.qos]
    if bare_topics:
        return warn(f'No QoS is recorded for {_few(bare_topics)}: a player will take defaults.')
    return fine("Every recorded QoS matches the cell's subscribers.")


def _mismatches(name: str, qos: Sequence[Qos]) -> Iterator[str]:
    if name in _RELIABLE and any(q.reliability == QosReliability.BEST_EFFORT for q in qos):
        yield 'is best effort'
    if name in _LATCHED and any(q.durability == QosDurability.VOLATILE for q in qos):
        yield 'is volatile'


def _few(names: Sequence[str]) -> str:
    """The first three of a list, and how many more."""
    more = f' and {len(names) - 3} more' if len(names) > 3 else ''
    return ', '.join(names[:3]) + more


TOPIC_CHECKS: dict[str, Callable[[Bag, Sequence[TopicFacts]], Verdict]] = {
    'checksums': _checksums,
    'messages': _messages,
    'log times': _start,
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
