"""Estimation of the light: by the bare table or, where it saturates, by darker pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from likeme_core.table import DarkPlace
from likeme_perception.background import Background
from likeme_perception.dark_pixels import DarkPixels, at_places, of_background
from likeme_perception.light import (
    OVEREXPOSED,
    TAUGHT,
    Light,
    Rgb,
    agree,
    as_taught,
    light_of,
    table_colour,
)
from likeme_perception.rgbd import RgbdFrame
from likeme_perception.table_check import TableCheck

ImageB = NDArray[np.uint8]
ImageF = NDArray[np.float32]

# Greatest factor of a channel: beyond, so much of the objects' own colours saturates that acts
# were told wrongly (bench.sh eyes at three times the light).
_GREATEST = 2.6


class LightEstimator:
    """Compares the table and darker pixels with their taught colours."""

    def __init__(self, table: Rgb | None, places: tuple[DarkPlace, ...]) -> None:
        """table, places: colours under the taught light; None: that of the first background."""
        self._table = table
        self._places = places
        self._dark: DarkPixels | None = None

    def learned(self, background: Background, check: TableCheck) -> Background:
        """A new background in the taught colours."""
        shown = table_colour(background.colour, check.pixels) if check.enough else None
        self._table = self._table or shown
        self._dark = at_places(self._places, background.view)
        light = self._light(background.colour, background.depth, shown)
        background = replace(background, colour=as_taught(background.colour, light))
        if not light.reason:
            caps = light.caps if light.clipped else (255, 255, 255)
            self._dark = self._dark.with_others(of_background(background, caps))
        return background

    def given(self, background: Background) -> None:
        """Use a background that shows the taught colours."""
        self._dark = of_background(background)

    def light(self, frame: RgbdFrame, check: TableCheck) -> Light:
        """The light on a frame; the taught one if there is nothing to compare."""
        shown = table_colour(frame.rgb, check.bare_now(frame)) if check.enough else None
        return self._light(frame.rgb, frame.depth, shown)

    def _light(self, rgb: ImageB, depth: ImageF, shown: Rgb | None) -> Light:
        """The light on an image and its depth; shown: the table's colour, if it is seen."""
        if shown is None or self._table is None:
            return TAUGHT
        light = light_of(shown, self._table)
        if not (light.clipped or light.reason == OVEREXPOSED) or self._dark is None:
            return light
        told = self._dark.light(rgb, depth)
        if told is None or max(told.factor) > _GREATEST or not agree(told, shown, self._table):
            return light
        return told
