"""Fixtures: game servers in their own processes, clients and browser pages."""

import contextlib
import functools
import http.server
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import urllib.request

import pytest
from playwright.sync_api import expect
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, TARGET, decode_frame

SLOW_MS = 120_000
"""Longest wait for a page, a game or a recording, on the slowest machine."""
expect.set_options(timeout=SLOW_MS)
OLDEST_NODE = (20, 19)
COMMAND = """
import functools
from swarm_pz.cli import main
from swarm_pz.play.server import serve
serve.PolicyWorkers = functools.partial(serve.PolicyWorkers, processes=1)
main()
"""
"""The command line, with one policy process: each takes seconds of processor time to start."""


class Server:
    """A server command in its own process."""

    def begin(self, *options, until):
        """Start the command, and return the first line of its output that contains `until`."""
        self.process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-c", COMMAND, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )
        return next(line for line in self.process.stdout if until in line)

    def kill(self):
        """End the server as a power failure would."""
        self.process.kill()
        print(self.process.communicate()[0])

    def end(self):
        """Tell the server to end, and return what it printed."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.communicate(timeout=60)[0]


class Table(Server):
    """A running table at `address` (host and port), which records into `folder`."""

    def __init__(self, folder, *options, countdown="0"):
        self.folder = folder
        own = ("--port", "0", "--countdown", countdown, "--out", str(folder))
        line = self.begin("play", *own, *options, until="http://")
        self.address = line.split("http://")[1].split("/")[0]

    def get(self, path, **headers):
        """Return status, headers and text of a page."""
        request = urllib.request.Request(f"http://{self.address}{path}", headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=10) as answer:  # noqa: S310
                return answer.status, answer.headers, answer.read().decode(errors="replace")
        except urllib.error.HTTPError as error:
            return error.code, error.headers, error.read().decode()

    def recording(self, room, other_than=None):
        """Wait for the file of a room's latest game, which the first write creates, and return it."""
        end = time.monotonic() + SLOW_MS / 1000
        while not (found := set(self.folder.glob(f"*-{room}-*.jsonl")) - {other_than}):
            assert time.monotonic() < end, f"no game of room {room} was recorded"
            time.sleep(0.05)
        return max(found)

    def status(self):
        """Return the figures at `/status`."""
        return json.loads(self.get("/status")[2])

    def visit(self, token=None, **options):
        """Return a client that has said hello."""
        return Client(self.address, token, **options)


class Client:
    """One WebSocket connection to a table."""

    def __init__(self, address, token=None, **options):
        self._stack = contextlib.ExitStack()
        self.socket = self._stack.enter_context(
            connect(
                f"ws://{address}/socket",
                subprotocols=[protocol.SUBPROTOCOL],
                max_size=None,
                compression=None,
                close_timeout=1,
                **options,
            )
        )
        self.frames, self.targets, self.messages = [], [], []
        self.say(protocol.Hello(kind="person", token=token))
        self.hear(protocol.Welcome)

    def say(self, message):
        self.socket.send(message if isinstance(message, str | bytes) else protocol.encode(message))

    def take(self, timeout=60.0):
        """Receive one message, and acknowledge every fourth frame."""
        data = self.socket.recv(timeout=timeout)
        if isinstance(data, str):
            self.messages.append(protocol.decode_server(data))
            return self.messages[-1]
        if data[0] == FRAME:
            self.frames.append(decode_frame(data))
            if len(self.frames) % 4 == 0:
                self.say(protocol.Acknowledge(self.frames[-1].sequence))
        elif data[0] == TARGET:
            self.targets.append(data)
        return None

    def hear(self, kind, where=lambda message: True, timeout=120.0):
        """Receive until a message of a kind comes, and return it."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            message = self.take(end - time.monotonic())
            if isinstance(message, kind) and where(message):
                return message
            if isinstance(message, protocol.Refused) and kind is not protocol.Refused:
                raise AssertionError(f"refused: {message.reason}")
        raise AssertionError(f"no {kind.__name__} came")

    def refused(self, message):
        """Send a message, and return its refusal."""
        self.say(message)
        return self.hear(protocol.Refused)

    def play(self, opponent="uniform", **settings):
        """Open a room against a policy and begin; return its state."""
        self.say(protocol.Create(settings=protocol.Settings(**settings), opponent=opponent))
        self.seated = self.hear(protocol.Seated)
        self.say(protocol.Ready())
        return self.hear(protocol.RoomState, lambda room: room.phase == "playing")

    def hear_close(self):
        """Receive until the server closes the connection."""
        with contextlib.suppress(ConnectionClosed):
            while True:
                self.take()

    def close(self):
        self._stack.close()


@pytest.fixture(scope="session")
def table(tmp_path_factory):
    """Give a server that many tests share."""
    server = Table(tmp_path_factory.mktemp("games"), "--record-labels")
    yield server
    server.end()


@pytest.fixture
def own_table(tmp_path):
    """Give a server that one test may end."""
    server = Table(tmp_path)
    yield server
    if server.process.poll() is None:
        server.end()


# --- JavaScript -----------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def node():
    """Give the path of Node, or skip the test if it is too old to detect modules by itself."""
    path = shutil.which("node")
    version = subprocess.run([path, "--version"], capture_output=True, text=True, check=True).stdout if path else "none"  # noqa: S603
    if tuple(map(int, re.findall(r"\d+", version)[:2])) < OLDEST_NODE:
        pytest.skip(f"the page's modules are tested with Node {OLDEST_NODE} or later, here is {version.strip()}")
    return path


# --- browsers -------------------------------------------------------------------------------------


FEW_PICTURES = "requestAnimationFrame = ((later) => (act) => setTimeout(() => later(act), 80))(requestAnimationFrame)"
"""About ten frames a second, to save time: without a GPU, the processor paints them."""


def new_page(browser, width=360, height=640, **options):
    """Return an empty page in its own browser context."""
    page = browser.new_context(viewport={"width": width, "height": height}, **options).new_page()
    page.context.add_init_script(FEW_PICTURES)
    page.context.set_default_timeout(SLOW_MS)
    return page


@contextlib.contextmanager
def opening(chromium, *, hears_console=False):
    """Give a function that opens an address in its own browser context; errors on a page fail the test."""
    contexts, faults = [], []

    def open_(address, script="", **options):
        page = new_page(chromium, **options)
        contexts.append(page.context)
        page.add_init_script(script)
        page.on("pageerror", lambda error: faults.append(str(error)))
        if hears_console:
            page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
        page.goto(address if address.startswith("http") else f"http://{address}")
        return page

    yield open_
    for context in contexts:
        context.close()
    assert not faults, f"a page had errors: {faults}"


@pytest.fixture
def open_page(chromium, table):
    """Give a function that opens the table's page in its own browser context.

    A test with its own table names that fixture first, so that the pages are closed before the table ends.
    """
    with opening(chromium, hears_console=True) as open_at:

        def open_(address="", **options):
            page = open_at(f"{table.address}/{address}", **options)
            page.wait_for_selector("#opponent option", state="attached")
            return page

        yield open_


@pytest.fixture
def visit(chromium):
    """Give a function that opens an address in its own browser context; its server may end meanwhile."""
    with opening(chromium) as open_:
        yield open_


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves a folder without logging."""

    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Give a folder and the address that serves it, whose origin is not the table's."""
    folder = tmp_path_factory.mktemp("lab")
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield folder, f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()
