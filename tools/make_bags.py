"""Makes the shipped recordings: bags, expected logs and README table, without a ROS graph.

scripts/run.sh python tools/make_bags.py [NAME ...] [--out DIR]   (about 10 minutes for all)
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from bag_recipes import Recipe
from bag_recipes import recipes as all_recipes
from bag_scene import SuiteScene
from likeme_bags.durable import DurableMcap, DurableWriter
from likeme_bags.values import Record
from likeme_core.paper_world import WORLD
from likeme_core.tabletop import Manner
from likeme_core.world import load_world
from likeme_core.world.file import DEFAULT_WORLD
from likeme_inference.tabletop.action_selection import Kind
from likeme_replay.decision_log import LogEvent
from likeme_replay.message_definitions import definitions
from likeme_replay.offline_replay import replay_offline
from likeme_replay.recorded_parameters import KEY, WORLD_KEY, in_world

#: Reliable, as the arm driver offers its images.
OFFERED = Qos(
    QosHistory.KEEP_LAST, 10, QosReliability.RELIABLE, QosDurability.VOLATILE,
    QosTime(0, 0), QosTime(0, 0), QosLiveliness.AUTOMATIC, QosTime(0, 0), False,
)  # fmt: skip
#: Of zstd: packed once, unpacked by everybody.
LEVEL = 17
HEADER = """\
# Recorded demonstrations

Every object, every interesting change of state and both manners of the paper, and what else people
do, before the simulated cell's camera: 640x480 colour and registered depth at 12 Hz with
camera_info, MCAP. Made by `./scripts/run.sh python tools/make_bags.py`; replayed by

    ./scripts/replay.sh bags/pear_right_left_place --offline --log -

The images are raw `sensor_msgs/Image`: they play into any node without being decoded, and depth
loses nothing. They are small because nearly all bytes of a Kinect's recording are its noise: here
the published depth noise takes turns of two patterns and colours have no grain, so that what does
not move is stored once a chunk. Perception is measured on fresh noise elsewhere
(`./scripts/bench.sh perception`).

In the bags with a put back the experimenter sets the object back between two frames; the robot
then has its turn. `story_` bags go on: what the arm or the operator said to the session is in the
topic `heard`. Beside each bag lies the decision log expected of it (`NAME.jsonl`); a test replays
all of them and compares every byte, and reads this table's rows against the logs.

| bag | seed | what is shown | demonstration | goal | decision, outcome |
| --- | --- | --- | --- | --- | --- |
"""


def write_suite(folder: Path, recipes: Sequence[Recipe]) -> None:
    """Write all recipes into a folder, over those of the same names, and its README.md."""
    folder.mkdir(parents=True, exist_ok=True)
    for recipe in recipes:
        log = write_bag(folder / recipe.name, recipe)
        (folder / f'{recipe.name}.jsonl').write_text(log, encoding='utf-8')
        print(row(recipe, log))
    (folder / 'README.md').write_text(readme(folder), encoding='utf-8')


def readme(folder: Path) -> str:
    """The table of every recording whose expected log lies in a folder."""
    logs = [(recipe, folder / f'{recipe.name}.jsonl') for recipe in all_recipes()]
    rows = [
        row(recipe, path.read_text(encoding='utf-8')) for recipe, path in logs if path.exists()
    ]
    return HEADER + '\n'.join(rows) + '\n'


def write_bag(path: Path, recipe: Recipe) -> str:
    """Record one recipe and give the log its replay leads to.

    Raises:
        ValueError: the replay does not lead to what the scene led to.
    """
    shutil.rmtree(path, ignore_errors=True)
    custom = {'likeme.recipe': recipe.name, 'likeme.seed': str(recipe.seed)}
    parameters = {}
    if recipe.world != DEFAULT_WORLD:
        parameters = in_world({}, recipe.world)
        label = load_world(recipe.world).label
        custom |= {KEY: json.dumps(parameters), WORLD_KEY: label}
    with _Recording(path, custom=custom) as recording:
        scene = SuiteScene(recipe, recording.take)
        scene.play()
    replayed = replay_offline(path, parameters)
    expected = ''.join(f'{entry.line}\n' for entry in scene.entries)
    if replayed.log != expected:
        raise ValueError(f'{path}: expected the log of the scene itself, got another one.')
    return replayed.log


class _Recording(DurableWriter):
    """A writer that knows the topics of the cell, with chunks of some seconds."""

    def open(self) -> None:
        super().open()
        self._known: dict[str, Connection] = {}
        storage = self.storage
        assert isinstance(storage, DurableMcap)
        # Some 130 frames: what does not move is stored once a chunk.
        storage.chunk_size, storage.level = 200 * 2**20, LEVEL

    def take(self, record: Record) -> None:
        """Write a record of the cell."""
        if record.topic not in self._known:
            text, digest = definitions().of(record.type)
            self._known[record.topic] = self.add_connection(
                f'/{record.topic}', record.type, msgdef=text, rihs01=digest,
                offered_qos_profiles=[OFFERED],
            )  # fmt: skip
        self.write(self._known[record.topic], record.stamp, record.data)


def row(recipe: Recipe, log: str) -> str:
    """A bag's line of the table, from its log."""
    events = [json.loads(line) for line in log.splitlines()]
    shown = _joined(_act(e) for e in events if e['event'] == LogEvent.DEMONSTRATION)
    goals = _joined(
        f'{e["object"]} {WORLD.state(e["goal"]).name} {e["posterior"][e["goal"]]:.2f}'
        for e in events
        if e['event'] == LogEvent.BELIEF
    )
    ends = _joined(_end(e) for e in events if e['event'] in (LogEvent.DECISION, LogEvent.OUTCOME))
    return f'| `{recipe.name}` | {recipe.seed} | {recipe.shows} | {shown} | {goals} | {ends} |'


def _act(event: dict[str, Any]) -> str:
    x_i, x_f = WORLD.state(event['x_i']).name, WORLD.state(event['x_f']).name
    return f'{event["object"]} {x_i} to {x_f} by {Manner(event["manner"]).name}'


def _end(event: dict[str, Any]) -> str:
    if event['event'] == LogEvent.OUTCOME:
        return f'{event["object"]} {WORLD.state(event["x_f"]).name}'
    kind = Kind(event['kind'])
    if kind in (Kind.AT_GOAL, Kind.NO_ACTION):
        return kind.name
    return f'{kind.name} {WORLD.action(event["action"]).name} {event["predicted_success"]:.2f}'


def _joined(parts: Iterable[str]) -> str:
    return '; '.join(parts) or 'none'


def main() -> None:
    """Write the bags that are named, or all."""
    known = {recipe.name: recipe for recipe in all_recipes()}
    parser = argparse.ArgumentParser(prog='make_bags', description=__doc__)
    parser.add_argument('name', nargs='*', help='shipped recording; all when none is named')
    parser.add_argument('--out', type=Path, default=Path('bags'))
    given = parser.parse_args()
    for name in given.name:
        if name not in known:
            parser.error(f'expected one of {", ".join(known)}, got {name}')
    write_suite(given.out, [r for r in known.values() if not given.name or r.name in given.name])


if __name__ == '__main__':
    main()
