"""The start of the server: its address, its names, and its end."""

from __future__ import annotations

import contextlib
import gc
import ipaddress
import re
import socket
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

import uvicorn

from swarm_pz.config import RED, TICKS_PER_SECOND
from swarm_pz.errors import CommandError
from swarm_pz.play import protocol
from swarm_pz.play.game import LiveGame, TableConfig
from swarm_pz.play.server.app import Server
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.policy_workers import Loader, PolicyWorkers
from swarm_pz.play.server.robots import Robots
from swarm_pz.play.server.server_context import COUNTDOWN_S, ServerContext
from swarm_pz.play.server.views import capture_fields, target_message
from swarm_pz.play.strokes import WIDEST, Stroke, density_of
from swarm_pz.play.studies.folder import StudyFolder

LOOPBACK = ("127.0.0.1", "::1", "localhost")
_END_S = 3
_ACCEPTED_AT_ONCE, _RECEIVED_AT_ONCE = 32, 2 * 1024
"""Connections that one turn of the event loop accepts, and bytes of each that it reads: games wait."""
_MOST_CONNECTIONS, _MOST_HEADER_BYTES = 1000, 16 * 1024
_PING_S = 20.0
_SWITCH_S = 0.0001
"""The interpreter's thread switch interval in seconds, less than a tick takes: with 0.0005, the verification of a
recording delayed the event loop by 10 to 50 ms."""


def names_of(host: str, port: int) -> list[str]:
    """Return the names, with port, of a server that listens at `host`.

    Raises CommandError if there is no such address.
    """
    if host in LOOPBACK:
        names = set(LOOPBACK)
    else:
        try:
            own = socket.gethostname()
            addresses = {str(entry[4][0]) for entry in socket.getaddrinfo(host, port)}
            if any(ipaddress.ip_address(address).is_unspecified for address in addresses):
                names = set(LOOPBACK) | {own, f"{own}.local"} | _own_addresses()  # 0.0.0.0 is no name
            else:
                names = {host} | addresses
        except OSError as error:
            raise CommandError(f"there is no host {host!r} here: {error.strerror}") from error
    hosts = [_in_address(name) for name in sorted(names)]
    return [f"{name}:{port}" for name in hosts] + (hosts if port == 80 else [])


def check_allowed(names: Sequence[str]) -> None:
    """Check that names, perhaps with a port, are valid as a browser's Host; raise CommandError if not."""
    for name in names:
        if not re.fullmatch(r"[A-Za-z0-9._-]+(:[0-9]{1,5})?|\[[0-9A-Fa-f:.]+\](:[0-9]{1,5})?", name):
            raise CommandError(
                f"--allowed-hosts takes names as browsers ask for them, such as play.example.org or box.local:8443, "
                f"got {name!r}"
            )


def origin_of(embedder: str) -> str:
    """Return an origin as browsers write it; raise CommandError if it is malformed."""
    if not re.fullmatch(r"https?://([A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\])(:[0-9]{1,5})?/?", embedder):
        raise CommandError(
            "--embed takes the origin of a page, such as https://lab.example or http://localhost:3000, "
            f"got {embedder!r}"
        )
    origin = embedder.removesuffix("/").lower()
    default = ":443" if origin.startswith("https") else ":80"
    return origin.removesuffix(default)


def addresses_of(names: Sequence[str]) -> list[str]:
    """Return the page's addresses for other devices, IP addresses before names."""

    def is_number(name: str) -> bool:
        return name.startswith("[") or name.split(":")[0].replace(".", "").isdigit()

    local = ("127.", "[::1]", "localhost")
    elsewhere = [name for name in names if ":" in name.rsplit("]", 1)[-1] and not name.startswith(local)]
    return [f"http://{name}/" for name in sorted(elsewhere, key=lambda name: (not is_number(name), "[" in name, name))]


def _own_addresses() -> set[str]:
    """Return this machine's addresses on its networks, by its routes and its name."""
    addresses = set()
    with contextlib.suppress(OSError):
        resolved = {str(entry[4][0]) for entry in socket.getaddrinfo(socket.gethostname(), None)}
        addresses |= {one for one in resolved if "%" not in one and not ipaddress.ip_address(one).is_loopback}
    for family, elsewhere in ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1")):
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((elsewhere, 9))  # nothing is sent
                addresses.add(str(probe.getsockname()[0]))
        except OSError:
            continue
    return addresses


def _in_address(host: str) -> str:
    """Return a name or an IP address as it is written before a port."""
    return f"[{host}]" if ":" in host else host


def _warm_up(table: TableConfig, robots: bool) -> None:
    """Compile kernels, so that neither the first game nor the first drawing waits."""
    game = LiveGame(table, 0, robots=robots)
    game.advance(TICKS_PER_SECOND)
    capture_fields(game.simulator)
    target_message(RED, 0, game.simulator.games.coefficients[0, RED])
    dot = Stroke(brush="attract", width=WIDEST, points=((0.5, 0.5),))
    density_of([dot], table.game.command_cells, table.mapping)


def serve(
    loader: Loader,
    policies: Mapping[str, str],
    *,
    host: str = "127.0.0.1",
    port: int = 8000,
    allowed_hosts: Sequence[str] = (),
    folder: Path = Path("runs/games"),
    page: str = "",
    countdown_s: float = COUNTDOWN_S,
    table: TableConfig = TableConfig(),  # noqa: B008  (frozen)
    say: Callable[[str], None] = print,
    draw_code: Callable[[str], str] | None = None,
    cards: Mapping[str, protocol.Card] | None = None,
    record_labels: bool = True,
    study: StudyFolder | None = None,
    embedders: Sequence[str] = (),
    robots: Robots | None = None,
    beside: Callable[[str], AbstractContextManager[None]] = lambda _: contextlib.nullcontext(),
    greeting: str = "",
) -> None:
    """Serve until the process ends.

    - `loader`: loads a policy by its name, for a game; other processes import it.
    - `policies`: names of those that may have a seat, with a line about each; `cards` of rated ones.
    - `host`, `port`: where to listen; port 0 takes any free one.
    - `allowed_hosts`: names of a proxy on this machine, whose X-Forwarded-For is then trusted.
    - `folder`: of the recordings; `record_labels` writes the players' labels there.
    - `page`: added to the printed address after its ``#``.
    - `table`: the default configuration of rooms.
    - `say`: prints lines, `greeting` first; `draw_code` draws an address as text.
    - `study`: the server is for this study alone.
    - `embedders`: origins of pages that may hold this one in a frame.
    - `robots`: fly the games.
    - `beside`: maps the server's address on this machine to a context in which it serves.

    Raises CommandError if it cannot listen there, or a name or an origin is malformed.
    """
    check_allowed(allowed_hosts)
    origins = [origin_of(embedder) for embedder in embedders]
    listening = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVED_AT_ONCE)  # accepted ones inherit it
    try:
        listening.bind((host, port))
        listening.listen(128)
    except OSError as error:
        listening.close()
        raise CommandError(f"cannot listen at {host}, port {port}: {error.strerror}; try another --port") from error
    port = listening.getsockname()[1]
    names = names_of(host, port)
    context = ServerContext(
        folder=folder,
        workers=PolicyWorkers(loader),
        table=table,
        countdown_s=countdown_s,
        record_labels=record_labels,
        robots=robots,
    )
    lobby = Lobby(context, policies, cards, addresses_of(names), origins, is_hosted=study is not None)
    host_of_study = None
    if study is not None:
        from swarm_pz.play.server.studies import StudyHost  # it needs the extra lab

        host_of_study = StudyHost(study, lobby)
    app = Server(lobby, host_of_study).app(names, allowed_hosts)
    listens_everywhere = host in ("0.0.0.0", "::")  # noqa: S104
    shown = next(iter(sorted(_own_addresses())), socket.gethostname()) if listens_everywhere else host
    root = f"http://{_in_address(shown)}:{port}/"
    address = f"{root}study" if study is not None else root + (f"#{page}" if page else "")
    if greeting:
        say(greeting)
    say("the page is not up yet: its address follows, after up to a minute where the game must be compiled first")
    _warm_up(table, robots is not None)  # before the address is shown
    say(f"swarm-pz is at {address}")
    if host_of_study is not None:
        say(f"participants type their code there; you look on at {root}study/monitor#{host_of_study.token}")
    if host not in LOOPBACK:
        say("OPEN TO THE NETWORK: whoever reaches this machine can play, and nothing is encrypted")
        if draw_code is not None:
            say(draw_code(address))
    say(f"games are recorded in {folder}; end with Ctrl-C")
    config = uvicorn.Config(
        app,
        log_level="error",
        http="h11",
        ws="websockets-sansio",
        limit_concurrency=_MOST_CONNECTIONS,
        h11_max_incomplete_event_size=_MOST_HEADER_BYTES,
        ws_max_size=protocol.MAX_MESSAGE_BYTES,
        ws_max_queue=32,
        backlog=_ACCEPTED_AT_ONCE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=_END_S,
        # A peer that answers no ping is closed.
        ws_ping_interval=_PING_S,
        ws_ping_timeout=_PING_S,
        # Only a proxy on this machine may state the addresses of others.
        proxy_headers=bool(allowed_hosts),
        server_header=False,
    )
    before = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH_S)
    gc.freeze()  # else garbage collection stops games for long
    local = "127.0.0.1" if host == "0.0.0.0" else "::1" if host == "::" else host  # noqa: S104
    try:
        with beside(f"{_in_address(local)}:{port}"):
            uvicorn.Server(config).run(sockets=[listening])
    finally:
        gc.unfreeze()
        sys.setswitchinterval(before)
