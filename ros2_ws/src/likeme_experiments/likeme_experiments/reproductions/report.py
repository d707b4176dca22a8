"""The parts of every reproduction: a JSON document, a text table, a figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from likeme_core.world import World, load_world

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class ReproductionOptions:
    """Options of a reproduction; None: its own default.

    Attributes:
        world: of states, actions and objects.
        seeds: number of independent repetitions.
        model: `shipped`, `learned`, or the path of a model file or an experience store.
        workers: processes to spread the work over.
        together: whether all objects of the world are on the table.
        arviz: whether draws are also written for ArviZ.
    """

    world: World = field(default_factory=load_world)
    seeds: int | None = None
    model: str | None = None
    workers: int | None = None
    together: bool = False
    arviz: bool = False

    def given(self) -> tuple[str, ...]:
        """Names of the options that are set."""
        default = ReproductionOptions()
        return tuple(k for k, value in vars(self).items() if value != getattr(default, k))


class ReproductionReport(NamedTuple):
    """The result of one reproduction.

    Attributes:
        document: JSON-ready; all numbers.
        text: a table with the paper's values beside the computed ones.
        figure: draws the figure; None if there is none.
        save: writes further files into a folder, called as the reproduction; returns their paths.
    """

    document: Mapping[str, Any]
    text: str
    figure: Callable[[], Figure] | None = None
    save: Callable[[Path, str], list[Path]] | None = None


class Reproduction(NamedTuple):
    """One table or figure.

    Attributes:
        about: one line for the list.
        report: computes it.
        takes: names of the options it uses; others are refused.
        in_all: whether `all` includes it; False for long computations.
    """

    about: str
    report: Callable[[ReproductionOptions], ReproductionReport]
    takes: frozenset[str] = frozenset()
    in_all: bool = True


def save_files(report: ReproductionReport, folder: Path, name: str) -> list[Path]:
    """Write NAME.png and NAME.svg, and what else the report has; returns their paths."""
    paths = []
    if report.figure is not None:
        figure = report.figure()
        paths = [folder / f'{name}.png', folder / f'{name}.svg']
        for path in paths:
            figure.savefig(path, dpi=150)
    return paths if report.save is None else [*paths, *report.save(folder, name)]
