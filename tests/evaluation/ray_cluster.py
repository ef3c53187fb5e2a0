"""A Ray cluster on this machine."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
_READY_S = 180.0


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


class Cluster:
    """Nodes of a Ray cluster on this machine, which end with the context; the first is the head."""

    def __init__(self) -> None:
        self.address = f"127.0.0.1:{_free_port()}"
        self.secret = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32)}
        """What lets a program in, for its environment; for this cluster alone, and in no file."""
        self._place = Path(tempfile.mkdtemp(prefix="ray-"))  # short, since sockets' names must be
        self.nodes: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        for node in reversed(self.nodes):
            self.kill(node)
        shutil.rmtree(self._place, ignore_errors=True)

    def start(self, cpus: int = 1, **environment: str) -> subprocess.Popen[bytes]:
        """Start a node, with its environment as given beside this one's, and wait until it is ready."""
        port = self.address.split(":")[1]
        if self.nodes:
            where = ["--address", self.address]
        else:
            where = ["--head", "--port", port, "--include-dashboard=false", "--temp-dir", str(self._place)]
        ray = "from ray.scripts.scripts import main; main()"
        words = ["start", *where, "--node-ip-address=127.0.0.1", f"--num-cpus={cpus}", "--block"]
        words += ["--disable-usage-stats", "--object-store-memory=100000000"]
        said = self._place / f"node{len(self.nodes)}.txt"
        with said.open("wb") as file:
            node = subprocess.Popen(  # noqa: S603
                [sys.executable, "-c", ray, *words],
                stdout=file, stderr=file, stdin=subprocess.DEVNULL, cwd=self._place,
                env=os.environ | {"RAY_USAGE_STATS_ENABLED": "0", "PYTHONPATH": str(ROOT)} | self.secret | environment,
                start_new_session=True,
            )  # fmt: skip
        self.nodes.append(node)
        began = time.monotonic()
        while b"Ray runtime started" not in said.read_bytes():
            if node.poll() is not None or time.monotonic() - began > _READY_S:
                raise RuntimeError(f"this node did not start: {said.read_text()}")
            time.sleep(0.1)
        return node

    def kill(self, node: subprocess.Popen[bytes]) -> None:
        """Kill a node with -9: all that its session has begun."""
        for path in Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError):
                fields = path.read_text().rsplit(")", 1)[1].split()
                if int(fields[3]) == node.pid:  # its session
                    os.kill(int(path.parent.name), signal.SIGKILL)
        node.wait()
