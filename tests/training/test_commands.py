"""``train`` and ``league`` in folders that hold a run, and after Ctrl-C."""

from __future__ import annotations

import os
import shlex
import signal
from pathlib import Path

import pytest

from swarm_pz.cli import main
from swarm_pz.training.callbacks import Account
from swarm_pz.training.checkpoint import CHECKPOINT, read

SMALL = {"num-envs": 4, "rollout": 8, "width": 8, "threads": 1, "evaluation-games": 2}
SHORT = ["--game.time-limit", "5", "--game.drones-per-team", "2"]


def options(prefix="", **changes):
    settings = SMALL | {name.replace("_", "-"): value for name, value in changes.items()}
    return [text for name, value in settings.items() for text in (f"--{prefix}{name}", str(value))]


TRAIN = ["train", "--games", "2", *options(total_steps=64), *SHORT]
LEAGUE = [
    "league", "--games", "2", "--scripts", "ring", "--cycle", "32", "--exploiter-steps", "0",
    *options("learner.", total_steps=96), "--learner.game.time-limit", "5", "--learner.game.drones-per-team", "2",
]  # fmt: skip


@pytest.fixture(autouse=True)
def _no_pictures(monkeypatch):
    monkeypatch.setattr("swarm_pz.film.film_game", lambda *_, **__: "not filmed")
    monkeypatch.setattr("swarm_pz.training.report.plot_learning_curve", lambda *_: None)


def run(arguments, capsys):
    """Run a command; return its status and what it printed."""
    try:
        main(arguments)
    except SystemExit as ended:
        return ended.code, capsys.readouterr().err
    return 0, capsys.readouterr().out


def line_that_goes_on(printed):
    (line,) = [line for line in printed.splitlines() if line.startswith("go on with: ")]
    program, *arguments = shlex.split(line.removeprefix("go on with: "))
    assert program == "swarm-pz"
    return arguments


def contents(folder, names):
    return {path: path.read_bytes() for path in Path(folder).rglob(names) if path.is_file()}


@pytest.fixture
def stop_and_go_on(capsys, monkeypatch):
    """Send a signal to a command after some steps of its run, and continue with the command that it then prints."""
    on_step, sent = Account._on_step, []

    def stop_and_go_on(command, number, folder, steps, total):
        def step(self):
            if self.num_timesteps >= steps - 12 and not sent:
                sent.append(number)
                os.kill(os.getpid(), number)
            return on_step(self)

        monkeypatch.setattr(Account, "_on_step", step)
        status, printed = run(command, capsys)
        assert status == 130 and f"{folder} is saved at step {steps} of {total}" in printed
        assert read(Path(folder) / CHECKPOINT)[0]["learner"]["steps"] == steps
        assert not list(Path("runs").rglob(".*draft*"))
        assert line_that_goes_on(printed) == command
        status, _ = run(command, capsys)
        assert status == 0 and read(Path(folder) / CHECKPOINT)[0]["learner"]["steps"] >= total

    return stop_and_go_on


def test_a_stopped_training_goes_on_and_one_with_other_settings_leaves_it_as_it_is(stop_and_go_on, capsys):
    stop_and_go_on(TRAIN, signal.SIGTERM, "runs/first", 32, 64)
    before = contents("runs/first", "*")
    status, printed = run([*TRAIN, "--seed", "1"], capsys)
    assert status == 2 and "another configuration" in printed and "--out" in printed
    assert contents("runs/first", "*") == before


def test_a_stopped_league_goes_on_and_a_finished_one_says_so_and_trains_nothing(stop_and_go_on, capsys):
    stop_and_go_on(LEAGUE, signal.SIGINT, "runs/league/main", 64, 96)
    weights = contents("runs", "policy.safetensors")
    status, printed = run(LEAGUE, capsys)
    assert status == 0 and "it has had 96 of 96 steps" in printed and "training for" not in printed
    assert contents("runs", "policy.safetensors") == weights != {}
