"""Perception on one frame: of a known cell, or of any table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from likeme_perception.catalogue import Catalogue
from likeme_perception.config import SIDES, PerceptionConfig
from likeme_perception.observation import TableObservation
from likeme_perception.pipeline import TabletopPerception
from likeme_perception.rgbd import Intrinsics, RgbdFrame

# Stamps of the repeated frame are this far apart, ns.
_PERIOD = 100_000_000


def any_table(hands: bool) -> PerceptionConfig:
    """Settings that estimate camera pose and table from the image itself.

    hands: detect hands over any side of the table; needs an image of the empty table.
    """
    return PerceptionConfig(
        reference_frame='table',
        human_sides=SIDES if hands else (),
        robot_sides=(),
        background_frames=1,
        empty_at_start=hands,
        min_height=0.006,
        max_object_length=0.6,
        settle_time=0.0,
        absence_time=0.0,
    )


def aligned(background: RgbdFrame, frame: RgbdFrame) -> tuple[RgbdFrame, float]:
    """The background with its depth fitted to a later frame, and the residual deviation, m.

    Stereo cameras drift by some mm between two images, and one image does not show the sensor's
    noise. Fits z_frame = a z + b u + c v + d by least squares to the half of the pixels with the
    smallest residuals; the deviation is a robust estimate over all.
    """
    if background.depth.shape != frame.depth.shape:
        size, got = ('x'.join(map(str, f.depth.shape)) for f in (frame, background))
        raise ValueError(f'Expected a background of {size}, got {got}.')
    rows, columns = np.indices(frame.depth.shape)
    terms = np.stack([background.depth, columns / 640, rows / 640, np.ones_like(frame.depth)], -1)
    both = np.isfinite(background.depth) & np.isfinite(frame.depth)
    if np.count_nonzero(both) < 1000:
        raise ValueError(f'Expected 1000 pixels with depth in both, got {np.count_nonzero(both)}.')
    a, z = terms[both][::7].astype(np.float64), frame.depth[both][::7].astype(np.float64)
    fit = np.array([1.0, 0.0, 0.0, 0.0])
    for _ in range(8):
        off = np.abs(z - a @ fit)
        agree = off <= np.quantile(off, 0.5)
        fit = np.linalg.lstsq(a[agree], z[agree], rcond=None)[0]
    spread = 1.4826 * float(np.median(np.abs(z - a @ fit)))
    return replace(background, depth=np.asarray(terms @ fit, np.float32)), spread


def look_at(
    frame: RgbdFrame,
    intrinsics: Intrinsics,
    background: RgbdFrame | None = None,
    config: PerceptionConfig | None = None,
    catalogue: Catalogue | None = None,
) -> tuple[TableObservation, TabletopPerception]:
    """Run perception on one frame; without a background, the table plane is the background."""
    config = config or any_table(background is not None)
    config = replace(config, background_frames=1)
    if background is not None:
        background, spread = aligned(background, frame)
        config = replace(config, min_height=max(config.min_height, 3 * spread))
    perception = TabletopPerception(config, intrinsics, catalogue or Catalogue(()))
    table = perception.process(replace(background or frame, stamp=1))
    for k in range(2 if background is None else 6):
        table = perception.process(replace(frame, stamp=2 + k * _PERIOD))
    return table, perception
