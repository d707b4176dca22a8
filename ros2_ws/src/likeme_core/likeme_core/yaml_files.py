"""Reading YAML files, with one sentence for what cannot be read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml


def read_yaml(path: Path) -> Any:
    """What is in a YAML file.

    Raises:
        ValueError: it cannot be read.
    """
    try:
        return yaml.safe_load(path.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ValueError(f'{path} cannot be read: {" ".join(str(error).split())}') from None
