"""The summary of a bag that `bag.sh info` prints."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from likeme_bags.reading import Bag
from likeme_bags.sampling import time_jumps
from likeme_bags.text_output import one_line


def bag_summary(bag: Bag) -> dict[str, Any]:
    """The summary as values for JSON. Times in ns, sizes in bytes, rates in Hz."""
    topics = [
        {
            'name': topic.name,
            'type': topic.type,
            'messages': topic.count,
            'rate': round(_rate(bag.stamps(topic.name)), 2),
            'reliability': [q.reliability.name.lower() for q in topic.qos],
            'durability': [q.durability.name.lower() for q in topic.qos],
            'defined': bool(topic.definition),
        }
        for topic in bag.topics
    ]
    return {
        'bag': str(bag.path),
        'files': [file.name for file in bag.files],
        'size': sum(file.stat().st_size for file in bag.files),
        'version': bag.metadata.version if bag.metadata else None,
        'start': bag.start,
        'end': bag.end,
        'messages': bag.count,
        'complete': bag.complete,
        'topics': topics,
        'custom': dict(bag.custom),
        'attachments': [str(each) for each in bag.attachments],
        'warnings': list(bag.warnings),
    }


def _rate(stamps: NDArray[np.int64]) -> float:
    """Messages per second between the first and the last of a topic, without clock jumps."""
    jumps = time_jumps(stamps)
    span = int(stamps[-1] - stamps[0]) if len(stamps) > 1 else 0
    span -= int(np.diff(jumps, axis=1).sum())
    return (len(stamps) - 1 - len(jumps)) * 1e9 / span if span > 0 else 0.0


def summary_text(summary: dict[str, Any]) -> str:
    """The summary as lines of text."""
    seconds = (summary['end'] - summary['start']) / 1e9
    files = ', '.join(summary['files'][:3]) + (' ...' if len(summary['files']) > 3 else '')
    lines = [
        f'{summary["bag"]}: {files}, {summary["size"] / 1e6:.1f} MB',
        f'{summary["messages"]} messages in {seconds:.3f} s, from {_date(summary["start"])}',
    ]
    names = [one_line(topic['name']) for topic in summary['topics']]
    width = max(map(len, names), default=0)
    for name, topic in zip(names, summary['topics'], strict=True):
        qos = '/'.join(dict.fromkeys(topic['reliability'] + topic['durability'])) or 'no QoS'
        lines.append(
            f'  {name:{width}}  {topic["messages"]:6}  {topic["rate"]:7.2f} Hz  '
            f'{topic["type"]}  {qos}'
        )
    lines += ['  ' + one_line(f'{key} = {value}') for key, value in summary['custom'].items()]
    lines += ['  ' + one_line(each) for each in summary['attachments']]
    return '\n'.join(lines)


def _date(stamp: int) -> str:
    """A log time as a date in UTC, or as seconds when no clock was set."""
    seconds = stamp / 1e9
    if seconds < 1e8:
        return f'{seconds:.3f} s'
    return datetime.fromtimestamp(seconds, UTC).strftime('%Y-%m-%d %H:%M:%S UTC')
