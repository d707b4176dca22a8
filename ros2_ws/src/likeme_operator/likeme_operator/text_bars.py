"""Probabilities as text: short numbers, bars with an interval and a threshold."""

from __future__ import annotations

import math

FULL, LIKELY, EMPTY, MARK = '█', '▒', '·', '|'


def short(p: float) -> str:
    """A probability in four characters: `.40`, `1.0`, `-`."""
    if math.isnan(p):
        return '  - '
    text = f'{p:.2f}'
    return f' {text[1:]}' if text.startswith('0') else ' 1.0'


def bar(p: float, width: int) -> str:
    """A bar of a probability."""
    full = 0 if math.isnan(p) else round(p * width)
    return FULL * full + EMPTY * (width - full)


def evidence_bar(
    p: float, low: float, high: float, width: int, threshold: float | None = None
) -> str:
    """A bar up to `p`, the rest of the interval up to `high` shaded; `|` is the threshold.

    Within the bar the interval's part begins at `low`, where it is shaded, too.
    """
    cells = []
    for k in range(width):
        middle = (k + 0.5) / width
        if middle < p:
            cells.append(FULL)
        elif low <= middle < high:
            cells.append(LIKELY)
        else:
            cells.append(EMPTY)
    if threshold is not None:
        cells[min(int(threshold * width), width - 1)] = MARK
    return ''.join(cells)


def ago(seconds: float) -> str:
    """An age: `0:42`, `1:02:03`."""
    minutes, rest = divmod(max(0, int(seconds)), 60)
    hours, minutes = divmod(minutes, 60)
    return f'{hours}:{minutes:02}:{rest:02}' if hours else f'{minutes}:{rest:02}'
