"""Reasons why a frame cannot be used, one exception class each."""

from __future__ import annotations


class FrameError(ValueError):
    """A frame cannot be used; `reason` is its key in the diagnostics."""

    reason = 'size'


class EncodingError(FrameError):
    """The encoding of an image is not supported."""

    reason = 'encoding'


class NoDepthError(FrameError):
    """No pixel has a depth reading."""

    reason = 'no depth'


class NoTableError(FrameError):
    """There is no table plane where it is expected."""

    reason = 'no table'
