"""Why a frame cannot be used, by class: what is counted, and said, is the reason."""

from __future__ import annotations


class FrameError(ValueError):
    """A frame that cannot be used; `reason` is a short word for it."""

    reason = 'size'


class EncodingError(FrameError):
    """An image is in an encoding that is not known."""

    reason = 'encoding'


class NoDepthError(FrameError):
    """No pixel has a depth reading."""

    reason = 'no depth'


class NoTableError(FrameError):
    """There is no table plane where it should be."""

    reason = 'no table'
