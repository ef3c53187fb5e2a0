"""A tournament on a Ray cluster of this machine: the same games as in one process, whoever dies, and how much sooner.

    python -m benchmarks.ray_cluster
    python -m benchmarks.ray_cluster --games 4 --seconds 20

Two nodes of one processor each are started, with ports of their own and no dashboard, and ended at the end; other
clusters of the machine are left alone. What is played: eight players, one of them in a folder that only the driver
has, every two against each other. Speeds mean something where nobody else is at work.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from swarm_pz.evaluation.ledger import GAMES

SCRIPTS = ("ring", "uniform", "noise", "halo", "corners", "evade", "champion")
FOLDER = "learned"
"""A player that only the driver's folder has."""
ROOT = Path(__file__).parents[1]
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


def _drive(place: Path, name: str, options: list[str], games: list[str], **secret: str) -> subprocess.Popen[bytes]:
    code = "from swarm_pz.cli import main; main()"
    words = [*SCRIPTS, FOLDER, *games, "--out", name, *options]
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | secret
    with (place / f"{name}.txt").open("ab") as said:
        return subprocess.Popen(  # noqa: S603
            [sys.executable, "-c", code, "tournament", *words], cwd=place, env=environment, stdout=said, stderr=said
        )


def _played(place: Path, name: str) -> list[dict[str, Any]]:
    path = place / name / GAMES
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def lines_but_times(place: Path, name: str) -> str:
    """Return the lines of a tournament's games by their keys, without what depends on the clock."""
    games = sorted(_played(place, name), key=lambda game: (game["one"], game["other"], game["number"]))
    return "\n".join(json.dumps({k: v for k, v in game.items() if k != "thinking_ms"}) for game in games)


def _finish(driver: subprocess.Popen[bytes], place: Path, name: str) -> None:
    if driver.wait():
        raise SystemExit(f"{name} failed: {(place / f'{name}.txt').read_text()}")


def _timed(place: Path, name: str, options: list[str], games: list[str], **secret: str) -> float:
    began = time.monotonic()
    _finish(_drive(place, name, options, games, **secret), place, name)
    return time.monotonic() - began


def _wait_for(place: Path, name: str, share: float, total: int) -> None:
    while len(_played(place, name)) < share * total:
        time.sleep(0.05)


def prove(place: Path, games: list[str], total: int) -> Iterator[str]:
    """Play the tournament in every way and say how each went."""
    shutil.copytree(ROOT / "policies" / "zoo" / "selfplay", place / FOLDER)
    alone = _timed(place, "alone", ["--processes", "1"], games)
    expected = lines_but_times(place, "alone")
    yield f"one process: {total} games in {alone:.1f} s"

    def same(name: str) -> str:
        played = _played(place, name)
        keys = {(game["one"], game["other"], game["number"]) for game in played}
        if lines_but_times(place, name) != expected or len(keys) != len(played):
            raise SystemExit(f"{name}: other games than in one process")
        return "the same games, to the byte but for thinking_ms"

    with Cluster() as cluster:
        cluster.start()
        options = ["--ray", cluster.address]
        one = _timed(place, "one_node", options, games, **cluster.secret)
        yield f"Ray, 1 worker: {one:.1f} s; {same('one_node')}"
        second = cluster.start()
        two = _timed(place, "two_nodes", options, games, **cluster.secret)
        yield f"Ray, 2 workers on 2 nodes: {two:.1f} s, {one / two:.2f} times as fast as 1; {same('two_nodes')}"

        driver = _drive(place, "node_killed", options, games, **cluster.secret)
        _wait_for(place, "node_killed", 0.3, total)
        cluster.kill(second)
        _finish(driver, place, "node_killed")
        yield f"a node killed with -9 in the middle: {same('node_killed')}"

        driver = _drive(place, "driver_killed", options, games, **cluster.secret)
        _wait_for(place, "driver_killed", 0.3, total)
        driver.kill()
        driver.wait()
        kept = len(_played(place, "driver_killed"))
        _finish(_drive(place, "driver_killed", options, games, **cluster.secret), place, "driver_killed")
        yield f"the driver killed with -9 after {kept} games, and resumed: {same('driver_killed')}"


def main() -> None:
    """Play, compare, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--games", type=int, default=40, help="of every two players, even")
    parser.add_argument("--seconds", type=float, default=300.0, help="a game's time limit")
    given = parser.parse_args()
    games = ["--games", str(given.games), "--game.time-limit", str(given.seconds), "--budget-ms", "1e6"]
    count = len(SCRIPTS) + 1
    with tempfile.TemporaryDirectory() as place:
        for line in prove(Path(place), games, count * (count - 1) // 2 * given.games):
            print(line, flush=True)


if __name__ == "__main__":
    main()
