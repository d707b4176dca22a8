"""Fits the cell's free parameters to the real robot's trials, and says how well they fit."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress, TaskID

from likeme_arm_sim.fitted import FITTED, values
from likeme_bringup.fitting.exact_test import deviance, smoothed
from likeme_bringup.fitting.judge import judged, table_text
from likeme_bringup.fitting.rows import Row, rows, split
from likeme_bringup.fitting.surrogate import best_values
from likeme_bringup.fitting.trials import read, run_round

# Trials of each fitted row by which the last choice among the candidates is made, with seeds of
# their own.
CHOICE_TRIALS, CHOICE_SEED = 12, 0
# Of a round: how many draws, and how far about the best parameters so far they go (1: everywhere).
ROUNDS = ((36, 1.0), (36, 0.5), (24, 0.3))

app = typer.Typer(add_completion=False)


@app.command()
def main(
    out: Annotated[Path, typer.Option(help='Where the search is kept and goes on.')] = Path(
        'out/fit_physics'
    ),
    seed: Annotated[int, typer.Option(min=0, help='Of parameters and trials.')] = 1,
    workers: Annotated[int, typer.Option(min=1, help='Processes.')] = 2,
    judge: Annotated[bool, typer.Option(help='Only judge the shipped parameters.')] = False,
    trials: Annotated[int, typer.Option(min=1, help='Fresh trials of each row.')] = 50,
) -> None:
    """Search (unless --judge), then try the parameters with fresh seeds beside the real robot."""
    out.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True)
    found = values() if judge else _search(out, seed, workers, console)
    (out / 'parameters.json').write_text(json.dumps(found, indent=1) + '\n')
    with Progress(console=console) as progress:
        task = progress.add_task('fresh trials', total=36)
        table = judged(found, rows(), trials, workers, partial(_tell, progress, task))
    text = table_text(table, split(rows())[0])
    (out / 'table.txt').write_text(text + '\n')
    typer.echo(text)


def _tell(progress: Progress, task: TaskID, done: int) -> None:
    progress.update(task, completed=done)


def _search(out: Path, seed: int, workers: int, console: Console) -> dict[str, float]:
    seen, _ = split(rows())
    centre = {name: (p.low + p.high) / 2 for name, p in FITTED.items()}
    path, candidates = out / 'trials.jsonl', [centre]
    for number, (count, spread) in enumerate(ROUNDS):
        with Progress(console=console) as progress:
            task = progress.add_task(f'round {number + 1}', total=count)
            tell = partial(_tell, progress, task)
            run_round(path, seed, number, count, centre, spread, seen, workers, tell)
        draws = [draw for draw in read(path) if draw.round <= number]
        centre, loss = best_values(seen, draws, centre, seed)
        told = ', '.join(f'{name} {value:.4g}' for name, value in centre.items())
        console.print(
            f'Round {number + 1}: modelled loss {loss:.2f} of {len(seen)} rows at {told}.'
        )
        candidates.append(centre)
    return _choose(candidates, seen, workers, console)


def _choose(
    candidates: list[dict[str, float]], seen: list[Row], workers: int, console: Console
) -> dict[str, float]:
    """The candidate that most fitted rows agree with in trials: the model may have misled."""
    scores = []
    for candidate in candidates:
        with Progress(console=console) as progress:
            tell = partial(_tell, progress, progress.add_task('candidate', total=len(seen)))
            tried = judged(candidate, seen, CHOICE_TRIALS, workers, tell, CHOICE_SEED)
        misfit = sum(min(30.0, deviance(e.row.real, smoothed(e.simulated))) for e in tried)
        scores.append((sum(entry.passes for entry in tried), -misfit))
        console.print(f'{scores[-1][0]} of {len(seen)} fitted rows pass, deviance {misfit:.1f}.')
    return candidates[scores.index(max(scores))]


if __name__ == '__main__':
    app()
