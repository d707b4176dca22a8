"""The robot model from which a reproduction is computed."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import numpy as np

from likeme_core.world import World
from likeme_experiments.learning.store_location import is_sqlite
from likeme_experiments.reproductions.report import ReproductionOptions
from likeme_inference.experience.model_from_trials import robot_model
from likeme_inference.experience.store import ExperienceStore
from likeme_inference.experience.store_error import StoreError
from likeme_inference.experience.trial_batches import batches_in_order
from likeme_inference.tabletop import model_file
from likeme_inference.tabletop.arrays import IntArray
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
    if _is_store(options.model):
        return _experienced(options.world, options.model)
    return model_file.load_tabletop(Path(options.model).expanduser(), options.world)


def batches_of(options: ReproductionOptions, model: RobotModel) -> IntArray | None:
    """A model's trials in batches, [batch, object, x_i, a, x_f]; None: only totals are known.

    Of an experience store the first and second half of each pair's trials by their time; of a
    model file with several sources one batch each, in their order.

    Raises:
        ValueError: the store cannot be read.
    """
    names = tuple(model.objects)
    if options.model is not None and _is_store(options.model):
        try:
            with closing(ExperienceStore(options.model, options.world, create=False)) as store:
                return batches_in_order(store.trials(), options.world, names)
        except StoreError as error:
            raise ValueError(str(error)) from error
    sources = list(dict.fromkeys(row.source for row in model.rows))
    if len(sources) < 2:
        return None
    counts = np.zeros((len(sources), len(names), *model.domain.shape), dtype=np.int64)
    for row in model.rows:
        counts[sources.index(row.source), names.index(row.object), row.x_i, row.action] = (
            row.counts
        )
    return counts


def _is_store(model: str) -> bool:
    return '://' in model or is_sqlite(Path(model).expanduser())


def _experienced(world: World, place: str) -> RobotModel:
    try:
        with closing(ExperienceStore(place, world, create=False)) as store:
            model = robot_model(store)
    except StoreError as error:
        raise ValueError(str(error)) from error
    if not model.objects:
        raise ValueError(f'expected trials of at least one object, got none in {place}.')
    return model
