"""What the simulated robot's six actions do to each object, beside the real robot's trials.

Headless and without perception: the target pose is the true one with an error like perception's
(a bias of 5 mm, 4 mm and 0.1 rad of noise), the others lie on the floor, and success is told by
the simulator's own truth. `--seeds N` (10): trials of each object, initial state and action.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np

from likeme_arm_sim.cell import Actor, Cell
from likeme_arm_sim.primitives import ObjectView
from likeme_arm_sim.scene import OBJECTS, Action, Scene, State
from likeme_inference.tabletop.model_file import shipped
from report import publish

BIAS, NOISE, YAW_NOISE = (-0.004, 0.003), 0.004, 0.1
# Simulated seconds in which whatever rolls comes to rest.
REST = 1.5


def perceiver(cell: Cell, rng: np.random.Generator) -> Callable[[str], ObjectView]:
    """A camera of constant error for one trial."""
    dx, dy = rng.normal(0.0, NOISE, 2) + BIAS
    turn = rng.normal(0.0, YAW_NOISE)

    def look(name: str) -> ObjectView:
        true = cell.true_states()[name]
        x, y = true.x + dx, true.y + dy
        state = cell.scene.table.state_of(x, y)
        return ObjectView(
            x, y, true.yaw + turn, State.OFFTABLE if true.state is State.OFFTABLE else state
        )

    return look


def final_states(cell: Cell, name: str, x_i: State, action: Action, seeds: int) -> list[int]:
    """How often the object ended LEFT, RIGHT, OFFTABLE."""
    counts = [0, 0, 0]
    others = [other for other in OBJECTS if other != name]
    for seed in range(seeds):
        cell.reset([*others, name], [State.OFFTABLE, State.OFFTABLE, x_i], seed)
        look = perceiver(cell, np.random.default_rng(100 + seed))
        cell.run_action(Actor.ROBOT, name, action, look)
        cell.step(REST)
        state = cell.true_states()[name].state
        assert state is not None, 'The truth is never covered.'
        counts[state] += 1
    return counts


def main() -> None:
    """Try everything and publish, with the real robot's counts as the peer."""
    parser = argparse.ArgumentParser()
    parser.add_argument('--seeds', type=int, default=10)
    parser.add_argument('--json', action='store_true')
    seeds = parser.parse_args().seeds
    cell, real = Cell(Scene(), 0), shipped()
    notes = {}
    for name in OBJECTS:
        for x_i in (State.LEFT, State.RIGHT):
            for action in Action:
                ours = final_states(cell, name, x_i, action, seeds)
                theirs = real.model_of(name).counts[x_i, action].tolist()
                notes[f'{name} {x_i.name} {action.name}'] = (
                    f'LEFT, RIGHT, OFFTABLE {ours}, real robot {theirs}'
                )
    publish('actions', [], notes)


if __name__ == '__main__':
    main()
