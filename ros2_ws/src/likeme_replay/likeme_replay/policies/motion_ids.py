"""Whose request a motion is: ids of the inference node are told apart from other clients'."""

from __future__ import annotations

import re

#: As the inference node makes them: the decision, and what is unique across runs.
_PATTERN = re.compile(r'decision-(\d+)-')


def decision_of(request_id: str) -> int | None:
    """The decision that a request of the inference node carries out; None for other clients'."""
    found = _PATTERN.match(request_id)
    return None if found is None else int(found.group(1))
