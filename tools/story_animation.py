"""Makes docs/story.webp, the README's animation, from a film of what perception sees.

scripts/see.sh bags/story_acts --out story.mp4
scripts/run.sh python tools/story_animation.py story.mp4 docs/story.webp
"""

from __future__ import annotations

import sys

import cv2
from PIL import Image

#: Every third frame of 12 a second, at its own speed.
STRIDE, DURATION_MS = 3, 250
SIZE = (480, 360)


def frames(film: str) -> list[Image.Image]:
    """Frames of a film, smaller."""
    video, found = cv2.VideoCapture(film), []
    while (read := video.read())[0]:
        small = cv2.resize(read[1], SIZE, interpolation=cv2.INTER_AREA)
        found.append(Image.fromarray(cv2.cvtColor(small, cv2.COLOR_BGR2RGB)))
    if not found:
        raise SystemExit(f'Expected a film, got {film}.')
    return found[::STRIDE]


def main(film: str, out: str) -> None:
    """Write an endless animation."""
    first, *rest = frames(film)
    first.save(
        out, save_all=True, append_images=rest, duration=DURATION_MS, loop=0, quality=45, method=6
    )


if __name__ == '__main__':
    main(*sys.argv[1:])
