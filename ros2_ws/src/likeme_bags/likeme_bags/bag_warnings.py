"""What is wrong with a bag, and whether it costs messages."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

# At most this many different warnings of one bag are kept.
_MOST = 50


class Subject(StrEnum):
    """What a warning is about: each is a check of `bag.sh doctor`."""

    FILES = 'files'
    METADATA = 'metadata'
    INDEX = 'index'
    CHUNKS = 'chunks'
    TOPICS = 'topics'
    QOS = 'qos'


class BagWarning(NamedTuple):
    """One sentence."""

    subject: Subject
    sentence: str
    # Whether it costs messages, or may.
    loss: bool


class BagWarnings:
    """The warnings about one bag, in the order they came up, each once."""

    def __init__(self) -> None:
        self.all: list[BagWarning] = []
        # False once messages are known or feared missing.
        self.complete = True
        self._left_out = 0

    def remark(self, subject: Subject, sentence: str) -> None:
        """Something unusual that costs no message."""
        self._add(BagWarning(subject, sentence, False))

    def loss(self, subject: Subject, sentence: str) -> None:
        """Something that costs messages, or may."""
        self.complete = False
        self._add(BagWarning(subject, sentence, True))

    def lost(self, file: str, why: str) -> None:
        """Messages of a file that cannot be passed on."""
        self.loss(Subject.CHUNKS, f'{file}: messages not passed on: {why.rstrip(".")}.')

    def _add(self, warning: BagWarning) -> None:
        if warning in self.all:
            return
        if len(self.all) < _MOST:
            self.all.append(warning)
        else:
            self._left_out += 1

    def sentences(self) -> tuple[str, ...]:
        """All sentences; the last one counts those left out."""
        more = (f'{self._left_out} more of the kind.',) if self._left_out else ()
        return (*(warning.sentence for warning in self.all), *more)
