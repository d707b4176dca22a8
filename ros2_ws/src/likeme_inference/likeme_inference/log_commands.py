"""Command `log`: show, verify and export the decision log, and make a decision again."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Annotated, Any, TextIO

import typer

from likeme_core.cli import Domain
from likeme_core.state_folder import state_folder
from likeme_core.typer_app import App
from likeme_inference.experience.decision_log import LOG_FILE, DecisionLog, LogEntry
from likeme_inference.experience.store_error import StoreError
from likeme_inference.log_story import DecisionStory, line, sentence

app = App(
    help='The decision log: what was seen, decided, asked, answered and done.',
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    no_args_is_help=True,
)
Store = Annotated[
    str,
    typer.Option(
        '--store',
        metavar='PLACE',
        help="SQLite file or database URL; default: the log in the cell's state folder.",
    ),
]
Namespace = Annotated[str, typer.Option('--namespace', help='ROS namespace of the cell.')]
#: s to wait for somebody who writes.
PATIENCE = 5.0


@contextmanager
def opened(store: str, domain: int, namespace: str) -> Iterator[DecisionLog]:
    """A log to read; what is wrong with it is one sentence and exit code 1."""
    try:
        place = store or str(state_folder(domain, namespace) / LOG_FILE)
        with closing(DecisionLog(place, create=False, lock_timeout=PATIENCE)) as log:
            yield log
    except (StoreError, OSError) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from None


@app.command()
def show(
    last: Annotated[int, typer.Option('--last', '-n', min=1, help='So many of the newest.')] = 20,
    kind: Annotated[
        list[str] | None,
        typer.Option(help='Only entries of this kind, e.g. decision; may be repeated.'),
    ] = None,
    as_json: Annotated[bool, typer.Option('--json', help='JSON lines.')] = False,
    store: Store = '',
    domain: Domain = 0,
    namespace: Namespace = '/',
) -> None:
    """Print the newest entries, the oldest of them first."""
    with opened(store, domain, namespace) as log:
        for entry in log.entries(kind or (), last):
            typer.echo(json_line(entry) if as_json else line(entry))


@app.command()
def why(
    number: Annotated[int, typer.Argument(metavar='DECISION', min=1, help='Its number.')],
    as_json: Annotated[bool, typer.Option('--json', help='One JSON document.')] = False,
    store: Store = '',
    domain: Domain = 0,
    namespace: Namespace = '/',
) -> None:
    """Tell how a decision came about and ended, and make it again from its record.

    Exit code 1: it does not follow from its record.
    """
    with opened(store, domain, namespace) as log:
        story = DecisionStory(log, number)
        differences = story.differences()
        if as_json:
            entries = [json.loads(json_line(entry)) for entry in story.entries()]
            document = {'decision': number, 'entries': entries, 'differences': differences}
            typer.echo(json.dumps(document, ensure_ascii=False))
        else:
            typer.echo('\n'.join([*story.lines(), *numbers(story.decision.data)]))
    if not as_json:
        typer.echo('re-derived: ' + ('same' if not differences else 'it differs.'))
    for difference in differences:
        typer.echo(difference, err=True)
    if differences:
        raise typer.Exit(1)


def numbers(record: Any) -> list[str]:
    """The numbers a decision follows from, as lines."""
    decision, model = record['decision'], record['model']
    objects = ', '.join(name for name, _ in model['counts'])
    return [
        f'model {model["name"]} {model["version"]}, trials of {objects}; mode {decision["mode"]}, '
        f'policy {decision["policy"]}, threshold {decision["threshold"]:g}',
        f'p(goal) {rounded(decision["goal_posterior"])}; '
        f'p(action) {rounded(decision["action_probability"])}; '
        f'p(success) {rounded(decision["success_probability"])}',
    ]


def rounded(probabilities: list[float]) -> str:
    """Probabilities with three digits."""
    return ' '.join(f'{p:.3f}' for p in probabilities) or '-'


@app.command()
def verify(
    head: Annotated[
        str, typer.Option(help='Hash that was noted earlier: the log must have it still.')
    ] = '',
    store: Store = '',
    domain: Domain = 0,
    namespace: Namespace = '/',
) -> None:
    """Check that no entry was changed, removed, inserted or moved; print the head's hash.

    Entries cut off at the end leave an intact chain: note the head elsewhere, and give it to a
    later check by --head. Exit code 1: something is wrong.
    """
    if head and (len(head) < 8 or set(head) - set('0123456789abcdef')):
        raise typer.BadParameter(f'Expected at least 8 hexadecimal digits, got {head!r}.')
    with opened(store, domain, namespace) as log:
        check = log.verify(head)
        if check.problem:
            raise StoreError(f'{log.place}: {check.problem}')
        typer.echo(f'{log.place}: {check.entries} entries, intact. Head: {check.head}')


@app.command()
def export(
    file: Annotated[
        Path | None, typer.Argument(help='.csv, or else JSON lines; none: JSON lines to stdout.')
    ] = None,
    store: Store = '',
    domain: Domain = 0,
    namespace: Namespace = '/',
) -> None:
    """Write all entries to a file."""
    with opened(store, domain, namespace) as log:
        if file is None:
            write_json(log, sys.stdout)
            return
        with file.open('w', encoding='utf-8', newline='') as out:
            count = (write_csv if file.suffix == '.csv' else write_json)(log, out)
        typer.echo(f'{count} entries: {file}')


def json_line(entry: LogEntry) -> str:
    """An entry as a line of JSON; `data` is what its text says."""
    fields = entry._asdict()
    try:
        fields['data'] = json.loads(fields['text'])
        del fields['text']
    except (ValueError, TypeError):
        # Damaged: the text stays.
        fields['text'] = str(fields['text'])
    return json.dumps(fields, ensure_ascii=False, default=str)


def write_json(log: DecisionLog, out: TextIO) -> int:
    """Write all entries as JSON lines; their number."""
    count = 0
    for entry in log.entries():
        count += 1
        out.write(json_line(entry) + '\n')
    return count


def write_csv(log: DecisionLog, out: TextIO) -> int:
    """Write all entries as CSV with a sentence each; their number."""
    writer = csv.writer(out)
    writer.writerow([*LogEntry._fields, 'sentence'])
    count = 0
    for entry in log.entries():
        count += 1
        writer.writerow([*entry, sentence(entry)])
    return count


def main() -> None:
    """Run the command line."""
    app()


if __name__ == '__main__':
    main()
