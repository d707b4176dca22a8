"""The desk's screen in a browser of this host."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sequence
from typing import Any

import typer
from aiohttp import web
from textual_serve.server import Server

HOST = 'localhost'
#: Added to the page: what is typed reaches the screen without a click on it, SPACE above all.
TYPING = """<script>
  const typed = () => document.querySelector('.xterm-helper-textarea');
  const observer = new MutationObserver(() => {
    if (typed()) { typed().focus(); observer.disconnect(); }
  });
  observer.observe(document.documentElement, {childList: true, subtree: true});
  for (const event of ['focus', 'keydown', 'click'])
    window.addEventListener(event, () => typed()?.focus(), true);
</script>"""
#: Nothing is fetched from elsewhere. The page names a font that would be: a host without internet
#: waits for it.
OWN_ONLY = "default-src 'self' 'unsafe-inline' data: blob:; connect-src 'self' ws:"


class DeskServer(Server):
    """Serves the screen at one port of this host, to its own page alone.

    Whoever reaches the page can hold, answer and resume. Pages of other sites that a browser has
    open reach this host, too: a connection from any of them is refused.
    """

    def __init__(self, command: Sequence[str], port: int) -> None:
        """command: opens the screen."""
        super().__init__(shlex.join(command), host=HOST, port=port, title='LikeMe')

    async def on_startup(self, app: web.Application) -> None:
        """Say where it is."""
        typer.echo(f"The operator's desk: {self.public_url}  Ctrl-C ends.")

    async def _make_app(self) -> web.Application:
        app = await super()._make_app()
        names = (f'{HOST}:{self.port}', f'127.0.0.1:{self.port}')

        async def own_page_only(request: web.Request, handler: Any) -> Any:
            own = request.headers.get('Origin') in [f'http://{name}' for name in names]
            if request.host not in names or (not own and request.path == '/ws'):
                raise web.HTTPForbidden(text=f'Open {self.public_url} in a browser of this host.')
            response = await handler(request)
            if request.path == '/':
                response.text = response.text.replace('</body>', f'{TYPING}</body>')
                response.headers['Content-Security-Policy'] = OWN_ONLY
            return response

        app.middlewares.append(web.middleware(own_page_only))
        return app


def serve_desk(by: str, network: bool, domain: int, skip_after: float, port: int) -> None:
    """Serve until Ctrl-C; exit code 78: the port cannot be used."""
    words = ['--by', by, '--domain', str(domain), '--skip-after', str(skip_after)]
    command = [sys.executable, '-m', 'likeme_operator', *words, *['--network'] * network]
    try:
        DeskServer(command, port).serve()
    except OSError as error:
        typer.echo(
            f'Expected to listen on port {port} of {HOST}, got: {error.strerror}.', err=True
        )
        raise typer.Exit(os.EX_CONFIG) from None
    typer.echo('Bye.', err=True)
