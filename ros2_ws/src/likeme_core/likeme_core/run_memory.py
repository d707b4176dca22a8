"""What was set on a node in one run of the cell, for when the node is started again in it.

A run begins when a person starts a cell and ends with it: `start_cell` and the launch file give
each a name of its own in RUN_VARIABLE. A node that dies and is started again finds there what was
set on it; a new run has what its command line and files say.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

#: Environment variable with the name of the run; empty or unset: nothing is kept.
RUN_VARIABLE = 'LIKEME_RUN'


class RunMemory:
    """What was set on one node, kept in a file that is replaced as a whole.

    Attributes:
        run: name of the run; empty: none, and nothing is kept.
        parameters: name -> value of the parameters that were set.
        inactive: whether the node was deactivated.
    """

    def __init__(self, folder: Callable[[], Path], node: str, run: str | None = None) -> None:
        """Read what the run has kept.

        Args:
            folder: gives the place, see `state_folder`, or raises OSError.
            node: name of the node.
            run: name of the run; None: that of the environment.
        """
        self._folder, self._name = folder, f'{node}_in_run.json'
        self.run = os.environ.get(RUN_VARIABLE, '') if run is None else run
        self.parameters: dict[str, Any] = {}
        self.inactive = False
        kept = self._read() if self.run else {}
        if kept and kept['run'] == self.run:
            self.parameters = dict(kept['parameters'])
            self.inactive = bool(kept['inactive'])

    def save(self) -> None:
        """Write it.

        Raises:
            OSError: it cannot be written.
        """
        if not self.run:
            return
        kept = {'run': self.run, 'parameters': self.parameters, 'inactive': self.inactive}
        path = self._folder() / self._name
        new = path.with_suffix('.new')
        new.write_text(json.dumps(kept), encoding='utf-8')
        new.replace(path)

    def _read(self) -> dict[str, Any]:
        try:
            kept = json.loads((self._folder() / self._name).read_text(encoding='utf-8'))
        except (OSError, ValueError):
            return {}
        whole = isinstance(kept, dict) and {'run', 'parameters', 'inactive'} <= set(kept)
        return kept if whole and isinstance(kept['parameters'], dict) else {}
