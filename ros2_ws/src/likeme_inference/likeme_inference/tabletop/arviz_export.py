"""Posterior draws for ArviZ, where it is installed."""

from __future__ import annotations

import warnings
from typing import Any

from likeme_inference.tabletop.posterior_sampling import Draws, PosteriorDraws

ROW = ['object', 'x_i', 'action', 'x_f']
DIMENSIONS = {
    'transition': ROW,
    'goal_probability': ['object', 'x_i', 'x_f', 'goal'],
    'counts': ROW,
    'pseudo_counts': ROW,
    'goal_prior': ['goal'],
}


def to_arviz(draws: PosteriorDraws) -> Any:
    """Draws as ArviZ takes them, with named dimensions and coordinates.

    Groups: `posterior` and `prior` (`transition`, `goal_probability`), `posterior_predictive` and
    `prior_predictive` (`counts`), `observed_data` (`counts`), `constant_data` (`pseudo_counts`,
    `goal_prior`).

    Returns:
        arviz.InferenceData by ArviZ below 1, xarray.DataTree by ArviZ 1 and later. Both have
        `.to_netcdf(path)` and groups by name: `made['posterior']`.

    Raises:
        ImportError: ArviZ is not installed.
    """
    try:
        with warnings.catch_warnings():
            # Below 1 it announces version 1 at import.
            warnings.simplefilter('ignore', FutureWarning)
            # Here, as it takes seconds, and only this function needs it.
            import arviz
    except ImportError as error:
        raise ImportError(
            'Expected the Python package arviz (pip install arviz h5netcdf; in this project '
            'scripts/reproduce.sh posterior --arviz --out DIR installs it), got none.'
        ) from error
    groups = {
        'posterior': _parameters(draws.posterior),
        'posterior_predictive': {'counts': draws.posterior.counts},
        'prior': _parameters(draws.prior),
        'prior_predictive': {'counts': draws.prior.counts},
        'observed_data': {'counts': draws.observed},
        'constant_data': {'pseudo_counts': draws.pseudo_counts, 'goal_prior': draws.goal_prior},
    }
    coords = {
        'object': list(draws.objects),
        'x_i': list(draws.states),
        'action': list(draws.actions),
        'x_f': list(draws.states),
        'goal': list(draws.goals),
    }
    attrs = {'model': draws.model, 'policy': str(draws.policy)}
    if int(arviz.__version__.partition('.')[0]) >= 1:
        made = arviz.from_dict(groups, coords=coords, dims=DIMENSIONS)
    else:
        made = arviz.from_dict(**groups, coords=coords, dims=DIMENSIONS)
    made.attrs.update(attrs)
    return made


def _parameters(draws: Draws) -> dict[str, Any]:
    return {'transition': draws.transition, 'goal_probability': draws.goal_probability}
