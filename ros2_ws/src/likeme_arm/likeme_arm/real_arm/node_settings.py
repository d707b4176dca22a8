"""Parameters of the driver of a real arm."""

from __future__ import annotations

from likeme_core.heartbeats import HOLD_TIMEOUT
from likeme_core.settings import Setting

INTERFACES = ('auto', 'action', 'topic')
SETTINGS: dict[str, Setting] = {
    'arm': Setting('panda', 'A shipped arm configuration, or the path of one.', read_only=True),
    'controller_interface': Setting(
        'auto',
        'action, topic, or auto: the action where control_msgs is installed.',
        read_only=True,
    ),
    'dry_run': Setting(False, 'Plan and show motions, move nothing.', read_only=True),
    'step': Setting(False, 'Ask before each motion of the arm.', read_only=True),
    'motion_budget': Setting(
        120.0, 'Greatest duration of a request, s.', (5.0, 3600.0), read_only=True
    ),
    'table_state_timeout': Setting(
        2.0, 'Greatest age of a table_state that is acted on, s.', (0.1, 60.0), read_only=True
    ),
    'hold_timeout': Setting(
        HOLD_TIMEOUT,
        's without a message of the hold keeper after which nothing moves.',
        (0.1, 5.0),
        read_only=True,
    ),
}


def check_interface(name: str) -> None:
    """Refuse an unknown interface.

    Raises:
        ValueError: expected and got.
    """
    if name not in INTERFACES:
        raise ValueError(
            f"Expected controller_interface to be {', '.join(INTERFACES)}, got '{name}'."
        )
