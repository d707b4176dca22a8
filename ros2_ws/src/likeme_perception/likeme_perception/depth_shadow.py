"""Detection of known objects by colour in a depth shadow.

Beside a hand or an arm the projector of a structured-light camera does not reach the table, so a
partly occluded object often has colour but no depth. It is assumed to lie on the table.
"""

from __future__ import annotations

import cv2
import numpy as np

from likeme_perception.background import Background
from likeme_perception.blobs import Blob, image_components, mask_of
from likeme_perception.catalogue import Catalogue
from likeme_perception.colour import UNKNOWN_LOG_DENSITY, colour_bins
from likeme_perception.rgbd import RgbdFrame

# Least log likelihood ratio of a catalogue object against an unknown colour.
_LEAST_LOG_RATIO = 1.5
# Least number of pixels of a detection.
_LEAST_PIXELS = 15


def detect_in_depth_shadow(
    frame: RgbdFrame, background: Background, catalogue: Catalogue, least_area: float
) -> list[Blob]:
    """Blobs over the table with the colour of a known object and no depth.

    Their points lie where the pixels' rays reach half the height of that object.
    """
    no_depth = np.flatnonzero(np.isnan(frame.depth) & background.table)
    if len(no_depth) == 0 or not catalogue.objects:
        return []
    view = background.view
    bins = colour_bins(frame.rgb, no_depth)
    clear = catalogue.best_log_density[bins] > UNKNOWN_LOG_DENSITY + _LEAST_LOG_RATIO
    candidates, likeliest = no_depth[clear], catalogue.likeliest[bins[clear]]
    blobs = []
    for k, known in enumerate(catalogue.objects):
        chosen = candidates[likeliest == k]
        if len(chosen) < _LEAST_PIXELS:
            continue
        mask = mask_of(chosen, frame.depth.shape)
        opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        for pixels in image_components(np.asarray(opened, np.uint8)):
            z = (known.height / 2 - view.origin[2]) / view.slope.ravel()[pixels]
            area = float(view.pixel_area(z).sum())
            if area >= least_area:
                blobs.append(
                    Blob(pixels, view.points(pixels, z), colour_bins(frame.rgb, pixels), area)
                )
    return blobs
