"""The robot model from which a reproduction is computed."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

from likeme_core.world import World
from likeme_experiments.learning.store_location import is_sqlite
from likeme_experiments.reproductions.report import ReproductionOptions
from likeme_inference.experience.model_from_trials import robot_model
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.store_error import StoreError
from likeme_inference.tabletop import model_file
from likeme_inference.tabletop.robot_model import RobotModel

LEARNED = 'learned'


def model_of(options: ReproductionOptions) -> RobotModel:
    """The model an option names; `shipped`, the default, comes with the world.

    Raises:
        ValueError, OSError: it cannot be read or learned, or has no object.
    """
    if options.model in (None, 'shipped'):
        return model_file.shipped(options.world)
    if options.model == LEARNED:
        # Takes a second to import.
        from likeme_experiments.learning.self_taught_model import self_taught

        return self_taught(options.world, options.workers)
    path = Path(options.model).expanduser()
    if '://' in options.model or is_sqlite(path):
        return _experienced(options.world, options.model)
    return model_file.load_tabletop(path, options.world)


def _experienced(world: World, place: str) -> RobotModel:
    try:
        with closing(ExperienceStore(place, world, create=False)) as store:
            model = robot_model(store)
    except StoreError as error:
        raise ValueError(str(error)) from error
    if not model.objects:
        raise ValueError(f'expected trials of at least one object, got none in {place}.')
    return model
