"""What a replay tells the user: its log, its warnings and its exit code."""

from __future__ import annotations

import sys

from likeme_replay.offline_replay import Replayed
from likeme_replay.replay_options import Options


def conclude(given: Options, replayed: Replayed) -> int:
    """Write the log, say what is worth it; the exit code."""
    if given.log is not None and str(given.log) != '-':
        given.log.write_text(replayed.log, encoding='utf-8')
    elif given.log is not None:
        sys.stdout.write(replayed.log)
    for sentence in (*replayed.warnings, *replayed.tally.remarks):
        say(sentence)
    tally = replayed.tally
    say(f'{tally.frames} frames, {tally.entries} lines of log.')
    if replayed.agreements:
        say('; '.join(one.sentence for one in replayed.agreements) + '.')
    if not tally.frames:
        say('Expected frames to show, got none: nothing was replayed.')
        return 1
    return 0 if replayed.complete and not tally.unreadable else 1


def say(sentence: str) -> None:
    """Tell the user, beside the log that may be on stdout."""
    print(f'replay: {sentence}', file=sys.stderr)
