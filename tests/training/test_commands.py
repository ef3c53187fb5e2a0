"""What ``train``, ``league`` and ``evaluate --exploit`` do with folders that hold a run, and with Ctrl-C."""

from __future__ import annotations

import os
import shlex
import signal
import sys
from pathlib import Path

import pytest

from swarm_pz.cli import main
from swarm_pz.training.callbacks import Account
from swarm_pz.training.checkpoint import CHECKPOINT, read_story
from swarm_pz.training.ppo import Training
from tests.training.runs import TINY, quiet

SMALL = {"num-envs": 4, "rollout": 8, "width": 8, "threads": 1, "evaluation-games": 2}
SHORT = ["--game.time-limit", "5", "--game.drones-per-team", "2"]


def options(prefix="", **changes):
    given = SMALL | {name.replace("_", "-"): value for name, value in changes.items()}
    return [text for name, value in given.items() for text in (f"--{prefix}{name}", str(value))]


TRAIN = ["train", "--games", "2", *options(total_steps=64), *SHORT]
LEAGUE = [
    "league", "--games", "2", "--scripts", "ring", "--cycle", "32", "--exploiter-steps", "0",
    *options("learner.", total_steps=96), "--learner.game.time-limit", "5", "--learner.game.drones-per-team", "2",
]  # fmt: skip
EXPLOIT = [
    "evaluate", "runs/target", "--exploit", "--exploit-steps", "300", "--exploiters", "1", "--games", "2",
    "--processes", "1", "--threads", "1", *SHORT,
]  # fmt: skip


@pytest.fixture(autouse=True)
def _no_film(monkeypatch):
    monkeypatch.setattr("swarm_pz.analysis.video.film_game", lambda *_, **__: "not filmed")


@pytest.fixture
def stops_at(monkeypatch):
    """Send this process a signal once a run has had so many steps."""
    on_step = Account._on_step

    def arrange(steps, number=signal.SIGINT):
        sent = []

        def step(self):
            if self.num_timesteps >= steps and not sent:
                sent.append(number)
                os.kill(os.getpid(), number)
            return on_step(self)

        monkeypatch.setattr(Account, "_on_step", step)

    return arrange


def run(arguments, capsys):
    """Run a command; return its status, and what it said."""
    try:
        main(arguments)
    except SystemExit as ended:
        return ended.code, capsys.readouterr().err
    return 0, capsys.readouterr().out


def line_that_goes_on(said):
    (line,) = [line for line in said.splitlines() if line.startswith("go on with: ")]
    program, *arguments = shlex.split(line.removeprefix("go on with: "))
    assert program == "swarm-pz"
    return arguments


def contents(folder):
    return {path: path.read_bytes() for path in Path(folder).rglob("*") if path.is_file()}


def test_training_twice_loses_nothing(capsys):
    assert run(TRAIN, capsys)[0] == 0
    before = contents("runs/first")
    status, said = run([*TRAIN, "--out", "runs/first", "--seed", "1"], capsys)
    assert status == 2
    for part in ("runs/first holds a finished run of 64 steps", "--resume", "--overwrite", "--out runs/first-2"):
        assert part in said
    status, said = run([*TRAIN, "--seed", "1"], capsys)
    assert status == 0 and "policy: runs/first-2" in said
    assert contents("runs/first") == before


def test_resuming_what_is_finished_says_so_and_trains_nothing(capsys):
    assert run(LEAGUE, capsys)[0] == 0
    weights = {path: path.read_bytes() for path in Path("runs").rglob("policy.safetensors")}
    status, said = run([*LEAGUE, "--resume"], capsys)
    assert status == 0 and "it has had 96 of 96 steps" in said and "training for" not in said
    assert {path: path.read_bytes() for path in Path("runs").rglob("policy.safetensors")} == weights != {}


@pytest.mark.parametrize(
    ("command", "number", "folder", "steps", "total"),
    [
        (TRAIN, signal.SIGTERM, "runs/first", 32, 64),
        (LEAGUE, signal.SIGINT, "runs/league/main", 64, 96),
        (EXPLOIT, signal.SIGINT, "runs/exploiter/seed-0", 256, 300),
    ],
)
def test_a_signal_stops_at_a_checkpoint_and_the_line_that_is_said_goes_on(
    command, number, folder, steps, total, stops_at, capsys, monkeypatch
):
    monkeypatch.setitem(sys.modules, "cma", None)  # no search that does not learn
    if command is EXPLOIT:
        Training(TINY.replace(total_steps=32), Path("runs/target"), say=quiet).run()
    stops_at(steps - 12, number)
    status, said = run(command, capsys)
    assert status == 130 and f"{folder} is saved at step {steps} of {total}" in said
    assert read_story(Path(folder) / CHECKPOINT)["learner"]["steps"] == steps
    assert not list(Path("runs").rglob(".*draft*"))
    status, _ = run([*command, "--out", str(Path("runs", Path(folder).parts[1]))], capsys)
    assert status == 2, "what was begun is not replaced"
    status, said = run(line_that_goes_on(said), capsys)
    assert status == 0 and (Path(folder) / CHECKPOINT).exists()
    assert read_story(Path(folder) / CHECKPOINT)["learner"]["steps"] >= total
