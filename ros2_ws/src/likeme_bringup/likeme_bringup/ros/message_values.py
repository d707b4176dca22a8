"""A message as dicts, lists and plain values."""

from __future__ import annotations

import math
from typing import Any

#: Elements of an array after which it is cut, where it is.
SHOWN = 64


def plain_value(value: Any, cut: bool) -> Any:
    """A message, or one of its fields; NaN and infinities are texts, as JSON has none.

    cut: whether arrays end after SHOWN elements, with a note how many there are.
    """
    if hasattr(value, 'get_fields_and_field_types'):
        names = value.get_fields_and_field_types()
        return {name: plain_value(getattr(value, name), cut) for name in names}
    if isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, bytes):
        return value.hex()
    if hasattr(value, 'tolist'):
        value = value.tolist()
    values = list(value)
    rest = len(values) - SHOWN if cut else 0
    shown = [plain_value(item, cut) for item in (values[:SHOWN] if rest > 0 else values)]
    return [*shown, f'... {rest} more'] if rest > 0 else shown
