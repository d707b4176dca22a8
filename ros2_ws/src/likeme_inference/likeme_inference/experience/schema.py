"""The tables of the experience store, version 1, in any database that SQLAlchemy speaks to.

likeme_experience   one row: the version of the schema
likeme_trial        one row a trial, by its identity
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
    Row,
    SmallInteger,
    String,
    Table,
)

from likeme_core.outcomes import MotionOutcome
from likeme_core.tabletop import Action, State
from likeme_inference.experience.trial import Pair, Place, Trial, TrialKey

SCHEMA_VERSION = 1

metadata = MetaData()

about = Table(
    'likeme_experience', metadata, Column('schema_version', Integer, primary_key=True)
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
    # m and rad, base_link; null where the camera did not see the object.
    *(
        Column(f'{when}_{what}', Float(53))
        for when in ('before', 'after')
        for what in Place._fields
    ),
    CheckConstraint(f'x_i >= 0 AND x_i < {len(State)}', name='x_i_is_a_state'),
    CheckConstraint(f'x_f >= 0 AND x_f < {len(State)}', name='x_f_is_a_state'),
    CheckConstraint(f'action >= 0 AND action < {len(Action)}', name='action_is_one'),
    Index('likeme_trial_by_pair', 'robot', 'campaign', 'object', 'x_i', 'action', 'x_f'),
)


def row_of(trial: Trial) -> dict[str, Any]:
    """A trial as the values of its row."""
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


def trial_of(row: Row[Any]) -> Trial:
    """The trial of a row.

    Raises:
        ValueError: the row holds numbers that stand for nothing.
    """
    values = row._mapping
    pair = Pair(values['object'], State(values['x_i']), Action(values['action']))
    return Trial(
        TrialKey(values['robot'], values['campaign'], pair, int(values['repetition'])),
        State(values['x_f']),
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
