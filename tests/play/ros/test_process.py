"""The rosbridge beside a table: it begins and ends with it, and the tablet app's own library plays there."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.rosbridge import Wire, density_of
from swarm_pz.cli import main
from swarm_pz.errors import CommandError, MissingExtraError
from swarm_pz.play.recordings.format import CommandLine, Recording
from swarm_pz.play.ros import process
from swarm_pz.simulator.commands import make_target
from tests.play.conftest import Table

ROOT = Path(__file__).parents[3]
TABLET = ROOT / "benchmarks" / "table" / "tablet.py"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--ros-opponent", "uniform"], "give --rosbridge a port"),
        (["--rosbridge", "0", "--ros-opponent", "unifrm"], "did you mean 'uniform'"),
        (["--rosbridge", "70000"], "rosbridge must be"),
        (["--port", "0", "--rosbridge", "TAKEN"], "another --rosbridge"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_is_served(options, said, capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        with pytest.raises(SystemExit, match="2"):
            main(["play", *(port if option == "TAKEN" else option for option in options)])
        assert said in capsys.readouterr().err
        with pytest.raises(CommandError, match="another rosbridge"):
            process.listen("127.0.0.1", int(port))


def test_without_the_extra_it_is_said_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "cbor2", None)
    with pytest.raises(MissingExtraError, match=r"cbor2 is not installed.*lab\]"):
        process.listen("127.0.0.1", 0)


def served(folder):
    """Return a table with a rosbridge, and its port."""
    table = Table(folder, "--rosbridge", "0", "--ros-opponent", "uniform")
    line = next(line for line in table.process.stdout if "rosbridge is at" in line)
    return table, int(line.rpartition(":")[2])


def test_the_program_of_the_documentation_plays(tmp_path):
    (program,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "ros.md").read_text(), re.S)
    table, port = served(tmp_path)
    command = [sys.executable, "-u", "-c", program.replace("port=9090", f"port={port}")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as playing:  # noqa: S603  (our own page)
        seen = next(line for line in playing.stdout if "red drones" in line)
        playing.kill()
    assert "plays in room" in table.end()
    assert int(seen.split()[0]) > 0


def test_the_current_library_plays_a_game_and_comes_back_after_a_loss(tmp_path):
    table, port = served(tmp_path)
    sent = asyncio.run(_play(port, tmp_path))
    printed = table.end()
    assert table.process.returncode in (0, -15) and "by itself" not in printed
    assert printed.count("plays in room") == 1
    commands = recorded(tmp_path)
    found = [place for command in commands for place in places_of(command, sent)]
    assert len(found) == len(commands) and found == sorted(set(found))
    assert {1, 2, 4} <= set(found), "while it is found out that the former client has gone, the latest waits"


def recorded(folder):
    """Return red's commands in the only game that there is."""
    (path,) = folder.glob("*.jsonl")
    return [line for line in Recording.read(path).of(CommandLine) if line.team == 0]


def places_of(command, sent):
    """Return which of the images that were sent, counted from 1, a command asks for."""
    target, _ = make_target(np.array(command.density), 10)
    wanted = [density_of(data, 10) for data in sent]
    return [place for place, one in enumerate(wanted, 1) if np.abs(target / target.mean() - one).max() <= 1e-6]


async def _play(port, folder):
    """Let a tablet play, lose its connection in the middle, and return what it deployed."""
    wire, sent = Wire(port), []
    arguments = [sys.executable, str(TABLET), str(await wire.lay()), "red", "4", "0.6", str(port)]
    tablet = await asyncio.create_subprocess_exec(
        *arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, limit=2**26
    )
    async for line in tablet.stdout:
        told = json.loads(line)
        if "deploy" in told:
            sent.append(told["data"])
            if told["deploy"] == 1:
                await asyncio.sleep(0.3)
                wire.cut()
        if told.get("deployed"):
            while not any(places_of(command, sent[-1:]) for command in recorded(folder)):
                await asyncio.sleep(0.1)  # the former client is asked whether it is there
            tablet.stdin.close()
        if "poses" in told:
            assert len(told["poses"]) > 10
    assert await tablet.wait() == 0
    await wire.end()
    return sent
