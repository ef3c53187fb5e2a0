"""The rosbridge beside a game server: a process of its own, which ends with the server."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import multiprocessing
import os
import socket
from collections.abc import Iterator

from swarm_pz.errors import CommandError
from swarm_pz.evaluation.processes import prepare_process
from swarm_pz.play.game import TableConfig
from swarm_pz.play.robots import Lab
from swarm_pz.play.ros.bridge import Bridge
from swarm_pz.play.ros.rosbridge import Origins


def listen(host: str, port: int) -> socket.socket:
    """Return a listening socket for a rosbridge; raise CommandError if it cannot listen there."""
    try:
        return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        raise CommandError(
            f"cannot listen for ROS programs at {host}, port {port}: {os.strerror(error.errno or 0)}; is another "
            "rosbridge running? Try another --rosbridge"
        ) from error


@contextlib.contextmanager
def rosbridge(
    listening: socket.socket, opponent: str | None, table: TableConfig, origins: Origins, lab: Lab | None, address: str
) -> Iterator[None]:
    """Serve ROS programs at a socket in this context; see `Bridge`. `address` is the game server's host and port."""
    arguments = (listening, opponent, table, origins, lab, address)
    process = multiprocessing.get_context("spawn").Process(target=_serve, args=arguments, daemon=True)
    process.start()
    listening.close()
    try:
        yield
    finally:
        process.kill()
        process.join()


def _serve(
    listening: socket.socket, opponent: str | None, table: TableConfig, origins: Origins, lab: Lab | None, address: str
) -> None:
    prepare_process()
    if hasattr(os, "nice"):
        os.nice(5)  # reading a large message takes a tenth of a second; the game's ticks come first
    say = functools.partial(print, flush=True)
    asyncio.run(Bridge(address, opponent, table, say, origins, lab=lab).run(listening))
