"""Message classes by the names of their types."""

from __future__ import annotations

import importlib
from typing import Any


def message_class(name: str) -> Any:
    """The class of 'package/msg/Name', None when it is not installed."""
    package, _, kind = name.partition('/msg/')
    try:
        return getattr(importlib.import_module(f'{package}.msg'), kind, None)
    except (ImportError, ValueError):
        return None
