"""The desk in a browser: the page, and the screen behind its WebSocket."""

from __future__ import annotations

import asyncio
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from graph import HOLD_KEEPER, Graph

for _name in ('textual_serve', 'aiohttp'):
    pytest.importorskip(_name, reason=f'{_name}: scripts/operator.sh installs it')

import aiohttp  # noqa: E402


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(('localhost', 0))
        return int(listener.getsockname()[1])


async def visit(url: str) -> tuple[str, int, bytes]:
    """The page, the answer to another site's page, and what the screen shows first."""
    socket_url = f'{url}/ws?width=80&height=24'
    async with aiohttp.ClientSession() as session:
        async with session.get(url) as answer:
            page = await answer.text()
            assert answer.headers['Content-Security-Policy'].startswith("default-src 'self' ")
        try:
            await session.ws_connect(socket_url, origin='http://elsewhere.org')
            refused = 0
        except aiohttp.WSServerHandshakeError as error:
            refused = error.status
        screen = b''
        async with session.ws_connect(socket_url, origin=url) as connection:
            while b'no alarm' not in screen and b'ALARM' not in screen:
                message = await connection.receive(60)
                assert isinstance(message.data, bytes | str), screen
                data = message.data
                screen += data if isinstance(data, bytes) else data.encode()
        return page, refused, screen


@pytest.mark.graph
def test_the_screen_is_served_to_its_own_page_alone(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start(HOLD_KEEPER)
        port = free_port()
        words = ('-m', 'likeme_operator', '--web', '--port', str(port), '--by', 'Ada')
        server = graph.run('desk', sys.executable, *words)
        graph.until(lambda: "The operator's desk: http://localhost" in server.said, 20, 'a page')
        page, refused, screen = asyncio.run(visit(f'http://localhost:{port}'))
        again = subprocess.run(
            [sys.executable, *words], env=graph.env, capture_output=True, text=True, timeout=60,
            check=False,
        )  # fmt: skip
        server.signal(signal.SIGINT)

        assert 'LikeMe' in page
        # What is typed reaches the screen without a click on it.
        assert '.focus()' in page.split('</style>')[1]
        assert refused == 403
        assert b'LikeMe  domain' in screen
        assert again.returncode == 78
        assert f'Expected to listen on port {port} of localhost, got: ' in again.stderr
        assert server.wait(20) == 0
        assert server.said.endswith('Bye.\n')
