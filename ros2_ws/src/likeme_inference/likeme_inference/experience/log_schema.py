"""Database table of the decision log, beside those of the experience store.

likeme_log   one row per entry; entries are added at the end and never changed
"""

from __future__ import annotations

from sqlalchemy import DDL, BigInteger, Column, Integer, MetaData, String, Table, Text, event

#: Of its own: a store gets the table with its first entry.
log_metadata = MetaData()

log_entries = Table(
    'likeme_log',
    log_metadata,
    # 1, 2, 3 ... without a gap.
    Column('number', BigInteger().with_variant(Integer, 'sqlite'), primary_key=True),
    # System time of writing, ns since the epoch.
    Column('time', BigInteger, nullable=False),
    # The run of the process that wrote it.
    Column('run', String(100), nullable=False),
    Column('kind', String(40), nullable=False, index=True),
    # JSON with sorted keys.
    Column('text', Text, nullable=False),
    # Hash of the entry before, and of this one: SHA-256 as hexadecimal digits.
    Column('previous', String(64), nullable=False),
    Column('hash', String(64), nullable=False),
)

for _what in ('UPDATE', 'DELETE'):
    event.listen(
        log_entries,
        'after_create',
        DDL(  # type: ignore[no-untyped-call]
            f'CREATE TRIGGER likeme_log_no_{_what.lower()} BEFORE {_what} ON likeme_log '
            "BEGIN SELECT RAISE(ABORT, 'entries of the decision log are never changed'); END"
        ).execute_if(dialect='sqlite'),
    )
