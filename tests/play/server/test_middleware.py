"""Who may come in, asked of the application itself."""

import pytest

from swarm_pz.play.server.budget import Accounts, Rate
from swarm_pz.play.server.middleware import AccessMiddleware

pytestmark = pytest.mark.anyio


async def ask(kind, allowed=(), embedders=(), **headers):
    """Return the messages by which a request, or a socket, is answered."""
    answers = []

    async def inner(scope, receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": [(b"x-own", b"1")]})
        await send({"type": "http.response.body", "body": b"inside"})

    async def send(message):
        answers.append(message)

    async def receive():
        return {"type": "websocket.connect"}

    accounts, hosts = Accounts(Rate(1.0, 1.0), Rate(1.0, 1.0)), ("Here.example:80", "[::1]:80")
    scope = {"type": kind, "headers": [(name.encode(), value.encode()) for name, value in headers.items()]}
    await AccessMiddleware(inner, hosts, allowed, embedders, accounts=accounts)(scope, receive, send)
    return answers


@pytest.mark.parametrize("host", ["here.example:80", "HERE.example:80", "[::1]:80"])
@pytest.mark.parametrize("has_origin", [True, False])
async def test_names_are_the_same_in_capitals(host, has_origin):
    origin = {"origin": f"http://{host}"} if has_origin else {}
    assert (await ask("http", host=host, **origin))[0]["status"] == 200


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"host": "here.example"},
        {"host": "there.example:80"},
        {"host": "here.example:80", "origin": "http://there.example:80"},
        {"host": "here.example:80", "origin": "https://here.example:80"},
        {"host": "here.example:80", "origin": "null"},
        {"host": "here.example:80", "origin": ""},
        {"host": "here.example:80", "origin": "https://lab.example"},
    ],
)
async def test_others_are_refused_before_anything_is_done(headers):
    start, body = await ask("http", embedders=("https://lab.example",), **headers)
    assert start["status"] == 403 and b"not known by that name" in body["body"]
    (closed,) = await ask("websocket", embedders=("https://lab.example",), **headers)
    assert (closed["type"], closed["code"]) == ("websocket.close", 1008)


@pytest.mark.parametrize("scheme", ["http", "https"])
@pytest.mark.parametrize("host", ["play.example.org", "PLAY.example.org", "here.example:80"])
async def test_a_proxy_may_ask_by_its_name_or_ours_for_its_encrypted_pages(scheme, host):
    origin = f"{scheme}://play.example.org"
    assert (await ask("http", allowed=["Play.example.org"], host=host, origin=origin))[0]["status"] == 200
    assert (await ask("http", host=host, origin=origin))[0]["status"] == 403


@pytest.mark.parametrize("embedders", [(), ("https://lab.example", "http://localhost:3000")])
async def test_every_page_goes_out_with_headers_that_keep_it_to_itself_and_its_embedders(embedders):
    start, body = await ask("http", embedders=embedders, host="here.example:80")
    headers = {name.decode(): value.decode() for name, value in start["headers"]}
    policy = dict(part.split(" ", 1) for part in headers.pop("content-security-policy").split("; "))
    own, none = dict.fromkeys(("script-src", "style-src", "connect-src"), "'self'"), "'none'"
    assert policy == own | {"img-src": "'self' data:", "frame-ancestors": " ".join(embedders) or none} | dict.fromkeys(
        ("default-src", "base-uri", "form-action"), none
    )
    assert headers == {
        "x-own": "1",
        "x-content-type-options": "nosniff",
        "referrer-policy": "no-referrer",
        "cache-control": "no-cache",
    }
    assert body["body"] == b"inside"
