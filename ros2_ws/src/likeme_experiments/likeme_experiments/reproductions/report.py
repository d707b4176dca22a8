"""How every reproduction speaks: a JSON document, a table for people, a figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Options:
    """What a caller may choose; None: the reproduction's own default.

    Attributes:
        seeds: how many independent repetitions.
        model: `shipped`, `learned`, or the path of a model file or an experience store.
        workers: processes to spread the work over.
    """

    seeds: int | None = None
    model: str | None = None
    workers: int | None = None

    def given(self) -> tuple[str, ...]:
        """Names of the options that were chosen."""
        return tuple(name for name, value in vars(self).items() if value is not None)


class Report(NamedTuple):
    """What one reproduction came to.

    Attributes:
        document: JSON-ready; all numbers.
        text: the table a person reads, the paper's values beside ours.
        figure: draws it as the paper does; None where there is nothing to draw.
    """

    document: Mapping[str, Any]
    text: str
    figure: Callable[[], Figure] | None = None


class Reproduction(NamedTuple):
    """One table or figure.

    Attributes:
        about: one line for the list.
        report: computes it.
        takes: names of the Options it uses; others are refused.
        in_all: whether `all` runs it, too; not what takes much longer than the others.
    """

    about: str
    report: Callable[[Options], Report]
    takes: frozenset[str] = frozenset()
    in_all: bool = True


def save_figure(report: Report, folder: Path, name: str) -> list[Path]:
    """Write NAME.png and NAME.svg into a folder; returns their paths, none without a figure."""
    if report.figure is None:
        return []
    figure = report.figure()
    paths = [folder / f'{name}.png', folder / f'{name}.svg']
    for path in paths:
        figure.savefig(path, dpi=150)
    return paths
