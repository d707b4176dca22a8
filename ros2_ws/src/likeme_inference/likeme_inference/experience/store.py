"""The experience store: trials in a database, each recorded at most once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import func, insert, inspect, select
from sqlalchemy.engine import Connection, Row
from sqlalchemy.exc import IntegrityError

from likeme_core.tabletop import State
from likeme_core.world import World, load_world
from likeme_inference.experience.database import (
    FOR_WRITING,
    check_writable,
    is_writable,
    open_engine,
    refusing,
    shown,
    url_of,
)
from likeme_inference.experience.schema import row_of, trial_of
from likeme_inference.experience.schema import trials as table
from likeme_inference.experience.schema import world as world_table
from likeme_inference.experience.store_error import StoreError
from likeme_inference.experience.trial import Pair, Trial, no_counts

#: Trials per transaction; SQL statements have a limited number of parameters.
BATCH = 200
#: s to wait for other writers.
LOCK_TIMEOUT = 20.0


class Recorded(NamedTuple):
    """Result of recording trials.

    Attributes:
        new: number of trials added.
        known: number of trials recorded before.
        contradicting: identities of those recorded before with another result, which is kept.
    """

    new: int = 0
    known: int = 0
    contradicting: tuple[str, ...] = ()

    def plus(self, other: Recorded) -> Recorded:
        """The sum of both."""
        contradicting = self.contradicting + other.contradicting
        return Recorded(self.new + other.new, self.known + other.known, contradicting)


class EndStateCount(NamedTuple):
    """Number of a robot's trials of one pair in one campaign with one final state."""

    robot: str
    campaign: str
    pair: Pair
    x_f: State
    trials: int


class ExperienceStore:
    """Trials in a database; several threads and processes may each open it."""

    def __init__(
        self, place: str, world: World, create: bool = True, lock_timeout: float = LOCK_TIMEOUT
    ) -> None:
        """Open a store.

        Args:
            place: path of an SQLite file, or a database URL.
            world: of its states and actions.
            create: if it does not exist.
            lock_timeout: to wait for other writers, s.

        Raises:
            StoreError: it cannot be used, see database.open_engine; or it is of another world.
        """
        self._url, self._lock_timeout = url_of(place), lock_timeout
        self._world = world
        self._engine = open_engine(self._url, create, lock_timeout)
        self._check_world()

    def _check_world(self) -> None:
        """Refuse a store of another world; an empty one becomes one of this world."""
        with refusing(self._url, self._lock_timeout):
            with self._engine.connect() as connection:
                known = inspect(connection).has_table(world_table.name)
                label = connection.scalar(select(world_table.c.label)) if known else None
                if label is None and connection.scalar(select(func.count()).select_from(table)):
                    label = load_world().label
            if label is None and is_writable(self._url):
                self._claim()
        if label is not None and label != self._world.label:
            raise StoreError(
                f'{self.place}: expected an experience store of the world {self._world.label}, '
                f'got one of {label}.'
            )

    def _claim(self) -> None:
        world_table.create(self._engine, checkfirst=True)
        with self._engine.execution_options(begin=FOR_WRITING).begin() as connection:
            if connection.scalar(select(world_table.c.label)) is None:
                connection.execute(insert(world_table), {'label': self._world.label})

    @property
    def world(self) -> World:
        """The world of its states and actions."""
        return self._world

    @property
    def place(self) -> str:
        """Path or URL, without passwords."""
        return shown(self._url)

    def close(self) -> None:
        """Close the connections."""
        self._engine.dispose()

    def check_writable(self) -> None:
        """Refuse a store that can be read alone, before trials are made for it.

        Raises:
            StoreError: its file or folder is read-only.
        """
        check_writable(self._url)

    def record(self, trials: Iterable[Trial]) -> Recorded:
        """Record trials; those recorded before are not changed.

        Raises:
            StoreError: locked or damaged; each batch is one transaction.
        """
        result, rest = Recorded(), iter(trials)
        while batch := list(islice(rest, BATCH)):
            result = result.plus(self._record_batch(batch))
        return result

    def trials(self, robot: str | None = None, campaign: str | None = None) -> Iterator[Trial]:
        """All trials, or those of a robot or campaign, ordered by identity."""
        query = select(table).order_by(table.c.identity)
        for column, value in ((table.c.robot, robot), (table.c.campaign, campaign)):
            query = query if value is None else query.where(column == value)
        with refusing(self._url, self._lock_timeout), self._engine.connect() as connection:
            for row in connection.execution_options(yield_per=BATCH).execute(query):
                yield self._read(row)

    def identities(self, robot: str, campaign: str) -> frozenset[str]:
        """Identities of the recorded trials of a campaign."""
        query = select(table.c.identity).where(
            table.c.robot == robot, table.c.campaign == campaign
        )
        with refusing(self._url, self._lock_timeout), self._engine.connect() as connection:
            return frozenset(connection.execute(query).scalars())

    def tallies(
        self, robots: Sequence[str] = (), campaigns: Sequence[str] = ()
    ) -> tuple[EndStateCount, ...]:
        """Counts of final states; of all robots and campaigns unless named."""
        pair = (table.c.robot, table.c.campaign, table.c.object, table.c.x_i, table.c.action)
        query = select(*pair, table.c.x_f, func.count().label('trials'))
        for column, names in ((table.c.robot, robots), (table.c.campaign, campaigns)):
            query = query.where(column.in_(names)) if names else query
        query = query.group_by(*pair, table.c.x_f).order_by(*pair, table.c.x_f)
        with refusing(self._url, self._lock_timeout), self._engine.connect() as connection:
            rows = connection.execute(query).all()
        return tuple(self._tally(row) for row in rows)

    def counts(
        self, objects: tuple[str, ...], robots: Sequence[str] = (), campaigns: Sequence[str] = ()
    ) -> dict[str, NDArray[np.int64]]:
        """Object -> counts[x_i, a, x_f] of the given objects."""
        counts = no_counts(self._world, objects)
        for tally in self.tallies(robots, campaigns):
            name, x_i, action = tally.pair
            if name in counts:
                counts[name][x_i, action, tally.x_f] += tally.trials
        return counts

    def _record_batch(self, batch: Sequence[Trial]) -> Recorded:
        with refusing(self._url, self._lock_timeout):
            try:
                return self._insert(batch)
            except IntegrityError:
                # Another writer added one of the trials since the query.
                return self._insert(batch)

    def _insert(self, batch: Sequence[Trial]) -> Recorded:
        mine = {trial.key.identity: trial for trial in reversed(batch)}
        with self._engine.execution_options(begin=FOR_WRITING).begin() as connection:
            theirs = self._known(connection, list(mine))
            new = [row_of(trial) for key, trial in mine.items() if key not in theirs]
            if new:
                connection.execute(insert(table), new)
        first = mine | theirs
        wrong = {t.key.identity for t in batch if t.contradicts(first[t.key.identity])}
        return Recorded(len(new), len(batch) - len(new), tuple(sorted(wrong)))

    def _known(self, connection: Connection, identities: Sequence[str]) -> dict[str, Trial]:
        query = select(table).where(table.c.identity.in_(identities))
        return {row.identity: self._read(row) for row in connection.execute(query)}

    def _tally(self, row: Row[Any]) -> EndStateCount:
        world = self._world
        try:
            pair = Pair(row.object, world.state(row.x_i), world.action(row.action))
            return EndStateCount(row.robot, row.campaign, pair, world.state(row.x_f), row.trials)
        except ValueError as error:
            raise StoreError(f'{self.place}: a trial cannot be read: {error}') from error

    def _read(self, row: Row[Any]) -> Trial:
        try:
            return trial_of(row, self._world)
        except (ValueError, TypeError) as error:
            raise StoreError(f'{self.place}: a trial cannot be read: {error}') from error
