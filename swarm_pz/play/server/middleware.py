"""Who may come in: only requests for a name that is served here, from a page that is; and pages, compressed."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path

from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from swarm_pz.play.server.budget import Accounts

STATIC = Path(__file__).parents[1] / "static"
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors "
)
_HEADERS = {"x-content-type-options": "nosniff", "referrer-policy": "no-referrer", "cache-control": "no-cache"}
_BESIDE_S = 0.001
"""Processor time charged for each request for the threads that find and read a page: theirs is not measured."""
_PATIENCE_S = 10.0
"""Seconds for which a request may wait until its connection and its address have processor time again."""


class AccessMiddleware:
    """Lets in requests for a name that is served here, from a page that is; each when it is its turn.

    A page elsewhere may make its name point here (DNS rebinding), or open a socket to here. Then its Host or its Origin
    is none of ours. Programs send no Origin.

    - `hosts`: names with their port.
    - `allowed_hosts`: names of a proxy or a tunnel that leads here; pages there may be encrypted.
    - `embedders`: origins of the pages that may hold this one in a frame.
    - `accounts`: the processor time of each request and WebSocket is charged to them; the application finds its in the
      scope.
    """

    def __init__(
        self,
        app: ASGIApp,
        hosts: Sequence[str],
        allowed_hosts: Sequence[str] = (),
        embedders: Sequence[str] = (),
        *,
        accounts: Accounts,
    ) -> None:
        self._accounts = accounts
        self._headers = _HEADERS | {"content-security-policy": _POLICY + (" ".join(embedders) or "'none'")}
        own, others = ({host.lower() for host in names} for names in (hosts, allowed_hosts))
        self._app, self._hosts = app, own | others
        self._origins = {f"http://{host}" for host in own | others} | {f"https://{host}" for host in others}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        account = scope["account"] = self._accounts.of(scope.get("client"))
        try:
            async with asyncio.timeout(_PATIENCE_S):
                await account.turn()
        except TimeoutError:
            text = "your network has used up its share of this server's processor; try again in a few seconds\n"
            await account.run(_refuse(429, text, scope, receive, send))
        else:
            account.spend(_BESIDE_S)
            await account.run(self._answer(scope, receive, send))

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        host, origin = headers.get("host", "").lower(), headers.get("origin")
        if host not in self._hosts or (origin is not None and origin.lower() not in self._origins):
            await _refuse(403, "this server is not known by that name\n", scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(self._headers)
            await send(message)

        await self._app(scope, receive, send_with_headers)


def page(path: str, name: str) -> Route:
    """Return the route of a page."""

    async def answer(_: Request) -> FileResponse:
        return FileResponse(STATIC / name)

    return Route(path, answer, middleware=[Middleware(GZipMiddleware)])


async def _refuse(status: int, text: str, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await WebSocket(scope, receive, send).close(code=1008)
    else:
        await PlainTextResponse(text, status)(scope, receive, send)
