"""Access control of requests: by host name, origin, length of path, and connections of an address."""

from __future__ import annotations

from collections import Counter
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

MOST_CONNECTIONS = 200
"""Requests and WebSockets of one address at the same time: enough for a class behind one address."""
MOST_PATH_BYTES = 1000
"""Longest path with its query."""
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors "
)
_HEADERS = {"x-content-type-options": "nosniff", "referrer-policy": "no-referrer", "cache-control": "no-cache"}


class AccessMiddleware:
    """Refuses requests for other host names, from other sites, with long paths, or of addresses with too many.

    Another site may make its name point here (DNS rebinding), or open a socket to this server: then its Host or its
    Origin is not this server's. Programs send no Origin.

    - `hosts`: names with their port.
    - `allowed_hosts`: names of a proxy or a tunnel that leads here; it may use HTTPS.
    - `embedders`: origins of the pages that may hold this one in a frame.
    """

    def __init__(
        self, app: ASGIApp, hosts: Sequence[str], allowed_hosts: Sequence[str] = (), embedders: Sequence[str] = ()
    ) -> None:
        self._headers = _HEADERS | {"content-security-policy": _POLICY + (" ".join(embedders) or "'none'")}
        own, others = ({host.lower() for host in names} for names in (hosts, allowed_hosts))
        self._app, self._hosts = app, own | others
        self._origins = {f"http://{host}" for host in own | others} | {f"https://{host}" for host in others}
        self._open: Counter[str] = Counter()
        """Requests and WebSockets that are open now, by address."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        address, *_ = scope.get("client") or ("",)
        status, reason = self._fault(scope, address)
        if status:
            await _refuse(status, reason, scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(self._headers)
            await send(message)

        self._open[address] += 1
        try:
            await self._app(scope, receive, send_with_headers)
        finally:
            self._open[address] -= 1
            if not self._open[address]:
                del self._open[address]

    def _fault(self, scope: Scope, address: str) -> tuple[int, str]:
        """Return the status and the reason of a refusal; status 0 lets the request in."""
        if len(scope["path"]) + len(scope.get("query_string", b"")) > MOST_PATH_BYTES:
            return 414, f"a path may have {MOST_PATH_BYTES} bytes here\n"
        headers = Headers(scope=scope)
        host, origin = headers.get("host", "").lower(), headers.get("origin")
        if host not in self._hosts or (origin is not None and origin.lower() not in self._origins):
            return 403, "this server is not known by that name\n"
        if self._open[address] >= MOST_CONNECTIONS:
            return 429, f"your network has {MOST_CONNECTIONS} connections to this server; close some, and try again\n"
        return 0, ""


def page(path: str, file: Path) -> Route:
    """Return the route of a page."""

    async def answer(_: Request) -> FileResponse:
        return FileResponse(file)

    return Route(path, answer, middleware=[Middleware(GZipMiddleware)])


async def _refuse(status: int, reason: str, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await WebSocket(scope, receive, send).close(code=1008)
    else:
        await PlainTextResponse(reason, status)(scope, receive, send)
