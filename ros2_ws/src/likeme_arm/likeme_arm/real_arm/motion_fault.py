"""Faults of an arm or its controller that end a motion."""

from __future__ import annotations


class MotionFaultError(Exception):
    """The arm does not do what its trajectory says; expected and got in one sentence."""
