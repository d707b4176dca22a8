"""Summary of an experience store, as a table and as JSON."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from rich.table import Table

from likeme_core.world import World
from likeme_inference.experience.store import EndStateCount
from likeme_inference.experience.trial import Pair


def ends(world: World, tallies: Sequence[EndStateCount]) -> dict[Pair, tuple[int, ...]]:
    """How often each pair ended in each state, over all robots and campaigns."""
    counts: dict[Pair, list[int]] = defaultdict(lambda: [0] * len(world.states))
    for tally in tallies:
        counts[tally.pair][tally.x_f] += tally.trials
    return {pair: tuple(found) for pair, found in sorted(counts.items())}


def document(world: World, place: str, tallies: Sequence[EndStateCount]) -> dict[str, Any]:
    """A JSON document: totals, sources, and the counts of every pair."""
    sources: dict[tuple[str, str], int] = defaultdict(int)
    for tally in tallies:
        sources[tally.robot, tally.campaign] += tally.trials
    return {
        'store': place,
        'world': world.label,
        'trials': sum(tally.trials for tally in tallies),
        'sources': [
            {'robot': robot, 'campaign': campaign, 'trials': trials}
            for (robot, campaign), trials in sorted(sources.items())
        ],
        'counts': [
            {'object': p.object, 'x_i': p.x_i.name, 'action': p.action.name}
            | {state.name: found[state] for state in world.states}
            for p, found in ends(world, tallies).items()
        ],
    }


def table(world: World, place: str, tallies: Sequence[EndStateCount]) -> Table:
    """One row for each object and x_i: how often each action ended in each state."""
    about = document(world, place, tallies)
    sources = '; '.join(
        f'{s["trials"]} by {s["robot"]} in {s["campaign"]}' for s in about['sources']
    )
    states = '/'.join(state.name for state in world.states)
    shown = Table(
        title=f'{about["trials"]} trials in {place}',
        caption=f'{sources or "No trial yet."} Each cell: x_f {states}.',
    )
    for heading in ('object', 'x_i', *(action.name for action in world.actions)):
        shown.add_column(heading)
    found = ends(world, tallies)
    for name, x_i in sorted({(pair.object, pair.x_i) for pair in found}):
        rows = [found.get(Pair(name, x_i, action)) for action in world.actions]
        shown.add_row(name, x_i.name, *('/'.join(map(str, row)) if row else '' for row in rows))
    return shown
