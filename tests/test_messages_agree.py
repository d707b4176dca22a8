"""What inference is told over the network is what it is told offline: by the same camera's act."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from std_msgs.msg import Header

from likeme_core.observations import Demonstration
from likeme_core.tabletop import Manner, State
from likeme_inference import messages as to_inference
from likeme_perception import messages as from_perception
from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_replay import log_entries as entries
from likeme_replay.decision_log import TOPICS, entry_of

ACT = Demonstration(
    7_000_000_003, 'camera', 'pear', State.RIGHT, State.OFFTABLE, Manner.PLACE,
    3_000_000_001, 5_000_000_002, (0.0, 1.0, 0.0), (3.5e-14, 0.25, 0.75), 0.9, 0.1,
)  # fmt: skip
TABLE = TableObservation(
    7_000_000_003,
    'camera',
    settled=True,
    objects=(
        ObjectObservation('pear', State.OFFTABLE, (0.1, 0.2, 0.7)),
        ObjectObservation('lemon', None),
    ),
    demonstrations=(ACT,),
)
HEADER = Header(stamp=Time(sec=7, nanosec=3), frame_id='camera')


def test_a_demonstration_is_the_same_by_message_and_offline() -> None:
    """Every field, what is uncertain of it included."""
    message = from_perception.demonstration(ACT, HEADER)
    heard = to_inference.read_demonstration(message, {'pear'})
    assert heard == ACT
    event, _ = TOPICS['demonstration']
    fields = list(message.get_fields_and_field_types())
    assert entries.act_entry(ACT).line == entry_of(event, message, fields).line


def test_a_table_is_the_same_by_message_and_offline() -> None:
    message = from_perception.table_state(TABLE, HEADER, 'base_link')
    assert TABLE.snapshot == to_inference.read_table(message)
