"""A page in a headless Chromium: keys are typed into it, and its terminal's screen is read.

The page draws its terminal on a canvas. What it has drawn is known from the frames of its
WebSocket, which Chromium tells by its DevTools protocol.
"""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pyte
from websockets.sync.client import connect

from graph import SLACK

CHROMIUM = next(
    filter(None, map(shutil.which, ('chromium', 'chromium-browser', 'google-chrome'))), None
)
#: Of the keys that have names in the handbook: key, virtual key code and text.
KEYS = {
    'Up': ('ArrowUp', 38, ''), 'Down': ('ArrowDown', 40, ''), 'Enter': ('Enter', 13, '\r'),
    'Esc': ('Escape', 27, ''), 'SPACE': (' ', 32, ' '),
}  # fmt: skip


class BrowserScreen:
    """A page with a terminal; a context manager."""

    def __init__(
        self, url: str, folder: Path, meanwhile: Callable[[], object] = lambda: None
    ) -> None:
        """Open a page.

        Args:
            url: of it.
            folder: for Chromium's own files.
            meanwhile: called again and again while `shows` waits.
        """
        self._meanwhile = meanwhile
        self.screen = pyte.Screen(80, 24)
        self._stream = pyte.ByteStream(self.screen)
        self._ids = 0
        self._stack = ExitStack()
        words = ('--headless=new', '--no-sandbox', '--disable-gpu', '--no-first-run')
        self.process = subprocess.Popen(
            [str(CHROMIUM), *words, '--remote-debugging-port=0', f'--user-data-dir={folder}',
             '--window-size=1000,600', 'about:blank'],
            stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.process.stderr is not None
        told = next(line for line in self.process.stderr if 'DevTools listening' in line)
        host = told.split('ws://')[1].split('/')[0]
        with urllib.request.urlopen(f'http://{host}/json') as answer:
            page = next(each for each in json.load(answer) if each['type'] == 'page')
        self._page = self._stack.enter_context(
            connect(page['webSocketDebuggerUrl'], max_size=None)
        )
        self._call('Network.enable')
        self._call('Page.navigate', url=url)

    def __enter__(self) -> BrowserScreen:
        return self

    def __exit__(self, *_: object) -> None:
        self._call('Browser.close')
        self._stack.close()
        self.process.communicate(timeout=60)

    @property
    def text(self) -> str:
        """The screen as lines."""
        return '\n'.join(self.screen.display)

    def type(self, *keys: str) -> None:
        """Press keys."""
        for name in keys:
            key, code, text = KEYS.get(name) or (name, ord(name.upper()), name)
            press = {'key': key, 'windowsVirtualKeyCode': code}
            self._call('Input.dispatchKeyEvent', type='keyDown', text=text, **press)
            self._call('Input.dispatchKeyEvent', type='keyUp', **press)
            self.read(0.05)

    def read(self, timeout: float) -> None:
        """Take in what the page is sent within a time, s."""
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0:
            try:
                self._take(json.loads(self._page.recv(left)))
            except TimeoutError:
                return

    def shows(self, words: str, timeout: float = 10) -> str:
        """Read until some words are on the screen; the screen. timeout: s, see SLACK."""
        deadline = time.monotonic() + SLACK * timeout
        while words not in self.text:
            if time.monotonic() > deadline:
                raise AssertionError(f'Expected {words!r}, got the screen:\n{self.text}')
            self._meanwhile()
            self.read(0.05)
        return self.text

    def picture(self) -> bytes:
        """The page as PNG."""
        return base64.b64decode(self._call('Page.captureScreenshot')['data'])

    def _call(self, method: str, **values: Any) -> Any:
        self._ids += 1
        self._page.send(json.dumps({'id': self._ids, 'method': method, 'params': values}))
        while (message := json.loads(self._page.recv(60))).get('id') != self._ids:
            self._take(message)
        return message.get('result')

    def _take(self, message: Any) -> None:
        if message.get('method') == 'Network.webSocketCreated':
            size = re.search(r'width=(\d+)&height=(\d+)', message['params']['url'])
            assert size is not None
            self.screen.resize(int(size[2]), int(size[1]))
        elif message.get('method') == 'Network.webSocketFrameReceived':
            frame = message['params']['response']
            data = frame['payloadData']
            binary = frame['opcode'] == 2
            self._stream.feed(base64.b64decode(data) if binary else data.encode())
