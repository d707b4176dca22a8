"""Posterior draws as .npz: arrays alone, which `numpy.load` reads without pickle.

| key | contents |
| --- | --- |
| `format` | 1 |
| `model`, `policy` | name and version of the robot's model; `direct` or `explored` |
| `objects`, `states`, `actions`, `goals` | names, in the order of the axes |
| `goal_states` | which states fulfil which goal, [goal, x_f] |
| `observed` | trials, [object, x_i, action, x_f] |
| `pseudo_counts` | of the Dirichlet prior, [object, x_i, action, x_f] |
| `goal_prior` | P(G), [goal] |
| `posterior_transition`, `prior_transition` | [chain, draw, object, x_i, action, x_f] |
| `posterior_goal_probability`, `prior_goal_probability` | [chain, draw, object, x_i, x_f, goal] |
| `posterior_counts`, `prior_counts` | predictive: [chain, draw, object, x_i, action, x_f] |
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from likeme_inference.tabletop.domain import Policy
from likeme_inference.tabletop.posterior_sampling import (
    ARRAYS,
    DRAWN,
    NAMES,
    Draws,
    PosteriorDraws,
)

FORMAT = 1


def save_draws(draws: PosteriorDraws, path: Path | str) -> None:
    """Write draws as a compressed .npz file.

    Raises:
        OSError: it cannot be written.
    """
    arrays: dict[str, Any] = {'format': FORMAT, 'model': draws.model, 'policy': str(draws.policy)}
    arrays |= {name: np.array(getattr(draws, name)) for name in (*NAMES, *ARRAYS)}
    arrays |= {
        f'{name}_{field}': array
        for name in DRAWN
        for field, array in getattr(draws, name)._asdict().items()
    }
    # An open file, as numpy would add .npz to another name.
    with Path(path).open('wb') as file:
        np.savez_compressed(file, **arrays)


def load_draws(path: Path | str) -> PosteriorDraws:
    """Read what `save_draws` has written.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no such file.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            given: dict[str, Any] = dict(file)
        version = int(given['format'])
    except (BadZipFile, EOFError, KeyError, TypeError, ValueError) as error:
        raise _another(path) from error
    if version != FORMAT:
        raise ValueError(f'Expected format {FORMAT}, got {version} in {path}.')
    try:
        fields: dict[str, Any] = {name: given[name] for name in ARRAYS}
        fields |= {name: tuple(given[name].tolist()) for name in NAMES}
        fields |= {n: Draws(*(given[f'{n}_{f}'] for f in Draws._fields)) for n in DRAWN}
        policy = Policy(str(given['policy']))
        return PosteriorDraws(model=str(given['model']), policy=policy, **fields)
    except KeyError as error:
        raise _another(path) from error


def _another(path: Path | str) -> ValueError:
    return ValueError(f'Expected posterior draws, got another file: {path}.')
