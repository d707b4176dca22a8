"""What a driver takes from a table state."""

from __future__ import annotations

import pytest
from geometry_msgs.msg import Point

from likeme_arm import messages
from likeme_arm.motion import ObjectView
from likeme_core.paper_world import RIGHT, WORLD
from likeme_core.ros.time import time_msg
from likeme_msgs.msg import ObjectState, TableState, UnknownObject


def table(frame: str = 'base_link') -> TableState:
    seen = time_msg(5)
    objects = [
        ObjectState(name='pear', state=1, centroid=Point(x=0.4, y=-0.1), major_axis_yaw=0.5),
        ObjectState(name='lemon', state=ObjectState.UNKNOWN, centroid=Point(x=0.4, y=0.1)),
        ObjectState(name='chicken', state=2, centroid=Point(x=float('nan'))),
    ]
    for item in objects[:2]:
        item.last_seen = seen
    return TableState(reference_frame=frame, objects=objects)


def test_views_are_of_what_was_ever_seen() -> None:
    views = messages.object_views(table(), WORLD)
    assert set(views) == {'pear', 'lemon'}
    assert views['pear'] == ObjectView(0.4, -0.1, 0.5, RIGHT)
    assert views['lemon'].state is None


def test_other_frames_are_refused() -> None:
    with pytest.raises(ValueError, match="'base_link', got 'map'"):
        messages.object_views(table('map'), WORLD)


def test_what_is_in_no_catalogue_is_stayed_clear_of() -> None:
    box = UnknownObject(
        centroid=Point(x=0.5, y=0.1), major_axis_yaw=0.2, major_axis_length=0.1,
        minor_axis_length=0.06, height=0.05,
    )  # fmt: skip
    views = messages.unknown_views(TableState(unknown_objects=[box]))
    assert views == {'unknown object 1': ObjectView(0.5, 0.1, 0.2, None, 0.1, 0.06, 0.05)}
