"""Who may come in, asked of the application itself."""

import asyncio

import pytest

from swarm_pz.play.server import middleware
from swarm_pz.play.server.budget import Accounts, Rate

(Access,) = (
    value for value in vars(middleware).values() if isinstance(value, type) and value.__module__ == middleware.__name__
)


def ask(kind, hosts=("Here.example:80", "[::1]:80"), allowed=(), embedders=(), **headers):
    """Return the messages by which a request, or a socket, is answered."""
    answers = []

    async def inner(scope, receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": [(b"x-own", b"1")]})
        await send({"type": "http.response.body", "body": b"inside"})

    async def send(message):
        answers.append(message)

    async def receive():
        return {"type": "websocket.connect"}

    scope = {"type": kind, "headers": [(name.encode(), value.encode()) for name, value in headers.items()]}
    asyncio.run(
        Access(inner, hosts, allowed, embedders, accounts=Accounts(Rate(1.0, 1.0), Rate(1.0, 1.0)))(
            scope, receive, send
        )
    )
    return answers


@pytest.mark.parametrize("host", ["here.example:80", "HERE.example:80", "[::1]:80"])
def test_names_are_the_same_in_capitals(host):
    for origin in ({}, {"origin": f"http://{host}"}):
        assert ask("http", host=host, **origin)[0]["status"] == 200


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"host": "here.example"},
        {"host": "there.example:80"},
        {"host": "here.example:80", "origin": "http://there.example:80"},
        {"host": "here.example:80", "origin": "https://here.example:80"},
        {"host": "here.example:80", "origin": ""},
    ],
)
def test_others_are_refused_before_anything_is_done(headers):
    start, body = ask("http", **headers)
    assert start["status"] == 403 and b"not known by that name" in body["body"]
    (closed,) = ask("websocket", **headers)
    assert (closed["type"], closed["code"]) == ("websocket.close", 1008)


@pytest.mark.parametrize("scheme", ["http", "https"])
@pytest.mark.parametrize("host", ["play.example.org", "PLAY.example.org", "here.example:80"])
def test_a_proxy_may_ask_by_its_name_or_ours_for_its_encrypted_pages(scheme, host):
    origin = f"{scheme}://play.example.org"
    assert ask("http", allowed=["Play.example.org"], host=host, origin=origin)[0]["status"] == 200
    assert ask("http", host=host, origin=origin)[0]["status"] == 403


def test_every_page_goes_out_with_headers_that_keep_it_to_itself():
    start, body = ask("http", host="here.example:80")
    headers = {name.decode(): value.decode() for name, value in start["headers"]}
    policy = dict(part.split(" ", 1) for part in headers.pop("content-security-policy").split("; "))
    assert policy == {
        "default-src": "'none'",
        "script-src": "'self'",
        "style-src": "'self'",
        "img-src": "'self' data:",
        "connect-src": "'self'",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    assert headers == {
        "x-own": "1",
        "x-content-type-options": "nosniff",
        "referrer-policy": "no-referrer",
        "cache-control": "no-cache",
    }
    assert body["body"] == b"inside"


def policy_of(**how):
    start, _ = ask("http", host="here.example:80", **how)
    (policy,) = [value.decode() for name, value in start["headers"] if name == b"content-security-policy"]
    return policy


def test_nobody_holds_the_page_in_a_frame_but_pages_of_the_origins_that_are_named():
    assert policy_of().endswith("frame-ancestors 'none'")
    embedders = ("https://lab.example", "http://localhost:3000")
    assert policy_of(embedders=embedders).endswith("; frame-ancestors https://lab.example http://localhost:3000")


def test_a_page_that_holds_this_one_opens_no_socket_by_itself():
    (closed,) = ask(
        "websocket", embedders=("https://lab.example",), host="here.example:80", origin="https://lab.example"
    )
    assert closed["code"] == 1008
