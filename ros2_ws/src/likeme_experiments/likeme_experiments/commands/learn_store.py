"""The commands `summary`, `export` and `import` of learn.sh."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from likeme_core.cli import WORLD_DEFAULT, WorldOption
from likeme_core.world import World
from likeme_experiments.learning.store_location import default_place, is_sqlite, open_store
from likeme_experiments.learning.summary import document, table
from likeme_inference.experience import trial_file
from likeme_inference.experience.model_from_trials import robot_model
from likeme_inference.experience.store import ExperienceStore, Recorded
from likeme_inference.experience.store_error import StoreError
from likeme_inference.tabletop import model_file

DONE, FAILED = 0, 1

Store = Annotated[
    str | None,
    typer.Option(
        help='Experience store: SQLite file or database URL. Default: out/experience.sqlite.'
    ),
]


def summary_command(
    store: Store = None,
    world: WorldOption = WORLD_DEFAULT,
    as_json: Annotated[bool, typer.Option('--json', help='Print one JSON document.')] = False,
) -> None:
    """Print how every action ended, with the number of trials of each robot and campaign."""
    with _reading(world, store) as opened:
        tallies = opened.tallies()
        if as_json:
            print(json.dumps(document(world, opened.place, tallies), indent=2, allow_nan=False))
        else:
            Console().print(table(world, opened.place, tallies))


def export_command(
    out: Annotated[Path, typer.Argument(help='File to write.')],
    model: Annotated[
        bool, typer.Option('--model', help='Write a model file (counts) instead of the trials.')
    ] = False,
    robot: Annotated[str | None, typer.Option(help='Only trials of this robot.')] = None,
    campaign: Annotated[str | None, typer.Option(help='Only trials of this campaign.')] = None,
    store: Store = None,
    world: WorldOption = WORLD_DEFAULT,
) -> None:
    """Write the trials as a text file, or the transition model counted from them."""
    with _reading(world, store) as opened:
        try:
            if model:
                robots, campaigns = [robot] if robot else [], [campaign] if campaign else []
                view = robot_model(opened, robots=robots, campaigns=campaigns)
                model_file.save(view, out)
                print(f'{view.version} trials counted in {out}.')
            else:
                count = trial_file.save(opened.trials(robot, campaign), out)
                print(f'{count} trials written to {out}.')
        except OSError as error:
            raise typer.Exit(failed(f'{out}: {error.strerror}.')) from None


def import_command(
    sources: Annotated[
        list[str], typer.Argument(help='Trial files, SQLite files or database URLs.')
    ],
    store: Store = None,
    world: WorldOption = WORLD_DEFAULT,
) -> None:
    """Add trials from other stores or files; trials that are recorded already are skipped."""
    code = DONE
    try:
        with closing(open_store(world, store)) as opened:
            for source in sources:
                result = _import(opened, source)
                print(f'{source}: {result.new} trials new, {result.known} known.')
                if result.contradicting:
                    code = failed(
                        f'{source}: {len(result.contradicting)} trials are recorded with another '
                        f'result, e.g. {result.contradicting[0]}; the recorded ones are kept.'
                    )
    except (StoreError, trial_file.TrialFileError) as error:
        code = failed(str(error))
    raise typer.Exit(code)


def _import(store: ExperienceStore, source: str) -> Recorded:
    path = Path(source)
    if '://' not in source and not is_sqlite(path):
        return store.record(trial_file.load(path, store.world))
    with closing(ExperienceStore(source, store.world, create=False)) as other:
        return store.record(list(other.trials()))


@contextmanager
def _reading(world: World, place: str | None) -> Iterator[ExperienceStore]:
    """An existing store; an error ends the command with one sentence."""
    try:
        with closing(ExperienceStore(place or default_place(world), world, create=False)) as store:
            yield store
    except StoreError as error:
        raise typer.Exit(failed(str(error))) from None


def failed(why: str, code: int = FAILED) -> int:
    """Print the reason to stderr; returns the exit code."""
    print(why, file=sys.stderr)
    return code
