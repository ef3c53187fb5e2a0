"""The start of the server: its names, its lines, and its parts."""

import asyncio
import socket
from unittest.mock import Mock

import pytest
import uvicorn

from swarm_pz.config import GameConfig
from swarm_pz.errors import CommandError
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig
from swarm_pz.play.server import serve as module
from swarm_pz.play.server.serve import addresses_of, names_of, origin_of, serve
from swarm_pz.policy import load


@pytest.fixture
def started(monkeypatch):
    """Give the configurations that the server would run with; it ends at once."""
    configs = []

    def run(server, sockets):
        configs.append(server.config)
        for listening in sockets:
            listening.close()

    monkeypatch.setattr(uvicorn.Server, "run", run)
    return configs


def greeted(app, host):
    """Return the first message to a client that connects by a name."""
    sent, events = [], iter([{"type": "websocket.connect"}, {"type": "websocket.receive", "text": '{"type":"hello"}'}])

    async def receive():
        if (message := next(events, None)) is not None:
            return message
        while len(sent) < 2:  # the acceptance and the welcome
            await asyncio.sleep(0)
        return {"type": "websocket.disconnect", "code": 1000}

    async def send(message):
        sent.append(message)

    scope = {"type": "websocket", "path": "/socket", "root_path": "", "headers": [(b"host", host.encode())]}
    asyncio.run(app(scope | {"subprotocols": [protocol.SUBPROTOCOL]}, receive, send))
    return protocol.decode_server(sent[1]["text"])


def test_who_follows_the_address_finds_the_table_that_was_asked_for(started, tmp_path, monkeypatch):
    table, printed = TableConfig(game=GameConfig(command_cells=6), min_command_interval=0.75), []
    draw = Mock(wraps=module.density_of)
    monkeypatch.setattr(module, "density_of", draw)
    options = {"table": table, "say": printed.append, "draw_code": str, "greeting": "hello", "page": "play=ring"}
    serve(load, {"ring": "rings"}, port=0, folder=tmp_path, **options)
    (config,) = started
    draw.assert_called_once()  # so that the first drawing waits for no compiler
    greeting, early, address, folder = printed
    assert greeting == "hello" and "not up yet" in early and str(tmp_path) in folder
    assert " http://127.0.0.1:" in address and address.endswith("/#play=ring")
    welcome = greeted(config.app, address.split("http://")[1].split("/")[0])
    assert (welcome.min_command_interval, welcome.command_cells) == (0.75, 6)
    assert welcome.policies == [protocol.PolicyInfo("ring", "rings")]
    assert config.ws_max_size == protocol.MAX_MESSAGE_BYTES and not config.ws_per_message_deflate
    assert config.server_header is False and config.timeout_graceful_shutdown and not config.proxy_headers
    assert config.ws_ping_interval and config.ws_ping_timeout


def test_a_server_that_is_open_says_so_and_a_proxy_leads_there_by_the_names_that_are_allowed(
    started, tmp_path, monkeypatch
):
    monkeypatch.setattr(module, "_own_addresses", lambda: {"192.0.2.7"})
    printed, allowed = [], ("play.example.org", "box.local:8443")
    options = {"say": printed.append, "draw_code": lambda url: f"code of {url}", "allowed_hosts": allowed}
    serve(load, {"ring": ""}, host="0.0.0.0", port=0, folder=tmp_path, **options)  # noqa: S104
    _, line, warning, code, _ = printed
    address = line.split(" at ")[1]
    assert address.startswith("http://192.0.2.7:") and address.endswith("/") and code == f"code of {address}"
    assert "OPEN TO THE NETWORK" in warning
    (config,) = started
    assert config.proxy_headers
    for host in allowed:
        assert greeted(config.app, host).policies == [protocol.PolicyInfo("ring", "")]


def test_a_place_where_nobody_can_listen_is_an_error(started, tmp_path):
    printed = []
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(CommandError, match=r"127.0.0.1.*--port"):
            serve(load, {}, port=taken.getsockname()[1], folder=tmp_path, say=printed.append, greeting="hello")
    assert not started and not printed  # nothing is printed before it listens


def test_a_server_is_known_by_its_names_and_no_others(monkeypatch):
    assert set(names_of("127.0.0.1", 8000)) == {"127.0.0.1:8000", "localhost:8000", "[::1]:8000"}
    assert set(names_of("::1", 80)) == {"127.0.0.1:80", "localhost:80", "[::1]:80", "127.0.0.1", "localhost", "[::1]"}
    assert names_of("192.0.2.7", 8000) == ["192.0.2.7:8000"]
    monkeypatch.setattr(module, "_own_addresses", lambda: {"192.0.2.7", "2001:db8::7"})
    monkeypatch.setattr(socket, "gethostname", lambda: "box")
    everywhere = names_of("0.0.0.0", 8000)  # noqa: S104
    others = ("127.0.0.1", "localhost", "[::1]", "box", "box.local", "192.0.2.7", "[2001:db8::7]")
    assert set(everywhere) == {f"{name}:8000" for name in others}, "and not 0.0.0.0"

    def fail(*_):
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", fail)
    with pytest.raises(CommandError, match="'nowhere'"):
        names_of("nowhere", 8000)


def test_addresses_to_invite_to_are_those_that_other_devices_reach():
    names = ["127.0.0.1:80", "localhost", "localhost:80", "[::1]:80", "box.local:80", "192.0.2.7:80", "192.0.2.7"]
    names += ["[2001:db8::7]:80", "[2001:db8::7]"]
    assert addresses_of(names) == ["http://192.0.2.7:80/", "http://[2001:db8::7]:80/", "http://box.local:80/"]


def test_what_is_no_name_is_not_allowed(started, tmp_path):
    for name in ("https://play.example.org", "play.example.org/", "", "*", "a b", "a:b"):
        with pytest.raises(CommandError, match="--allowed-hosts"):
            serve(load, {}, port=0, folder=tmp_path, allowed_hosts=[name])
    assert not started


def test_an_embedder_is_written_as_browsers_write_origins_and_what_is_none_is_refused():
    assert origin_of("https://LAB.example:443/") == "https://lab.example"
    assert origin_of("http://localhost:3000") == "http://localhost:3000"
    assert origin_of("http://[::1]:80") == "http://[::1]"
    bad = ("", "*", "lab.example", "https://*.example", "ftp://lab.example", "https://lab.example; script-src *")
    for embedder in (*bad, "https://lab.example\n"):
        with pytest.raises(CommandError, match="--embed"):
            origin_of(embedder)
