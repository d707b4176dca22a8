"""The names that are nearest to one that is not there."""

from __future__ import annotations

import difflib
from collections.abc import Sequence


def nearest(name: str, names: Sequence[str], count: int = 3) -> list[str]:
    """The names most like another one; those that hold it come first.

    Case and leading slashes do not count.
    """
    plain = {each: each.strip('/').lower() for each in names}
    wanted = name.strip('/').lower()
    holding = [each for each in names if wanted and wanted in plain[each]]
    alike = difflib.get_close_matches(wanted, list(plain.values()), count, cutoff=0.4)
    by_likeness = [each for text in alike for each in names if plain[each] == text]
    return list(dict.fromkeys([*holding, *by_likeness]))[:count]
