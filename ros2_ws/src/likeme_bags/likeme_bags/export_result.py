"""What an export returns."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class Exported(NamedTuple):
    """Files or the folder written, and what a user should know of them."""

    paths: list[Path]
    remarks: list[str]
    # Whether everything the bags hold could be read.
    complete: bool
