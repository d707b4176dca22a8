"""Where the shipped world files are, with their meshes and the schema."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

WORLDS_FOLDER = Path(str(resources.files('likeme_core') / 'worlds'))
