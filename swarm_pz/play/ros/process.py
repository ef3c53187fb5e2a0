"""The rosbridge beside a table: a process of its own, which ends with the table."""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection

from swarm_pz.errors import CommandError, require_extra
from swarm_pz.evaluation.processes import prepare_process
from swarm_pz.play.game import TableConfig
from swarm_pz.play.ros.bridge import Bridge
from swarm_pz.play.ros.rosbridge import Origins

_END_S = 3.0
"""Seconds that the process may take to say good-bye to its clients."""


def listen(host: str, port: int) -> socket.socket:
    """Return a socket at which a rosbridge may be reached; CommandError if it cannot listen there."""
    require_extra("cbor2", "lab")
    listening = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen(128)
    except OSError as error:
        listening.close()
        raise CommandError(
            f"cannot listen for ROS programs at {host}, port {port}: {error.strerror}; is another rosbridge running? "
            "Try another --rosbridge"
        ) from error
    return listening


@contextlib.contextmanager
def rosbridge(
    listening: socket.socket,
    opponent: str | None,
    table: TableConfig,
    origins: Origins,
    say: Callable[[str], None],
    address: str,
) -> Iterator[None]:
    """Serve ROS programs at a socket while the table at an address (host and port) is up; see `Bridge`."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    given = (listening, theirs, address, opponent, table, origins)
    process = context.Process(target=_serve, args=given, daemon=True)
    process.start()
    theirs.close()
    listening.close()
    is_over = threading.Event()
    reader = threading.Thread(target=_pass_on, args=(ours, say, is_over), daemon=True)
    reader.start()
    try:
        yield
    finally:
        is_over.set()
        process.terminate()
        process.join(_END_S)
        process.kill()
        reader.join()


def _pass_on(pipe: Connection, say: Callable[[str], None], is_over: threading.Event) -> None:
    """Say what the process says, until it has ended."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            say(pipe.recv())
    if not is_over.is_set():
        say("rosbridge: it has ended by itself; start the table anew for ROS programs to find it again")


def _serve(
    listening: socket.socket,
    pipe: Connection,
    address: str,
    opponent: str | None,
    table: TableConfig,
    origins: Origins,
) -> None:
    """Serve until the table ends."""
    prepare_process()
    if hasattr(os, "nice"):
        os.nice(5)  # a large message takes a tenth of a second to read: the table's ticks come first

    async def run() -> None:
        task = asyncio.current_task()
        if task is not None and sys.platform != "win32":
            asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
        await Bridge(address, opponent, table, pipe.send, origins).run(listening)

    with contextlib.suppress(asyncio.CancelledError):
        asyncio.run(run())
