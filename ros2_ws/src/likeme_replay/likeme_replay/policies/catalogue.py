"""All policies, and their table for the documentation."""

from __future__ import annotations

from types import ModuleType

from likeme_replay.policies import (
    decisions,
    demonstrations,
    heartbeats,
    holds,
    inputs,
    motions,
    outcomes,
    questions,
    tables,
)
from likeme_replay.policies.policy import Policy

#: The modules, in the order of a story.
MODULES: tuple[ModuleType, ...] = (
    holds, motions, tables, demonstrations, decisions, outcomes, questions, inputs, heartbeats
)  # fmt: skip


def _policies_of(module: ModuleType) -> tuple[type[Policy], ...]:
    members = vars(module).values()
    own = [m for m in members if isinstance(m, type) and m.__module__ == module.__name__]
    return tuple(member for member in own if issubclass(member, Policy))


POLICIES = tuple(policy for module in MODULES for policy in _policies_of(module))


def table() -> str:
    """The table of all policies in Markdown."""
    rows = ['| policy | demands | reads |', '| --- | --- | --- |']
    for policy in POLICIES:
        topics = ', '.join(f'`{topic}`' for topic in policy.topics())
        rows.append(f'| `{policy.name()}` | {policy.sentence()} | {topics} |')
    return '\n'.join(rows)
