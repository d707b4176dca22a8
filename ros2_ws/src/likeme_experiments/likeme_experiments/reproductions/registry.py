"""The names of `reproduce.sh`, in the order of `all`."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from likeme_experiments.reproductions import (
    executed,
    exploration,
    gaze,
    gaze_blindfold,
    joint_goals,
    posterior,
    predictive_check,
    prior_sensitivity,
    tabletop,
)
from likeme_experiments.reproductions.report import Reproduction

REPRODUCTIONS: Mapping[str, Reproduction] = MappingProxyType(
    {
        **tabletop.REPRODUCTIONS,
        **posterior.REPRODUCTIONS,
        **predictive_check.REPRODUCTIONS,
        **prior_sensitivity.REPRODUCTIONS,
        **executed.REPRODUCTIONS,
        **exploration.REPRODUCTIONS,
        **joint_goals.REPRODUCTIONS,
        **gaze.FIGURES,
        **gaze_blindfold.FIGURES,
    }
)
