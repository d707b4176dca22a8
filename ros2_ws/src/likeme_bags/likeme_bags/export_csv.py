"""`bag.sh export --format csv`: one table a topic."""

from __future__ import annotations

import csv
from collections.abc import Collection
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from likeme_bags.errors import BagError, DamagedError
from likeme_bags.flattening import flat
from likeme_bags.reading import Bag
from likeme_bags.typestores import decode, typestore_of
from likeme_bags.values import Topic


def export_csv(bag: Bag, folder: Path, topics: Collection[str] | None = None) -> list[Path]:
    """Write `folder`/TOPIC.csv for every topic with messages: log time (ns), then its fields.

    Pictures and clouds are given by their number of bytes.

    Raises:
        BagError: a topic's type is not known, or a message of it does not decode.
    """
    written: dict[str, Path] = {}
    with ExitStack() as stack:
        tables: dict[str, Any] = {}
        known = {(t.name, t.type, t.schema): t for t in bag.topics}
        for topic in known.values():
            if topic.count and (topics is None or topic.name in topics):
                _check(topic)
        for record in bag.records(topics):
            topic = known[record.topic, record.type, record.schema]
            row = {'log_time': record.stamp, **dict(flat(decode(topic, record.data)))}
            if topic.name not in tables:
                path = folder / f'{topic.file_stem}.csv'
                file = stack.enter_context(path.open('w', newline='', encoding='utf-8'))
                tables[topic.name] = csv.DictWriter(file, list(row), restval='')
                tables[topic.name].writeheader()
                written[topic.name] = path
            tables[topic.name].writerow(row)
    if not written:
        raise BagError(f'Expected messages to export in {bag.path.name}, got none.')
    return list(written.values())


def _check(topic: Topic) -> None:
    """Refuse a topic that cannot be decoded before anything is written."""
    try:
        typestore_of(topic)
    except DamagedError as error:
        raise BagError(f'{error} Choose others with --topics.') from None
