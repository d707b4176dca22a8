"""The same log every time: lockstep runs through real nodes, at mixed rates, all cores busy."""

from __future__ import annotations

import hashlib
import sys
import time
from itertools import cycle, islice
from pathlib import Path
from typing import NamedTuple

import rclpy
from domain_coordinator import domain_id

from bags_parts import Effort, Measured
from busy_cores import busy_cores
from likeme_bags.reading import open_bag
from likeme_replay.managed_nodes import managed_nodes
from likeme_replay.offline_replay import replay_bag
from likeme_replay.playback_control import PlaybackControl
from likeme_replay.recorded_inputs import RecordedInputs
from likeme_replay.ros.lockstep_node import LockstepNode
from likeme_replay.source_adapters import adapted_source
from report import Bar

BAGS = Path(__file__).resolve().parents[2] / 'bags'
PLAYED = tuple(sorted(path.parent.name for path in BAGS.glob('*/metadata.yaml')))
#: Recorded s per s; 0: as fast as it is acknowledged.
RATES = 0.0, 4.0, 10.0, 30.0
#: s that all runs together may take.
LIMIT = 4 * 3600.0


class Run(NamedTuple):
    """One run: what was played, at what rate, the SHA-256 of its log."""

    bag: str
    rate: float
    digest: str


def measure(effort: Effort) -> Measured:
    """The number of distinct logs of a bag, the shipped one counted among them."""
    begin = time.monotonic()
    runs = lockstep_runs(effort.runs)
    seconds = time.monotonic() - begin
    logs = {
        name: {_digest(shipped(name))} | {run.digest for run in runs if run.bag == name}
        for name in {run.bag for run in runs}
    }
    most = max(map(len, logs.values()))
    strange = [run for run in runs if run.digest != _digest(shipped(run.bag))]
    return [
        Bar('distinct logs of a bag, lockstep, cores busy', most, 1, '', 'requirement', len(runs)),
        Bar('a lockstep run, cores busy', seconds / len(runs), None, 's', n=len(runs)),
    ], {
        'lockstep runs': f'{len(logs)} bags in turn, at the rates {RATES}',
        'logs that differ from the shipped one': [f'{r.bag} at {r.rate:g}' for r in strange],
    }


def lockstep_runs(count: int) -> list[Run]:
    """Play the bags in turn, each at all rates, with nodes that start anew for every run."""
    runs = []
    with domain_id() as domain, managed_nodes(domain, {}), busy_cores(LIMIT):
        rclpy.init(domain_id=domain)
        try:
            # 33 bags and four rates: with every round of the bags each meets another rate.
            turns = islice(zip(cycle(PLAYED), cycle(RATES), strict=False), count)
            for number, (name, rate) in enumerate(turns, 1):
                log = lockstep_log(BAGS / name, rate)
                runs.append(Run(name, rate, _digest(log.encode())))
                said = 'as shipped' if log.encode() == shipped(name) else 'ANOTHER LOG'
                told = f'lockstep run {number} of {count}: {name} at {rate:g}: {said}'
                print(told, file=sys.stderr, flush=True)
        finally:
            rclpy.try_shutdown()
    return runs


def lockstep_log(path: Path, rate: float) -> str:
    """The log of one lockstep run with the nodes that run."""
    node = LockstepNode(PlaybackControl(rate))
    try:
        node.begin()
        with open_bag(path) as bag:
            inputs = RecordedInputs(adapted_source({}, {})(bag, None, None))
            return replay_bag(inputs, bag, node).log
    finally:
        node.close()


def shipped(name: str) -> bytes:
    """The log that lies beside a bag."""
    return (BAGS / f'{name}.jsonl').read_bytes()


def _digest(log: bytes) -> str:
    return hashlib.sha256(log).hexdigest()
