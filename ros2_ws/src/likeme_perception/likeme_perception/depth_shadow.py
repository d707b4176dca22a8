"""Things in a depth shadow: seen in colour where the sensor has no reading.

Beside a hand or an arm, the light of a structured-light camera does not reach the table, so a
thing that is half covered often has colour but no depth. Its place follows from where it must be:
on the table.
"""

from __future__ import annotations

import cv2
import numpy as np

from likeme_perception.background import Background
from likeme_perception.colour import UNKNOWN_LOG_DENSITY, colour_bins
from likeme_perception.identification import Catalogue
from likeme_perception.rgbd import RgbdFrame
from likeme_perception.segmentation import Blob, image_components, mask_of

# The catalogue must explain a colour better than "something unknown" by this log ratio.
_CLEARLY = 1.5
# Fewer pixels than this are no thing.
_FEW = 15


def shadowed_things(
    frame: RgbdFrame, background: Background, catalogue: Catalogue, least_area: float
) -> list[Blob]:
    """Blobs over the table that have a known thing's colour and no depth.

    Their points are where the pixels' rays reach half that thing's height.
    """
    blind = np.flatnonzero(np.isnan(frame.depth) & background.table)
    if len(blind) == 0 or not catalogue.objects:
        return []
    view = background.view
    bins = colour_bins(frame.rgb, blind)
    clear = catalogue.best_log_density[bins] > UNKNOWN_LOG_DENSITY + _CLEARLY
    blind, likeliest = blind[clear], catalogue.likeliest[bins[clear]]
    blobs = []
    for k, known in enumerate(catalogue.objects):
        chosen = blind[likeliest == k]
        if len(chosen) < _FEW:
            continue
        mine = mask_of(chosen, frame.depth.shape)
        opened = cv2.morphologyEx(mine, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        for pixels in image_components(np.asarray(opened, np.uint8)):
            z = (known.height / 2 - view.origin[2]) / view.slope.ravel()[pixels]
            area = float(view.pixel_area(z).sum())
            if area >= least_area:
                blobs.append(
                    Blob(pixels, view.points(pixels, z), colour_bins(frame.rgb, pixels), area)
                )
    return blobs
