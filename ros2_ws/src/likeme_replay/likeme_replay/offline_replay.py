"""Replay of a bag, by default in this process and without a network."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from likeme_bags.reading import Bag, open_bag
from likeme_replay.decision_log import LogEntry
from likeme_replay.in_process import InProcessGraph
from likeme_replay.input_scheduler import ReplayTarget, run_replay
from likeme_replay.live_agreement import EventAgreement, compare, recorded_entries
from likeme_replay.recorded_inputs import RecordedInputs
from likeme_replay.replay_counts import ReplayCounts
from likeme_replay.source_adapters import ReadSource, adapted_source


class ReplayResult(NamedTuple):
    """The log of a replay, its counts, and what was wrong with the bag.

    complete: the whole bag could be read. agreements: with the events of the live run, if the bag
    holds any.
    """

    entries: list[LogEntry]
    counts: ReplayCounts
    warnings: tuple[str, ...]
    complete: bool
    agreements: tuple[EventAgreement, ...] = ()

    @property
    def log(self) -> str:
        """The decision log as text."""
        return ''.join(f'{entry.line}\n' for entry in self.entries)


def replay_offline(
    path: Path,
    parameters: Mapping[str, Mapping[str, Any]] = {},
    source: ReadSource | None = None,
    start: int | None = None,
    end: int | None = None,
) -> ReplayResult:
    """Replay a bag in this process, as fast as possible.

    Args:
        path: the bag.
        parameters: of 'perception_node' and 'inference_node', where they differ from the defaults.
        source: how records are read from the bag; None: by known topic names.
        start: log time of the first record to use, ns.
        end: log time of the last one.

    Raises:
        BagError: the bag cannot be replayed.
        ValueError: a parameter is invalid.
    """
    nodes = ('perception_node', 'inference_node')
    target = InProcessGraph(*(parameters.get(node) for node in nodes))
    with open_bag(path) as bag:
        inputs = RecordedInputs((source or adapted_source({}, {}))(bag, start, end))
        return replay_bag(inputs, bag, target)


def replay_bag(inputs: RecordedInputs, bag: Bag, target: ReplayTarget) -> ReplayResult:
    """Replay the inputs of a bag into a target."""
    entries: list[LogEntry] = []
    counts = run_replay(inputs.steps(), inputs.live, target, entries.append)
    counts.unpaired, counts.unread = inputs.unpaired, inputs.unread
    counts.unreadable, counts.info_changes = inputs.unreadable, inputs.info_changes
    agreements = tuple(compare(recorded_entries(bag), entries))
    return ReplayResult(entries, counts, bag.warnings, bag.complete, agreements)
