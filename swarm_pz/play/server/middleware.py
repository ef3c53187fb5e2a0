"""Who may come in: only those who ask for a name that is served here, and from a page that is."""

from __future__ import annotations

from collections.abc import Sequence

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors "
)
_HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-cache",
}


class AccessMiddleware:
    """Lets in only those who ask for a name that is served here, and from a page that is.

    A page elsewhere may make its name point here (DNS rebinding) or open a socket to here; neither its
    Host nor its Origin is one of ours. Programs send no Origin.

    Parameters
    ----------
    app : ASGI application
    hosts : sequence of str
        Names with their port.
    allowed_hosts : sequence of str
        Names by which a proxy or a tunnel is reached that leads here; pages there may be encrypted.
    embedders : sequence of str
        Origins of the pages that may hold this one in a frame.
    """

    def __init__(
        self, app: ASGIApp, hosts: Sequence[str], allowed_hosts: Sequence[str] = (), embedders: Sequence[str] = ()
    ) -> None:
        self._headers = _HEADERS | {"content-security-policy": _POLICY + (" ".join(embedders) or "'none'")}
        own, others = ({host.lower() for host in names} for names in (hosts, allowed_hosts))
        self._app, self._hosts = app, own | others
        self._origins = {f"http://{host}" for host in own | others} | {f"https://{host}" for host in others}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        host, origin = headers.get("host", "").lower(), headers.get("origin")
        allowed = host in self._hosts and (origin is None or origin.lower() in self._origins)
        if not allowed:
            if scope["type"] == "websocket":
                await WebSocket(scope, receive, send).close(code=1008)
            else:
                await PlainTextResponse("this server is not known by that name\n", 403)(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(self._headers)
            await send(message)

        await self._app(scope, receive, send_with_headers)
