"""What a replay counted, and the warnings that follow."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class ReplayCounts:
    """Counts of one replay.

    Attributes:
        frames, rejected: frames shown, and those of them that perception did not read;
            first_rejection: why the first was not.
        tables: frames that led to a table state.
        entries: lines of the log.
        missed: recorded inputs that did not arise in the replay.
        unrecorded: demonstrations of the replay that the live session did not receive.
        refused_inputs: recorded reports of arm or operator that the session refused.
        unpaired: images without a partner of their stamp.
        unread: frames that were not read in the live run, and are not shown.
        unreadable: messages whose bytes do not fit their type.
        info_changes: how often camera_info changed.
    """

    frames: int = 0
    rejected: int = 0
    tables: int = 0
    entries: int = 0
    missed: int = 0
    unrecorded: int = 0
    refused_inputs: int = 0
    unpaired: int = 0
    unread: int = 0
    unreadable: int = 0
    info_changes: int = 0
    first_rejection: str = ''

    @property
    def warnings(self) -> list[str]:
        """What differs from a faultless replay of the live run, in sentences."""
        sentences = {
            f'{self.rejected} of {self.frames} frames were not read; the first because: '
            f'{self.first_rejection}': self.rejected,
            f'camera_info changed {self.info_changes} times; each time the background had to be '
            'learned anew.': self.info_changes,
            f'{self.missed} inputs of the live session did not arise in the replay.': self.missed,
            f'{self.unrecorded} demonstrations of the replay were not received by the live '
            'session.': self.unrecorded,
            f'{self.refused_inputs} reports of arm or operator did not fit the session.':
                self.refused_inputs,
            f'{self.unpaired} images have no partner of their stamp and were not shown.':
                self.unpaired,
            f'{self.unreadable} messages do not fit their type.': self.unreadable,
            f'{self.unread} frames were not read in the live run and not shown.': self.unread,
        }  # fmt: skip
        return [sentence for sentence, count in sentences.items() if count]

    @property
    def failure(self) -> str:
        """Why nothing could be replayed, else ''."""
        if not self.frames:
            return 'Expected frames to show, got none: nothing was replayed.'
        if self.rejected == self.frames:
            return f'Expected frames that perception can read, got none of {self.frames}.'
        if self.info_changes and not self.tables:
            return f'Expected table states, got none of {self.frames} frames: camera_info changes.'
        return ''
