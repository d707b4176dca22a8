"""Database tables of the experience store, schema version 1.

likeme_experience   one row: the schema version
likeme_world        one row: the world whose numbers x_i, action and x_f are; older stores
                    have none and are of the default world
likeme_trial        one row per trial, by its identity
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    Column,
    Float,
    Index,
    Integer,
    MetaData,
    SmallInteger,
    String,
    Table,
)
from sqlalchemy.engine import Row

from likeme_core.outcomes import MotionOutcome
from likeme_core.world import World
from likeme_inference.experience.trial import Pair, Place, Trial, TrialKey

SCHEMA_VERSION = 1

metadata = MetaData()

about = Table(
    'likeme_experience', metadata, Column('schema_version', Integer, primary_key=True)
)  # fmt: skip

world = Table(
    'likeme_world', metadata, Column('label', String(100), primary_key=True)
)  # fmt: skip

trials = Table(
    'likeme_trial',
    metadata,
    Column('identity', String(36), primary_key=True),
    Column('robot', String(100), nullable=False),
    Column('campaign', String(100), nullable=False),
    Column('object', String(100), nullable=False),
    Column('x_i', SmallInteger, nullable=False),
    Column('action', SmallInteger, nullable=False),
    Column('repetition', BigInteger, nullable=False),
    Column('x_f', SmallInteger, nullable=False),
    Column('motion', SmallInteger, nullable=False),
    Column('seed', BigInteger, nullable=False),
    Column('version', String(100), nullable=False),
    # ns since the epoch.
    Column('time', BigInteger, nullable=False),
    # m and rad, base_link; null if the camera did not see the object.
    *(
        Column(f'{when}_{what}', Float(53))
        for when in ('before', 'after')
        for what in Place._fields
    ),
    CheckConstraint('x_i >= 0', name='x_i_is_a_state'),
    CheckConstraint('x_f >= 0', name='x_f_is_a_state'),
    CheckConstraint('action >= 0', name='action_is_one'),
    Index('likeme_trial_by_pair', 'robot', 'campaign', 'object', 'x_i', 'action', 'x_f'),
)


def row_of(trial: Trial) -> dict[str, Any]:
    """The column values of a trial."""
    key, pair = trial.key, trial.key.pair
    return {
        'identity': key.identity,
        'robot': key.robot,
        'campaign': key.campaign,
        'object': pair.object,
        'x_i': int(pair.x_i),
        'action': int(pair.action),
        'repetition': key.repetition,
        'x_f': int(trial.x_f),
        'motion': int(trial.motion),
        'seed': trial.seed,
        'version': trial.version,
        'time': trial.time,
        **_columns('before', trial.before),
        **_columns('after', trial.after),
    }


def trial_of(row: Row[Any], world: World) -> Trial:
    """The trial of a row.

    Raises:
        ValueError: numbers without a state, action or motion outcome.
    """
    values = row._mapping
    pair = Pair(values['object'], world.state(values['x_i']), world.action(values['action']))
    return Trial(
        TrialKey(values['robot'], values['campaign'], pair, int(values['repetition'])),
        world.state(values['x_f']),
        MotionOutcome(values['motion']),
        int(values['seed']),
        values['version'],
        int(values['time']),
        _place(values, 'before'),
        _place(values, 'after'),
    )


def _columns(when: str, place: Place | None) -> dict[str, float | None]:
    fields = Place._fields
    values = (None,) * len(fields) if place is None else place
    return {f'{when}_{name}': value for name, value in zip(fields, values, strict=True)}


def _place(values: Any, when: str) -> Place | None:
    found = [values[f'{when}_{name}'] for name in Place._fields]
    return None if None in found else Place(*map(float, found))
