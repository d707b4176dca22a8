"""A cache of the latest answers."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Value = TypeVar('Value')


class BoundedCache(Generic[Value]):
    """Values by key, at most `limit`; the one that was made first is forgotten first."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._values: dict[Hashable, Value] = {}

    def __len__(self) -> int:
        return len(self._values)

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """The value of a key; `make` makes it if it is not there."""
        found = self._values.get(key)
        if found is None:
            found = make()
            if len(self._values) == self._limit:
                self._values.pop(next(iter(self._values)))
            self._values[key] = found
        return found

    def clear(self) -> None:
        """Forget all values."""
        self._values.clear()
