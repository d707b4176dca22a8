"""What a reader of a bag should know: remarks, and whether messages are missing."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

# A bag that is damaged everywhere says so this often, then stops repeating itself.
_MOST = 50


class About(StrEnum):
    """What a note is about: each is a check of `bag.sh doctor`."""

    FILES = 'files'
    METADATA = 'metadata'
    INDEX = 'index'
    CHUNKS = 'chunks'
    TOPICS = 'topics'
    QOS = 'qos'


class Note(NamedTuple):
    """One sentence."""

    about: About
    sentence: str
    # Whether it costs messages, or may.
    loss: bool


class Notes:
    """Sentences about one bag, in the order they came up, each once."""

    def __init__(self) -> None:
        self.all: list[Note] = []
        # False once messages are known or feared missing.
        self.complete = True
        self._left_out = 0

    def remark(self, about: About, sentence: str) -> None:
        """Something odd that costs no message."""
        self._add(Note(about, sentence, False))

    def loss(self, about: About, sentence: str) -> None:
        """Something that costs messages, or may."""
        self.complete = False
        self._add(Note(about, sentence, True))

    def lost(self, file: str, why: str) -> None:
        """Messages of a file that cannot be passed on."""
        self.loss(About.CHUNKS, f'{file}: messages not passed on: {why.rstrip(".")}.')

    def _add(self, note: Note) -> None:
        if note in self.all:
            return
        if len(self.all) < _MOST:
            self.all.append(note)
        else:
            self._left_out += 1

    def told(self) -> tuple[str, ...]:
        """All sentences; the last one counts those left out."""
        more = (f'{self._left_out} more of the kind.',) if self._left_out else ()
        return (*(note.sentence for note in self.all), *more)
