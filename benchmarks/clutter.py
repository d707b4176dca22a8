"""Acts of the simulated robot on tables with 2 to 7 objects: whether it moves the others.

    ./scripts/bench.sh clutter [--acts N] [--seed S] [--json]

N seeded acts (500), in turn in the worlds chung2015 and three_bins, with objects of both. Each act
is made again with its object alone at the same place. Headless: perception is replaced by an error
model (likeme_arm_sim/headless_trial.py), and what moved is read from the simulator's true poses.
Exit code 1 if a bar is missed.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from likeme_arm_sim.cell import SETTLING_TIME, Cell, MotionResult
from likeme_arm_sim.headless_trial import SimulatedPerception, wait_until_at_rest
from likeme_arm_sim.layout import SPACING, TRIES, Placement
from likeme_core.geometry import Rectangle
from likeme_core.outcomes import Actor, MotionOutcome
from likeme_core.tabletop import Action
from likeme_core.world import World, load_world
from report import Bar, option_parser, publish, whole_number

WORLDS = 'chung2015', 'three_bins'
#: Numbers of objects on the table.
FEWEST, MOST = 2, 7
#: Distance from which on a bystander was moved, m.
MOVED = 0.01
#: Least distance of another object's centre from the border of its region, m.
BORDER = 0.03
#: Seeds of acts: none of learning or of the fit.
FIRST_SEED = 900_000


class Act(NamedTuple):
    """One act: on the first object of `layout`, which has places on the table by name."""

    seed: int
    world: str
    layout: Mapping[str, Placement]
    action: Action

    @property
    def object(self) -> str:
        """The object that is acted on."""
        return next(iter(self.layout))


class ActResult(NamedTuple):
    """How an act ended.

    Attributes:
        moved: greatest distance that another object was moved, m, and which one.
        reached: whether the object ended where the action aims.
        alone: the same without the others.
    """

    act: Act
    outcome: MotionOutcome
    message: str
    moved: float
    bystander: str
    reached: bool
    alone: bool

    @property
    def begun(self) -> bool:
        """Whether the arm began to act."""
        return self.outcome.moved


@cache
def crowded_world(name: str) -> World:
    """A shipped world with seven objects: its own, those of the other world, and a second cube."""
    entries = {
        item.name: item for each in (name, *WORLDS) for item in load_world(each).object_entries
    }
    second = replace(entries['cube'], name='second cube')
    return replace(load_world(name), object_entries=(*entries.values(), second)[:MOST])


@cache
def cell_of(world: str, name: str = '') -> Cell:
    """A cell of one of a world's objects, or of all seven."""
    own = crowded_world(world)
    return Cell(own.only(name) if name else own, 0)


def draw_act(seed: int) -> Act:
    """Any action on an object where its region starts one, and others anywhere in reach."""
    rng = np.random.default_rng(seed)
    name = WORLDS[seed % len(WORLDS)]
    world = crowded_world(name)
    count = int(rng.integers(FEWEST, MOST + 1))
    objects = tuple(map(str, rng.permutation(world.objects)[:count]))
    action = world.actions[int(rng.integers(len(world.actions)))]
    reachable = [entry for entry in world.region_entries if entry.reachable]
    while True:
        start = reachable[int(rng.integers(len(reachable)))].start
        spots = [_spot(start, rng)]
        for _ in range(TRIES):
            if len(spots) == count:
                layout = {
                    each: Placement(*spot, 0.0, float(rng.uniform(-np.pi, np.pi)))
                    for each, spot in zip(objects, spots, strict=True)
                }
                return Act(seed, name, layout, action)
            spot = _spot(world.regions.work_area, rng)
            near = min(math.dist(spot, other) for other in spots) < SPACING
            if not near and any(
                e.area is not None and e.area.contains(*spot, -BORDER) for e in reachable
            ):
                spots.append(spot)


def _spot(area: Rectangle, rng: np.random.Generator) -> tuple[float, float]:
    x, y = rng.uniform((area.x_min, area.y_min), (area.x_max, area.y_max))
    return float(x), float(y)


def carry_out(act: Act) -> ActResult:
    """Make an act, and again with its object alone."""
    crowded, alone = cell_of(act.world), cell_of(act.world, act.object)
    others = [name for name in act.layout if name != act.object]
    before = _set_up(crowded, act, act.layout)
    result, reached = _act(crowded, act, act.layout)
    ways = {n: float(np.linalg.norm(_position(crowded, n) - before[n])) for n in others}
    bystander = max(ways, key=lambda name: ways[name])
    _set_up(alone, act, [act.object])
    _, reached_alone = _act(alone, act, [act.object])
    return ActResult(
        act, result.outcome, result.message, ways[bystander], bystander, reached, reached_alone
    )


def _set_up(cell: Cell, act: Act, objects: Iterable[str]) -> dict[str, NDArray[np.float64]]:
    """Put objects where the act has them; their true positions, m, at rest."""
    cell.restart(act.seed)
    for number, name in enumerate(cell.world.objects):
        # The others lie on the floor, out of the way.
        aside = Placement(0.4 * number - 1.2, 2.5, cell.world.table.floor_z, 0.0)
        place = act.layout[name] if name in objects else aside
        cell.physics_world.put_toy(name, place.x, place.y, place.ground, place.yaw)
    cell.step(SETTLING_TIME)
    return {name: _position(cell, name) for name in objects}


def _act(cell: Cell, act: Act, objects: Iterable[str]) -> tuple[MotionResult, bool]:
    perception = SimulatedPerception(cell, act.seed)
    result = cell.run_action(
        Actor.ROBOT, act.object, act.action.name, perception.look, others=perception.others
    )
    for each in objects:
        wait_until_at_rest(cell, each)
    return result, cell.true_states()[act.object].state == act.action.target


def _position(cell: Cell, name: str) -> NDArray[np.float64]:
    return cell.physics_world.toy_pose(name).position


def share(found: Iterable[bool]) -> float:
    """Share of what is true; NaN of nothing."""
    values = list(found)
    return sum(values) / len(values) if values else float('nan')


def bars(results: Sequence[ActResult]) -> list[Bar]:
    """What is held against the acts."""
    begun = [r for r in results if r.begun]
    count = len(results)
    return [
        Bar('acts that moved a bystander', share(r.moved > MOVED for r in results), 0.01, 'share',
            'requirement', count),
        Bar('greatest way of a bystander', max(r.moved for r in results), None, 'm', None, count),
        Bar('success of acts that were begun, minus the same acts alone',
            share(r.reached for r in begun) - share(r.alone for r in begun), 0.0, 'share',
            'requirement', len(begun), False),
        Bar('success of acts that were begun', share(r.reached for r in begun), None, 'share',
            None, len(begun)),
        Bar('chance of a difference like that or worse, if there is none', _worse(begun), None,
            'p', None, len(begun)),
        Bar('success of the same acts alone', share(r.alone for r in begun), None, 'share', None,
            len(begun)),
        Bar('acts that were refused', share(not r.begun for r in results), None, 'share', None,
            count),
    ]  # fmt: skip


def _worse(begun: Sequence[ActResult]) -> float:
    """One-sided sign test of the acts that reached their aim either alone or not alone."""
    lost = sum(r.alone and not r.reached for r in begun)
    won = sum(r.reached and not r.alone for r in begun)
    return float(binom.sf(lost - 1, lost + won, 0.5))


def main() -> int:
    """Make all acts and publish the shares."""
    parser = option_parser('clutter')
    parser.add_argument('--acts', type=whole_number, default=500)
    parser.add_argument('--seed', type=whole_number, default=FIRST_SEED)
    options = parser.parse_args()
    if options.acts == 0:
        parser.error('expected at least one act, got 0')
    seeds = range(options.seed, options.seed + options.acts)
    results = [carry_out(draw_act(seed)) for seed in seeds]
    notes: dict[str, Any] = _by_count(results)
    notes['outcomes'] = dict(Counter(r.outcome.name for r in results))
    notes['moved'] = [
        f'{r.act.seed}: {r.bystander} by {r.moved:.3f} m, {r.act.action} of the {r.act.object}'
        for r in results
        if r.moved > MOVED
    ]
    return 0 if publish('clutter', bars(results), notes) else 1


def _by_count(results: Sequence[ActResult]) -> dict[str, Any]:
    """Counts by manner and number of objects."""
    found = {}
    for manner in ('place', 'push'):
        for count in range(FEWEST, MOST + 1):
            own = [
                r
                for r in results
                if len(r.act.layout) == count and r.act.action.manner.name.lower() == manner
            ]
            begun = [r for r in own if r.begun]
            found[f'{manner} {count} objects'] = {
                'acts': len(own),
                'begun': len(begun),
                'moved a bystander': sum(r.moved > MOVED for r in own),
                'reached': sum(r.reached for r in begun),
                'reached alone': sum(r.alone for r in begun),
            }
    return found


if __name__ == '__main__':
    sys.exit(main())
