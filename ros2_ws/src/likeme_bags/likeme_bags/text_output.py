"""Text for terminals and JSON files, whatever characters and numbers a bag holds."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np


def one_line(text: object, limit: int = 1000) -> str:
    """`text` on one line of at most `limit` characters, control characters escaped."""
    line = ' '.join(str(text).split())
    if len(line) > limit:
        line = line[: limit - 4] + ' ...'
    return ''.join(c if c.isprintable() else c.encode('unicode_escape').decode() for c in line)


def json_text(document: Any, indent: int | None = None) -> str:
    """`document` as JSON; NaN and infinity, which JSON does not have, become null."""
    return json.dumps(_json_value(document), indent=indent, allow_nan=False)


def _json_value(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {key: _json_value(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_json_value(each) for each in value]
    return value
