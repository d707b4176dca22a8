"""Fits the cell's free parameters to the real robot's trials, and says how well they fit."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress, TaskID

from likeme_arm_sim.fitted_parameters import fitted_values
from likeme_experiments.physics_fit.evaluate import judged, table_text
from likeme_experiments.physics_fit.misfit import misfit
from likeme_experiments.physics_fit.search import STEPS, WIDE, best_level, levels, touches
from likeme_experiments.physics_fit.trial_rows import Row, rows, split
from likeme_experiments.physics_fit.trials import try_levels

# Where the search begins: what was chosen by hand before, from a few trials of each mishap.
FIRST = {
    'pear_friction': 0.21, 'lemon_friction': 0.35, 'chicken_friction': 0.65,
    'pear_mass': 0.05, 'lemon_mass': 0.04, 'chicken_mass': 0.06,
    'pear_rolling': 0.0016, 'lemon_rolling': 0.0016, 'pear_bounce': 0.5, 'lemon_bounce': 0.5,
    'arm_bias_x': 0.0, 'arm_skew': 0.0, 'arm_noise': 0.008, 'reach': 0.61, 'grip_force': 1.95,
    'grasp_height': 0.034, 'release_height': 0.085, 'place_share': 0.85, 'push_gap': 0.015,
    'push_past': 0.01, 'push_off_heading': -0.7,
}  # fmt: skip
# Trials of each row with each level.
TRIALS = 8
# After which steps what was found is tried once more, on all fitted rows with seeds of its own.
MARKS, MARK_TRIALS, MARK_SEED = (1, len(WIDE) - 1, len(STEPS) - 1), 12, 2**30

app = typer.Typer(add_completion=False, rich_markup_mode=None)


@app.command()
def main(
    out: Annotated[Path, typer.Option(help='Where the search is kept and goes on.')] = Path(
        'out/fit_physics'
    ),
    seed: Annotated[int, typer.Option(min=0, help='Of parameters and trials.')] = 1,
    workers: Annotated[int, typer.Option(min=1, help='Processes.')] = 2,
    judge: Annotated[bool, typer.Option(help='Only judge the shipped parameters.')] = False,
    camera: Annotated[bool, typer.Option(help='Judge by full trials, as the learner makes.')] = (
        False
    ),
    trials: Annotated[int, typer.Option(min=1, help='Fresh trials of each row.')] = 50,
) -> None:
    """Search (unless --judge), then try the parameters with fresh seeds beside the real robot."""
    out.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True)
    found = fitted_values() if judge else _search(out, seed, workers, console)
    (out / 'parameters.json').write_text(json.dumps(found, indent=1) + '\n')
    with Progress(console=console) as progress:
        task = progress.add_task('fresh trials', total=36)
        tell = partial(_tell, progress, task)
        table = judged(found, rows(), trials, workers, tell, by_camera=camera)
    text = table_text(table, split(rows())[0])
    (out / 'table.txt').write_text(text + '\n')
    typer.echo(text)


def _tell(progress: Progress, task: TaskID, done: int) -> None:
    progress.update(task, completed=done)


def _search(out: Path, seed: int, workers: int, console: Console) -> dict[str, float]:
    seen, _ = split(rows())
    found, marked = dict(FIRST), list[dict[str, float]]()
    for step, (parameter, away) in enumerate(STEPS):
        touched = [row for row in seen if touches(parameter, row)]
        wanted = levels(parameter, found[parameter], away)
        # New seeds for each step: one lucky set must not decide all of them.
        first = seed * 10_000 + step * TRIALS
        with Progress(console=console) as progress:
            toys = len({row.name for row in touched})
            tell = partial(_tell, progress, progress.add_task(parameter, total=toys * len(wanted)))
            tried = try_levels(
                out / f'trials_{seed}.jsonl', step, parameter, wanted, found, touched,
                range(first, first + TRIALS), workers, tell,
            )  # fmt: skip
        before = found[parameter]
        found[parameter], here, there = best_level(before, tried, touched)
        console.print(
            f'{parameter}: {before:.4g} (misfit {there:.1f} over {len(touched)} rows) to '
            f'{found[parameter]:.4g} ({here:.1f}).'
        )
        if step in MARKS:
            marked.append(dict(found))
    return _best_of(marked, seen, workers, console)


def _best_of(
    marked: list[dict[str, float]], seen: list[Row], workers: int, console: Console
) -> dict[str, float]:
    """What most fitted rows agree with: each step was judged by a few trials of its own rows."""
    scores = []
    for values_then in marked:
        with Progress(console=console) as progress:
            tell = partial(_tell, progress, progress.add_task('once more', total=len(seen)))
            tried = judged(values_then, seen, MARK_TRIALS, workers, tell, MARK_SEED)
        loss = sum(misfit(entry.row.real, entry.simulated) for entry in tried)
        scores.append((sum(entry.passes for entry in tried), -loss))
        console.print(f'{scores[-1][0]} of {len(seen)} fitted rows pass, misfit {loss:.1f}.')
    return marked[scores.index(max(scores))]


def run() -> None:
    """Console entry point."""
    app(prog_name='fit_physics')


if __name__ == '__main__':
    run()
