"""Rerun's viewer as a process of this host: its window, or its page for a browser."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import rerun_cli

from likeme_core.processes import interrupt, start

HOST = '127.0.0.1'
#: Beyond them the oldest data is dropped: of the window, and of what is kept for a page that is
#: opened late.
_VIEWER_MEMORY, _SERVER_MEMORY = '4GiB', '512MiB'
#: s in which the viewer must listen, and in which it must have ended.
_START, _GRACE = 30.0, 5.0


class ViewerError(Exception):
    """The viewer cannot be shown: expected and got."""


class PortError(ViewerError):
    """A TCP port is not free."""


class Viewer(NamedTuple):
    """A running viewer.

    Attributes:
        process: see subprocess.
        url: where recordings are sent to.
        page: its address for a browser; '': it is a window.
    """

    process: subprocess.Popen[bytes]
    url: str
    page: str

    def check(self) -> None:
        """Raise KeyboardInterrupt if it was closed."""
        if self.process.poll() is not None:
            raise KeyboardInterrupt


@contextmanager
def viewer(web_port: int | None, recording: Path | None = None) -> Iterator[Viewer]:
    """A viewer that ends with the context.

    Args:
        web_port: of the page for a browser; None: a window.
        recording: a file to show.

    Raises:
        PortError: the port is not free.
        ViewerError: there is no display, or the viewer does not start.
    """
    if web_port is None and not _has_display():
        raise ViewerError(
            'Expected a display for the window, got none: --web shows it in a browser, --save '
            'FILE.rrd writes it.'
        )
    port = _free_port(0)
    options = ['--bind', HOST, '--port', str(port), '--server-memory-limit', _SERVER_MEMORY]
    if web_port is None:
        options += ['--memory-limit', _VIEWER_MEMORY, '--hide-welcome-screen']
    else:
        options += ['--serve-web', '--web-viewer-port', str(_free_port(web_port))]
    files = [] if recording is None else [str(recording)]
    with tempfile.TemporaryDirectory(prefix='likeme-view-') as folder:
        configuration = {'XDG_CONFIG_HOME': folder}
        _switch_analytics_off(configuration)
        log = Path(folder, 'viewer.log')
        with log.open('wb') as out:
            process = start([_executable(), *options, *files], out, configuration)
        try:
            _wait_for(process, web_port or port, log)
            url = f'rerun+http://{HOST}:{port}/proxy'
            page = '' if web_port is None else f'http://{HOST}:{web_port}?url={quote(url, "")}'
            yield Viewer(process, url, page)
        finally:
            interrupt(process, _GRACE)


def _executable() -> str:
    # Not by its wrapper, a second process that a signal would have to reach, too.
    return str(Path(rerun_cli.__file__).with_name('rerun'))


def _has_display() -> bool:
    return sys.platform != 'linux' or any(
        os.environ.get(name) for name in ('DISPLAY', 'WAYLAND_DISPLAY')
    )


def _switch_analytics_off(configuration: dict[str, str]) -> None:
    """Usage data is not sent: a lab's network need not let anything out."""
    subprocess.run(
        [_executable(), 'analytics', 'disable'],
        env=os.environ | configuration,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        timeout=_START,
        check=True,
    )


def _free_port(wanted: int) -> int:
    """The port; 0: any that is free."""
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((HOST, wanted))
        except OSError as error:
            raise PortError(
                f'Expected to listen on port {wanted} of {HOST}, got: {error.strerror}.'
            ) from None
        return int(listener.getsockname()[1])


def _wait_for(process: subprocess.Popen[bytes], port: int, log: Path) -> None:
    """Until it listens."""
    deadline = time.monotonic() + _START
    while time.monotonic() < deadline and process.poll() is None:
        with socket.socket() as client:
            client.settimeout(1.0)
            if client.connect_ex((HOST, port)) == 0:
                return
        time.sleep(0.05)
    said = log.read_text('utf-8', 'replace').strip().splitlines()
    raise ViewerError(f'Expected a viewer, it does not start: {said[-1] if said else "silent"}')
