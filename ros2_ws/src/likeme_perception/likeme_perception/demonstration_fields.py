"""The fields of likeme_msgs/Demonstration, for the message and for the decision log."""

from __future__ import annotations

from typing import Any

from likeme_core.observations import Demonstration


def demonstration_fields(act: Demonstration) -> dict[str, Any]:
    """All fields but header and world, in the message's order; times in ns."""
    return {
        'object': act.object,
        'x_i': int(act.x_i),
        'x_f': int(act.x_f),
        'x_i_probability': [float(p) for p in act.x_i_probability],
        'x_f_probability': [float(p) for p in act.x_f_probability],
        'manner': int(act.manner),
        'manner_probability': float(act.manner_probability),
        'rise': float(act.rise),
        'start': act.start,
        'end': act.end,
    }
