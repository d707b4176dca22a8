"""The world file: which regions, objects and actions there are, and the geometry of the cell."""

from likeme_core.world.file import WorldFileError, load_world, shipped_worlds
from likeme_core.world.values import World

__all__ = ['World', 'WorldFileError', 'load_world', 'shipped_worlds']
