"""The command behind scripts/reproduce.sh: the paper's tables and figures."""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from likeme_core.cli import WORLD_DEFAULT, WorldOption
from likeme_core.typer_app import App
from likeme_experiments.reproductions.registry import REPRODUCTIONS
from likeme_experiments.reproductions.report import (
    ReproductionOptions,
    ReproductionReport,
    save_files,
)

INTERRUPTED = 130

app = App(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command()
def reproduce(
    name: Annotated[
        str,
        typer.Argument(
            help='What to compute; all: everything that takes a few minutes at most. See --list.'
        ),
    ] = '',
    as_json: Annotated[
        bool, typer.Option('--json', help='Print one JSON document and nothing else.')
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option('--out', help='Also draw NAME.png and NAME.svg into this folder.'),
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, help='Number of independent repetitions.')
    ] = None,
    model: Annotated[
        str | None, typer.Option(help='shipped, learned, a model file, or an experience store.')
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help='Worker processes.')] = None,
    together: Annotated[
        bool, typer.Option('--together', help='Have all objects of the world on the table.')
    ] = False,
    arviz: Annotated[
        bool, typer.Option('--arviz', help='Also write the draws as NAME.nc for ArviZ.')
    ] = False,
    world: WorldOption = WORLD_DEFAULT,
    listing: Annotated[bool, typer.Option('--list', help='List the names and stop.')] = False,
) -> None:
    """Compute a table or figure of the paper and print it beside the paper's values."""
    if listing:
        for known, reproduction in REPRODUCTIONS.items():
            print(f'{known:18} {reproduction.about}')
        return
    quick = [known for known, reproduction in REPRODUCTIONS.items() if reproduction.in_all]
    names = quick if name == 'all' else [name]
    options = ReproductionOptions(world, seeds, model, workers, together, arviz)
    _check(name, options)
    if arviz and out is None:
        _refuse('--arviz needs --out.')
    if out is not None:
        _make_folder(out)
    reports = {}
    for number, each in enumerate(names, 1):
        if len(names) > 1 and sys.stderr.isatty():
            print(f'{each} ({number} of {len(names)})', file=sys.stderr)
        reports[each] = _report(each, options)
    if as_json:
        documents = {each: report.document for each, report in reports.items()}
        print(
            json.dumps(documents if name == 'all' else documents[name], indent=2, allow_nan=False)
        )
    for each, report in reports.items():
        if not as_json:
            print(report.text, end='\n\n')
        if out is not None:
            _draw(report, out, each)


def _check(name: str, options: ReproductionOptions) -> None:
    """Refuse unknown names and options that the reproduction does not use."""
    if name == 'all':
        return
    if name not in REPRODUCTIONS:
        known = ', '.join([*REPRODUCTIONS, 'all'])
        _refuse(f'Expected one of {known}, got {name!r}.')
    unused = [o for o in options.given() if o not in REPRODUCTIONS[name].takes]
    if unused:
        _refuse(f'{name} takes no --{unused[0]}.')


def _report(name: str, options: ReproductionOptions) -> ReproductionReport:
    """Run one reproduction with the options it uses."""
    reproduction = REPRODUCTIONS[name]
    taken = {o: getattr(options, o) for o in options.given() if o in reproduction.takes}
    try:
        return reproduction.report(ReproductionOptions(**taken))
    except (ValueError, OSError) as error:
        print(f'reproduce: {name}: {error}', file=sys.stderr)
        raise typer.Exit(1) from error
    except KeyboardInterrupt:
        print(f'reproduce: {name}: stopped.', file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None


def _make_folder(folder: Path) -> None:
    """Create the folder and check, before the computation, that it is writable."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        _fail(f'Expected a folder to draw into, got {folder}: {error.strerror}.')


def _draw(report: ReproductionReport, folder: Path, name: str) -> None:
    try:
        for path in save_files(report, folder, name):
            print(f'Written: {path}', file=sys.stderr)
    except OSError as error:
        _fail(f'{name} is not drawn into {folder}: {error.strerror}.')


def _fail(sentence: str) -> None:
    print(f'reproduce: {sentence}', file=sys.stderr)
    raise typer.Exit(1)


def _refuse(sentence: str) -> None:
    print(f'reproduce: {sentence}', file=sys.stderr)
    raise typer.Exit(2)


def run() -> None:
    """Console entry point."""
    app()


if __name__ == '__main__':
    run()
