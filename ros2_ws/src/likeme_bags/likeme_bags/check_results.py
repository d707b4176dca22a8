"""What a check may say."""

from __future__ import annotations

from enum import StrEnum


class Level(StrEnum):
    """How bad it is: fail makes `bag.sh doctor` exit with 1."""

    FINE = 'ok'
    WARN = 'warn'
    FAIL = 'FAIL'


Verdict = tuple[Level, str]


def fine(sentence: str) -> Verdict:
    """Nothing to object to."""
    return Level.FINE, sentence


def warn(sentence: str) -> Verdict:
    """Odd, but it can be used."""
    return Level.WARN, sentence


def fail(sentence: str) -> Verdict:
    """Something is missing or wrong."""
    return Level.FAIL, sentence
