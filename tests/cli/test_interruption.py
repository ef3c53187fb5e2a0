"""Ctrl-C and SIGTERM stop work where nothing is lost, and the line that goes on is named."""

import os
import signal
from pathlib import Path

import pytest

from swarm_pz.cli import report
from swarm_pz.cli.interruption import goes_on_with, resuming, stops_at_safe_points
from swarm_pz.errors import Stopped

LINE = "swarm-pz train --resume --out runs/first"


def interrupt(number=signal.SIGINT):
    os.kill(os.getpid(), number)


def waits(reached, number):
    with goes_on_with(LINE), stops_at_safe_points() as should_stop:
        for step in range(5):
            reached.append(step)
            if step == 1:
                interrupt(number)
            if should_stop():
                raise Stopped(f"{step + 1} of 5 steps")


def comes_twice(reached, number):
    with goes_on_with(LINE), stops_at_safe_points():
        interrupt(number)
        reached.append("first")
        interrupt(number)
        reached.append("second")


def is_never_asked_about(reached, number):
    with goes_on_with(LINE):
        with stops_at_safe_points():
            interrupt(number)
        reached.append("what comes after")


def comes_outside_of_safe_points(reached, number):
    with goes_on_with(LINE):
        interrupt(number)
        reached.append("what comes after")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("work", "reached", "where"),
    [
        (waits, [0, 1], ": 2 of 5 steps"),
        (comes_twice, ["first"], ""),
        (is_never_asked_about, [], ""),
        (comes_outside_of_safe_points, [], ""),
    ],
)
def test_a_signal_stops_the_work_and_the_line_that_goes_on_is_named(work, reached, where, number, capsys):
    before, done = [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)], []
    with pytest.raises(SystemExit, match="130"):
        work(done, number)
    assert done == reached
    assert capsys.readouterr().err.endswith(f"\nstopped{where}\ngo on with: {LINE}\n")
    assert [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)] == before, "handlers are put back"


def test_the_line_that_goes_on_calls_the_program_as_it_was_called(capsys, monkeypatch):
    monkeypatch.setattr(report, "program", lambda: "./bin/swarm-pz")
    with pytest.raises(SystemExit), goes_on_with("swarm-pz train --out runs/swarm-pz"):
        raise KeyboardInterrupt
    assert capsys.readouterr().err == "\nstopped\ngo on with: ./bin/swarm-pz train --out runs/swarm-pz\n"


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ([], ""),
        (["--overwrite", "--seed", "1"], "--seed 1 "),
        (["--out", "elsewhere", "--resume"], ""),
        (["--out=elsewhere"], ""),
        (["--no-resume", "--no-overwrite", "--games", "2"], "--games 2 "),
        (["--opponents", "a b", "--out"], "--opponents 'a b' "),
    ],
)
def test_the_line_that_goes_on_has_the_settings_and_the_folder(given, kept):
    token = report.arguments.set(["train", *given])
    assert resuming(Path("my runs/a")) == f"swarm-pz train {kept}--resume --out 'my runs/a'"
    report.arguments.reset(token)
