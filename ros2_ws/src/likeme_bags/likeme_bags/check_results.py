"""The result of one check of `bag.sh doctor`."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple


class Level(StrEnum):
    """How serious it is: FAIL makes `bag.sh doctor` exit with 1."""

    OK = 'ok'
    WARN = 'warn'
    FAIL = 'FAIL'


class CheckResult(NamedTuple):
    """What a check found, in one sentence."""

    level: Level
    sentence: str


def ok(sentence: str) -> CheckResult:
    """Nothing is wrong."""
    return CheckResult(Level.OK, sentence)


def warn(sentence: str) -> CheckResult:
    """Unusual, or not checked; the bag can be used."""
    return CheckResult(Level.WARN, sentence)


def fail(sentence: str) -> CheckResult:
    """Something is missing or wrong."""
    return CheckResult(Level.FAIL, sentence)
