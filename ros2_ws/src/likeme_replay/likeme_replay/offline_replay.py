"""A bag straight through the cores: no network, no waiting, the same log."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from likeme_bags.reading import Bag, open_bag
from likeme_replay.decision_log import Entry
from likeme_replay.in_process import Cores
from likeme_replay.input_scheduler import Stage, Tally, perform
from likeme_replay.live_agreement import Agreement, compare, recorded_entries
from likeme_replay.recorded_inputs import Script
from likeme_replay.source_adapters import ReadSource, adapted


class Replayed(NamedTuple):
    """How a replay went: its log, what it came to, what was wrong with the bag.

    agreements: with what the bag itself says its live run came to; none where it says nothing.
    """

    entries: list[Entry]
    tally: Tally
    warnings: tuple[str, ...]
    complete: bool
    agreements: tuple[Agreement, ...] = ()

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
) -> Replayed:
    """Replay a bag in this process, as fast as it goes.

    Args:
        path: the bag.
        parameters: of 'perception_node' and 'inference_node', where they differ from the defaults.
        source: how records are read from the bag; None: by the names that are known.
        start: log time from which records count, ns.
        end: log time up to which they do.

    Raises:
        BagError: the bag cannot be replayed.
        ValueError: a parameter makes no sense.
    """
    nodes = ('perception_node', 'inference_node')
    cores = Cores(*(parameters.get(node) for node in nodes))
    with open_bag(path) as bag:
        return replayed(Script((source or adapted({}, {}))(bag, start, end)), bag, cores)


def replayed(script: Script, bag: Bag, stage: Stage) -> Replayed:
    """Perform the script of a bag on a stage; how it went."""
    entries: list[Entry] = []
    tally = perform(script.steps(), script.live, stage, entries.append)
    tally.misfits = stage.misfits
    tally.unpaired, tally.unread = script.unpaired, script.unread
    tally.unreadable = script.unreadable
    agreements = tuple(compare(recorded_entries(bag), entries))
    return Replayed(entries, tally, bag.warnings, bag.complete, agreements)
