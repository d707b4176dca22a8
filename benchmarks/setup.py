"""Time of the set-up in a fresh clone, and of a second call.

Packages are taken from the installer's cache; `--cold` ignores the cache.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
import time
from pathlib import Path

from report import Bar, option_parser, publish

ROOT = Path(__file__).resolve().parents[1]


def timed(*command: str | Path, **environment: str) -> float:
    """Seconds that a command takes in the user's own environment, or the end of the benchmark."""
    ours = [str(ROOT / '.venv'), str(ROOT / 'ros2_ws')]
    path = [p for p in os.environ['PATH'].split(os.pathsep) if not p.startswith(tuple(ours))]
    kept = {n: os.environ[n] for n in ('HOME', 'LANG', 'SSL_CERT_FILE') if n in os.environ}
    begin = time.monotonic()
    subprocess.run(
        command, check=True, env=kept | {'PATH': os.pathsep.join(path)} | environment, stdout=2
    )
    return time.monotonic() - begin


def main() -> None:
    """Clone what is committed, set it up twice, and publish."""
    parser = option_parser('setup')
    parser.add_argument('--cold', action='store_true', help='with empty caches')
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        clone = Path(folder) / 'likeme'
        cache = {'UV_CACHE_DIR': f'{folder}/uv', 'PIP_NO_CACHE_DIR': '1'}
        environment = cache if given.cold else {}
        timed('git', 'clone', '-q', ROOT, clone)
        setup = clone / 'scripts' / 'setup.sh'
        first, second = timed(setup, **environment), timed(setup, **environment)
    bars = [
        Bar('set-up of a fresh clone', first, 180.0, 's', 'the user'),
        Bar('second call', second, 1.0, 's', 'the user'),
    ]
    publish('setup', bars, {'caches': 'empty' if environment else 'warm'})


if __name__ == '__main__':
    main()
