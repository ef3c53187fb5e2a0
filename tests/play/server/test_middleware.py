"""Requests that are let in, and the headers of pages."""

import pytest

from swarm_pz.play.server.middleware import AccessMiddleware

LAB = ("https://lab.example", "http://localhost:3000")


async def ask(kind="http", allowed=(), embedders=LAB, **headers):
    """Return the messages that answer a request or a socket."""
    answers = []

    async def inner(scope, receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": [(b"x-own", b"1")]})
        await send({"type": "http.response.body", "body": b"inside"})

    async def send(message):
        answers.append(message)

    async def receive():
        return {"type": "websocket.connect"}

    hosts = "Here.example:80", "[::1]:80"
    scope = {
        "type": kind,
        "path": "/",
        "query_string": b"",
        "headers": [(name.encode(), value.encode()) for name, value in headers.items()],
    }
    await AccessMiddleware(inner, hosts, allowed, embedders)(scope, receive, send)
    return answers


async def status(**options):
    return (await ask(**options))[0]["status"]


async def test_names_that_are_served_come_in_in_any_case_and_a_proxys_by_its_own_or_encrypted():
    for host in ("here.example:80", "HERE.example:80", "[::1]:80"):
        assert await status(host=host) == await status(host=host, origin=f"http://{host}") == 200
        for scheme in ("http", "https"):
            for name in (host, "play.example.org", "PLAY.example.org"):
                headers = {"host": name, "origin": f"{scheme}://play.example.org"}
                assert await status(allowed=["Play.example.org"], **headers) == 200
                assert await status(**headers) == 403


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"host": "here.example"},
        {"host": "there.example:80"},
        {"host": "here.example:80", "origin": "http://there.example:80"},
        {"host": "here.example:80", "origin": "https://here.example:80"},
        {"host": "here.example:80", "origin": "null"},  # of a file, or of a frame in a sandbox
        {"host": "here.example:80", "origin": ""},
        {"host": "here.example:80", "origin": LAB[0]},
    ],
)
async def test_others_are_refused_before_anything_is_done(headers):
    start, body = await ask(**headers)
    assert start["status"] == 403 and b"not known by that name" in body["body"]
    (closed,) = await ask("websocket", **headers)
    assert (closed["type"], closed["code"]) == ("websocket.close", 1008)


@pytest.mark.parametrize("embedders", [(), LAB])
async def test_every_page_goes_out_with_headers_that_keep_it_to_itself_and_its_embedders(embedders):
    start, body = await ask(embedders=embedders, host="here.example:80")
    headers = {name.decode(): value.decode() for name, value in start["headers"]}
    policy = dict(part.split(" ", 1) for part in headers["content-security-policy"].split("; "))
    assert policy["default-src"] == policy["base-uri"] == "'none'" and policy["script-src"] == "'self'"
    assert policy["frame-ancestors"] == " ".join(embedders or ["'none'"])
    assert headers["x-content-type-options"] == "nosniff" and headers["referrer-policy"] == "no-referrer"
    assert headers["x-own"] == "1" and body["body"] == b"inside"
