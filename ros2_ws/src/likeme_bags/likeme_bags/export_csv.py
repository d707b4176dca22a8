"""`bag.sh export --format csv`: one table for each topic."""

from __future__ import annotations

import csv
from collections.abc import Collection
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from likeme_bags.errors import BagError
from likeme_bags.export_result import Exported
from likeme_bags.flattening import flatten
from likeme_bags.reading import Bag
from likeme_bags.topic_names import distinct, file_stems, rename_remarks, topics_to_export
from likeme_bags.typestores import decode, typestore_of
from likeme_bags.values import Topic


def export_csv(bag: Bag, folder: Path, topics: Collection[str] | None = None) -> Exported:
    """Write `folder`/TOPIC.csv for every topic with messages: log time (ns), then its fields.

    Long arrays, as those of images and point clouds, are given by their length.

    Raises:
        UnsupportedError: a topic's type is not known, or its definition cannot be used.
        BagError: there are no messages, or one does not decode.
    """
    stems = file_stems(bag.topics)
    chosen = {topic.key: topic for topic in topics_to_export(bag, topics)}
    for topic in chosen.values():
        # Before anything is written.
        typestore_of(topic)
    paths: dict[Topic, Path] = {}
    with ExitStack() as stack:
        # A writer and its columns, by topic and columns: of a type that is defined in two ways
        # with the same fields, all messages are in one table.
        writers: dict[tuple[str, ...], tuple[Any, list[str]]] = {}
        tables: dict[Topic, tuple[Any, list[int]]] = {}
        for record in bag.records({topic.name for topic in chosen.values()}):
            topic = chosen[record.key]
            fields = list(flatten(decode(topic, record.data)))
            if topic not in tables:
                columns = distinct(['log_time', *(name for name, _ in fields)], '_')
                same = (topic.name, topic.type, *sorted(columns))
                if same not in writers:
                    paths[topic] = folder / f'{stems[topic]}.csv'
                    file = paths[topic].open('w', newline='', encoding='utf-8')
                    writers[same] = csv.writer(stack.enter_context(file)), columns
                    writers[same][0].writerow(columns)
                writer, order = writers[same]
                tables[topic] = writer, [columns.index(name) for name in order]
            writer, places = tables[topic]
            row = [record.stamp, *(value for _, value in fields)]
            writer.writerow([row[place] for place in places])
    if not paths:
        raise BagError(f'Expected messages to export in {bag.path.name}, got none.')
    remarks = rename_remarks({topic.name: stems[topic] for topic in paths}, '-')
    return Exported(list(paths.values()), remarks, bag.complete)
