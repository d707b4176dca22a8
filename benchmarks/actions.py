"""How the simulated robot's six actions end for each object, beside the real robot's trials.

Headless: the whole cell with all three toys, the others on the floor. Perception is replaced by an
error model (see likeme_arm_sim/headless_trial.py), and success is read from the simulator's true
states.
`--seeds N` (10): trials of each object, initial state and action. The bar: rows of the 36 whose
real counts an exact multinomial test at 0.05 does not distinguish from the simulated ones.
"""

from __future__ import annotations

from likeme_arm_sim.cell import Cell
from likeme_arm_sim.headless_trial import SimulatedPerception, wait_until_at_rest
from likeme_core.outcomes import Actor
from likeme_core.paper_world import OFFTABLE, WORLD
from likeme_core.progress_bar import counted
from likeme_core.tabletop import Action, State
from likeme_experiments.physics_fit.evaluate import FRESH, LEVEL
from likeme_experiments.physics_fit.multinomial_test import multinomial_p_value, smoothed
from likeme_experiments.physics_fit.table_rows import table_rows
from report import Bar, option_parser, publish, whole_number


def final_states(cell: Cell, name: str, x_i: State, action: Action, seeds: int) -> list[int]:
    """How often the object ended LEFT, RIGHT, OFFTABLE."""
    counts = [0, 0, 0]
    others = [other for other in WORLD.objects if other != name]
    fresh = range(FRESH, FRESH + seeds)
    for seed in counted(fresh, f'{name} {x_i.name} {action.name}', seeds):
        cell.reset([*others, name], [OFFTABLE, OFFTABLE, x_i], seed)
        cell.run_action(Actor.ROBOT, name, action, SimulatedPerception(cell, seed).look)
        wait_until_at_rest(cell, name)
        state = cell.true_states()[name].state
        assert state is not None, 'The true state is always known.'
        counts[state] += 1
    return counts


def main() -> None:
    """Run all trials and publish the comparison with the real robot."""
    parser = option_parser('actions')
    parser.add_argument('--seeds', type=whole_number, default=10)
    seeds = parser.parse_args().seeds
    cell, notes, passed = Cell(WORLD, 0), {}, 0
    for row in table_rows():
        ours = final_states(cell, row.name, row.x_i, row.action, seeds)
        p = multinomial_p_value(row.real, smoothed(ours))
        passed += p > LEVEL
        counts = f'LEFT, RIGHT, OFFTABLE {ours}, real robot {list(row.real)}, p {p:.3f}'
        notes[str(row)] = counts
    agree = Bar('rows that agree', passed, None, 'of 36', 'the real robot', seeds, False)
    publish('actions', [agree], notes)


if __name__ == '__main__':
    main()
