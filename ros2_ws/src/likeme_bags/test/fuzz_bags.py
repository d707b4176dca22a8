"""Damage bags at random and see that reading them stays honest.

    ./scripts/run.sh python ros2_ws/src/likeme_bags/test/fuzz_bags.py --runs 100000 --seed 0

For every damaged bag: only BagError is raised; memory stays bounded (the process limits itself);
where checksums cover the messages, every message passed on is one of those written; and never are
fewer passed on than written without `Bag.complete` being False.
"""

import resource
import shutil
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, NamedTuple, Optional

import numpy as np
import typer
from sample_bags import KINDS, sample_records

from likeme_bags.errors import BagError
from likeme_bags.reading import open_bag
from likeme_bags.values import Record

# What this process may take in all while it reads bags of some 50 kB, bytes.
MEMORY = 3 * 2**30
# What one of them may take, s.
SLOW = 20.0


class Specimen(NamedTuple):
    """A whole bag: its files by name, what is in it, and whether checksums cover that."""

    kind: str
    files: dict[str, bytes]
    # How to open it: a folder, or this file alone.
    opened: str
    records: Counter[Record]
    checked: bool


class Outcome(NamedTuple):
    """What became of one damaged bag."""

    kind: str
    damage: str
    # 'refused', 'complete', 'incomplete', or what went wrong.
    verdict: str
    passed_on: int
    seconds: float

    @property
    def failed(self) -> bool:
        """Whether reading broke one of its promises."""
        return self.verdict not in ('refused', 'complete', 'incomplete')


def specimens(seed: int, folder: Path) -> list[Specimen]:
    """One bag of every kind, and the storage files of the rosbag2 folders by themselves."""
    result = []
    for kind, (make, checked) in KINDS.items():
        place = folder / kind.replace(' ', '-')
        place.mkdir()
        path = make(place, sample_records(seed))
        with open_bag(path) as bag:
            records = Counter(bag.records())
        if path.is_dir():
            files = {p.name: p.read_bytes() for p in sorted(path.iterdir())}
            result.append(Specimen(kind, files, '', records, checked))
            name = next(n for n in files if n != 'metadata.yaml')
            result.append(Specimen(f'{kind} file', {name: files[name]}, name, records, checked))
        else:
            result.append(
                Specimen(kind, {path.name: path.read_bytes()}, path.name, records, checked)
            )
    return result


def damaged(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    """The bytes with one to three random injuries, and their names."""
    names = []
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        name = str(rng.choice(['cut', 'flip', 'flip', 'flip', 'length', 'hole', 'zeros', 'twice']))
        data = _injure(bytearray(data), name, rng)
        names.append(name)
    return data, ' + '.join(names)


def _injure(data: bytearray, name: str, rng: np.random.Generator) -> bytes:
    size = len(data)
    if size < 2:
        return bytes(data)
    at = int(rng.integers(size))
    span = int(rng.integers(1, min(4096, size) + 1))
    if name == 'cut':
        del data[at:]
    elif name == 'flip':
        for place in rng.integers(size, size=int(rng.integers(1, 5))):
            data[int(place)] ^= 1 << int(rng.integers(8))
    elif name == 'length':
        absurd = [2**31 - 1, 2**32 - 1, 2**40, 2**63 - 1, 2**64 - 1, 0]
        number = int(absurd[int(rng.integers(len(absurd)))]) % 2**64
        data[at : at + 8] = number.to_bytes(8, 'little')
    elif name == 'hole':
        del data[at : at + span]
    elif name == 'zeros':
        data[at : at + span] = bytes(len(data[at : at + span]))
    else:
        data[at:at] = data[at : at + span]
    return bytes(data)


def judge(specimen: Specimen, path: Path) -> tuple[str, int]:
    """Read a damaged bag; what became of it, and how many messages were passed on."""
    try:
        with open_bag(path) as bag:
            passed = list(bag.records())
            complete, promised = bag.complete, bag.count
    except BagError:
        return 'refused', 0
    except Exception as error:
        return f'raised {error!r}', 0
    strangers = Counter(passed) - specimen.records
    if specimen.checked and strangers:
        first = next(iter(strangers))
        return f'passed on {len(strangers)} wrong messages, as {first.topic} {first.stamp}', 0
    if [r.stamp for r in passed] != sorted(r.stamp for r in passed):
        return 'not in the order of log times', len(passed)
    if complete and len(passed) < max(promised, specimen.records.total()):
        return f'silently passed on {len(passed)} of {specimen.records.total()}', len(passed)
    return ('complete' if complete else 'incomplete'), len(passed)


def fuzz(runs: int, seed: int, folder: Path) -> Iterator[Outcome]:
    """Damage and read `runs` bags. Run k of a seed can be had again by itself: `--only k`."""
    whole = specimens(seed, folder)
    for k in range(runs):
        yield one(whole, seed, k, folder / 'damaged')


def one(whole: list[Specimen], seed: int, k: int, place: Path) -> Outcome:
    """Run k: a bag, one of its files, an injury."""
    rng = np.random.default_rng([seed, k])
    specimen = whole[k % len(whole)]
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    weights = np.array([len(data) ** 0.5 for data in specimen.files.values()])
    chosen = int(rng.choice(len(weights), p=weights / weights.sum()))
    damage = ''
    for number, (name, data) in enumerate(specimen.files.items()):
        if number == chosen:
            data, damage = damaged(data, rng)
        (place / name).write_bytes(data)
    begin = time.perf_counter()
    verdict, passed_on = judge(specimen, place / specimen.opened)
    seconds = time.perf_counter() - begin
    if seconds > SLOW:
        verdict = f'took {seconds:.0f} s'
    return Outcome(specimen.kind, damage, verdict, passed_on, seconds)


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    runs: Annotated[int, typer.Option(min=1, help='How many bags to damage.')] = 1000,
    seed: Annotated[int, typer.Option(min=0, help='Of all chance in it.')] = 0,
    # Typer 0.9, see bag_console.
    only: Annotated[Optional[int], typer.Option(min=0, help='This run alone.')] = None,  # noqa: UP045
) -> None:
    """Damage bags at random; exit code 1 when reading one of them breaks a promise."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))
    tally: Counter[tuple[str, str]] = Counter()
    begin, slowest, failures = time.perf_counter(), 0.0, 0
    with TemporaryDirectory(prefix='likeme-fuzz-') as name:
        folder = Path(name)
        if only is not None:
            outcome = one(specimens(seed, folder), seed, only, folder / 'damaged')
            typer.echo(str(outcome))
            raise typer.Exit(int(outcome.failed))
        for k, outcome in enumerate(fuzz(runs, seed, folder)):
            slowest = max(slowest, outcome.seconds)
            tally[outcome.kind, 'broken' if outcome.failed else outcome.verdict] += 1
            if outcome.failed:
                failures += 1
                typer.echo(
                    f'run {k}: {outcome.kind}, {outcome.damage}: {outcome.verdict}', err=True
                )
    seconds = time.perf_counter() - begin
    for (kind, verdict), count in sorted(tally.items()):
        typer.echo(f'{kind:16} {verdict:12} {count}')
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    typer.echo(
        f'{runs} damaged bags of seed {seed} in {seconds:.0f} s ({runs / seconds:.0f} a second), '
        f'slowest {slowest:.2f} s, peak memory {peak:.0f} MiB: {failures} broken promises.'
    )
    raise typer.Exit(int(failures > 0))


if __name__ == '__main__':
    app()
