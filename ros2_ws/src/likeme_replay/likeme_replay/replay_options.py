"""The options of `replay`, and what they imply for a bag."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from likeme_bags.reading import open_bag
from likeme_replay import recorded_parameters


class ReplayOptions(NamedTuple):
    """The command line of `replay`; times in s after the first message."""

    bag: Path
    rate: float | None
    start: float | None
    end: float | None
    loop: bool
    pause: bool
    topics: tuple[str, ...]
    remap: dict[str, str]
    types: dict[str, str]
    clock: bool
    qos: object
    lockstep: bool
    offline: bool
    log: Path | None
    params: Path | None
    world: str | None
    running: bool
    domain: int

    def check(self) -> None:
        """Refuse options that exclude each other.

        Raises:
            ValueError: with what was expected.
        """
        if not self.bag.exists():
            raise ValueError(f'Expected a bag, got {self.bag}, which does not exist.')
        if self.start is not None and self.end is not None and self.start >= self.end:
            raise ValueError(
                f'Expected --start before --end, got {self.start:g} and {self.end:g}.'
            )
        alone = {'--loop': self.loop, '--topics': self.topics, '--qos': self.qos}
        timed = {'--rate': self.rate, '--pause': self.pause, '--clock': self.clock,
                 '--running': self.running}  # fmt: skip
        refused = {**alone, **timed} if self.offline else alone if self.lockstep else {}
        mode = '--offline' if self.offline else '--lockstep and --log'
        for option, value in refused.items():
            if value:
                raise ValueError(f'{mode} take no {option}.')
        if self.log is not None and str(self.log) != '-' and not self.log.parent.is_dir():
            raise ValueError(f'Expected a folder for --log, got {self.log.parent}.')
        if self.params is not None:
            recorded_parameters.from_file(self.params)

    def read_bag_settings(self) -> tuple[recorded_parameters.Parameters, int | None, int | None]:
        """The nodes' parameters, and the log times (ns) of the first and the last record to use.

        Raises:
            BagError: the bag cannot be opened.
            ValueError: its recorded parameters are invalid, or it is of another world.
        """
        with open_bag(self.bag) as bag:
            custom = bag.custom
            parameters = recorded_parameters.recorded(custom)
            begin = None if self.start is None else bag.start + round(self.start * 1e9)
            end = None if self.end is None else bag.start + round(self.end * 1e9)
        if self.params is not None:
            parameters = recorded_parameters.merged(
                parameters, recorded_parameters.from_file(self.params)
            )
        if self.world is not None:
            parameters = recorded_parameters.in_world(parameters, self.world)
        recorded_parameters.check_world(custom, parameters)
        return parameters, begin, end
