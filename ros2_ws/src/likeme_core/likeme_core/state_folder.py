"""Where a cell keeps what must outlive its processes: the hold, the motions, the decision log."""

from __future__ import annotations

import os
from pathlib import Path

#: Environment variable that names the folder of all cells' state on this host.
STATE_VARIABLE = 'LIKEME_STATE'


def state_folder(domain: int, namespace: str = '/') -> Path:
    """The folder of one cell, made if it is absent: one for each ROS domain and namespace.

    It is in $LIKEME_STATE, or else in $XDG_STATE_HOME/likeme, or else ~/.local/state/likeme.

    Raises:
        OSError: it cannot be made; the message names the variable that chooses another place.
    """
    inside = namespace.strip('/').replace('/', '.')
    folder = _root() / (f'domain_{domain}' + (f'.{inside}' if inside else ''))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(
            f'Expected a folder for the state of the cell at {folder}: {error.strerror}. '
            f'{STATE_VARIABLE} names another place.'
        ) from None
    return folder


def _root() -> Path:
    given = os.environ.get(STATE_VARIABLE)
    if given:
        return Path(given).expanduser().absolute()
    home = os.environ.get('XDG_STATE_HOME') or '~/.local/state'
    try:
        return Path(home).expanduser().absolute() / 'likeme'
    except RuntimeError:
        raise OSError(f'Expected a home folder, or {STATE_VARIABLE} set, got neither.') from None
