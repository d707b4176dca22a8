"""Reports of an observation: as text and as JSON values."""

from __future__ import annotations

from math import degrees
from typing import Any

from likeme_perception.observation import ObjectObservation, TableObservation
from likeme_perception.top_view import Shape


def json_report(table: TableObservation) -> dict[str, Any]:
    """The observation as JSON values; lengths in m, angles in rad."""
    return {
        'hand_in_view': table.hand_in_view,
        'arm_in_view': table.arm_in_view,
        'reason': table.reason,
        'hand_pixels': len(table.hand),
        'objects': [
            {
                'name': o.name,
                'state': o.state_name,
                'state_probability': [round(p, 4) for p in o.state_probability],
                'visible': o.visible,
                'identity_probability': round(o.identity_probability, 4),
                'reason': o.reason,
            }
            | (_shape_values(o.shape) if o.shape else {})
            for o in table.objects
        ],
        'unknown_objects': [
            {
                'name': each.name,
                'fits': each.fits,
                'unknown_probability': round(each.probability, 4),
                'pixels': len(each.pixels),
            }
            | _shape_values(each.shape)
            for each in table.unknown_objects
        ],
    }


def _shape_values(shape: Shape) -> dict[str, Any]:
    values = {
        'yaw': shape.yaw,
        'length': shape.length,
        'width': shape.width,
        'height': shape.height,
    }
    return {'centroid': [round(v, 4) for v in shape.centroid]} | {
        k: round(v, 4) for k, v in values.items()
    }


def object_line(seen: ObjectObservation) -> str:
    """Name and state of an object with their probabilities, or why the state is not known."""
    if seen.state is None:
        return f'{seen.name}: {seen.state_name}, {seen.reason or "not seen yet"}'
    line = f'{seen.name}: {seen.state_name} {max(seen.state_probability):.2f}'
    if not seen.visible or seen.shape is None:
        return f'{line}, not in view'
    x, y, _ = seen.shape.centroid
    return (
        f'{line}, identity {seen.identity_probability:.2f}, at x {x:+.3f} m, y {y:+.3f} m, '
        f'major axis {degrees(seen.shape.yaw):+.0f} degrees'
    )


def text_report(table: TableObservation) -> str:
    """The observation as text, one line per object, hand and arm."""
    lines = [f'all states are unknown: {table.reason}'] if table.reason else []
    lines += [object_line(o) for o in table.objects]
    for each in table.unknown_objects:
        s = each.shape
        x, y, _ = s.centroid
        lines.append(
            f'{each.name}: at x {x:+.3f} m, y {y:+.3f} m, '
            f'{100 * s.length:.1f} x {100 * s.width:.1f} cm, '
            f'{100 * s.height:.1f} cm high, {len(each.pixels)} pixels'
        )
    if table.hand_in_view:
        lines.append(f'hand: {len(table.hand)} pixels')
    if table.arm_in_view:
        lines.append(f'robot arm: {len(table.arm)} pixels')
    return '\n'.join(lines) or 'nothing on the table'
