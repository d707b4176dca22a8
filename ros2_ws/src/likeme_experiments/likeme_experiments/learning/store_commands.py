"""What `learn.sh` does with experience that is there: summary, export, import."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from likeme_experiments.learning.summary import document, table
from likeme_inference.experience import trial_file
from likeme_inference.experience.database import StoreError
from likeme_inference.experience.model_view import robot_model
from likeme_inference.experience.store import ExperienceStore, Recorded
from likeme_inference.tabletop import model_file

DONE, FAILED = 0, 1

Store = Annotated[
    str | None,
    typer.Option(
        help='SQLite file or database URL of the experience; out/experience.sqlite of the project.'
    ),
]


def summary_command(
    store: Store = None,
    as_json: Annotated[bool, typer.Option('--json', help='One JSON document.')] = False,
) -> None:
    """Say what is in the experience: how every action ended, by robot and campaign."""
    with _reading(store) as opened:
        tallies = opened.tallies()
        if as_json:
            print(json.dumps(document(opened.place, tallies), indent=2))
        else:
            Console().print(table(opened.place, tallies))


def export_command(
    out: Annotated[Path, typer.Argument(help='File to write.')],
    model: Annotated[
        bool, typer.Option('--model', help='Write a model file of counts, not the trials.')
    ] = False,
    robot: Annotated[str | None, typer.Option(help='Only this robot.')] = None,
    campaign: Annotated[str | None, typer.Option(help='Only this campaign.')] = None,
    store: Store = None,
) -> None:
    """Write the trials as text, or the model that follows from them (for `model_file`)."""
    with _reading(store) as opened:
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
) -> None:
    """Add the trials of others: what is known already is not counted again."""
    code = DONE
    try:
        with closing(open_store(store)) as opened:
            for source in sources:
                result = _import(opened, source)
                print(f'{source}: {result.new} trials new, {result.known} known.')
                if result.contradicting:
                    code = failed(
                        f'{source}: {len(result.contradicting)} trials are known with another '
                        f'ending, e.g. {result.contradicting[0]}; the first record stays.'
                    )
    except (StoreError, trial_file.TrialFileError) as error:
        code = failed(str(error))
    raise typer.Exit(code)


def _import(store: ExperienceStore, source: str) -> Recorded:
    path = Path(source)
    if '://' not in source and not is_sqlite(path):
        return store.record(trial_file.load(path))
    with closing(ExperienceStore(source, create=False)) as other:
        return store.record(list(other.trials()))


def is_sqlite(path: Path) -> bool:
    """Whether a file is an SQLite database."""
    try:
        with path.open('rb') as file:
            return file.read(16) == b'SQLite format 3\0'
    except OSError:
        return False


@contextmanager
def _reading(place: str | None) -> Iterator[ExperienceStore]:
    """A store that must be there; errors end the command in one sentence."""
    try:
        with closing(ExperienceStore(place or default_place(), create=False)) as store:
            yield store
    except StoreError as error:
        raise typer.Exit(failed(str(error))) from None


def open_store(place: str | None) -> ExperienceStore:
    """The store somebody names, or the default one; made where it is not there."""
    if place is None:
        Path(default_place()).parent.mkdir(exist_ok=True)
    return ExperienceStore(place or default_place())


def default_place() -> str:
    """Where experience is kept unless it is said."""
    return str(Path(os.environ.get('LIKEME_ROOT', '.')) / 'out' / 'experience.sqlite')


def failed(why: str, code: int = FAILED) -> int:
    """Say why on stderr; the exit code."""
    print(why, file=sys.stderr)
    return code
