"""The result of a replay for the user: log, warnings and exit code."""

from __future__ import annotations

import sys

from likeme_replay.offline_replay import ReplayResult
from likeme_replay.replay_options import ReplayOptions


def report(options: ReplayOptions, result: ReplayResult) -> int:
    """Write the log and print the warnings; the exit code."""
    if options.log is not None and str(options.log) != '-':
        options.log.write_text(result.log, encoding='utf-8')
    elif options.log is not None:
        sys.stdout.write(result.log)
    counts = result.counts
    for sentence in (*result.warnings, *counts.warnings):
        print_message(sentence)
    print_message(f'{counts.frames} frames, {counts.entries} lines of log.')
    if result.agreements:
        print_message('; '.join(one.sentence for one in result.agreements) + '.')
    if counts.failure:
        print_message(counts.failure)
        return 1
    return 0 if result.complete and not counts.unreadable else 1


def print_message(sentence: str) -> None:
    """Print to stderr: stdout may hold the log."""
    print(f'replay: {sentence}', file=sys.stderr)
