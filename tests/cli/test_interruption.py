from __future__ import annotations

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


def run_steps(steps, number):
    with goes_on_with(LINE), stops_at_safe_points() as asked:
        for step in range(5):
            steps.append(step)
            if step == 1:
                interrupt(number)
            steps.append("saved")
            if asked():
                raise Stopped(f"{step + 1} of 5 steps")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_for_a_safe_point_and_the_line_that_goes_on_is_named(number, capsys):
    steps = []
    with pytest.raises(SystemExit) as ended:
        run_steps(steps, number)
    assert ended.value.code == 130
    assert steps == [0, "saved", 1, "saved"]
    said = capsys.readouterr().err
    assert "stopped: 2 of 5 steps" in said
    assert f"go on with: {LINE}" in said


def test_the_line_that_goes_on_calls_the_program_as_it_was_called(capsys, monkeypatch):
    monkeypatch.setattr(report, "program", lambda: "./bin/swarm-pz")
    with pytest.raises(SystemExit), goes_on_with("swarm-pz train --out runs/swarm-pz"):
        raise KeyboardInterrupt
    assert capsys.readouterr().err == "\nstopped\ngo on with: ./bin/swarm-pz train --out runs/swarm-pz\n"


def send_two(reached):
    with goes_on_with(LINE), stops_at_safe_points():
        interrupt()
        reached.append("first")
        interrupt()
        reached.append("second")


def test_a_second_signal_ends_the_work_at_once():
    reached = []
    with pytest.raises(SystemExit) as ended:
        send_two(reached)
    assert ended.value.code == 130
    assert reached == ["first"]


def never_ask(reached):
    with goes_on_with(LINE):
        with stops_at_safe_points():
            interrupt()
        reached.append("what comes after")


def test_a_signal_that_the_work_never_asked_about_is_not_lost():
    reached = []
    with pytest.raises(SystemExit):
        never_ask(reached)
    assert not reached


def interrupt_at_once(number, reached):
    with goes_on_with(LINE):
        interrupt(number)
        reached.append("what comes after")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_outside_of_safe_points_a_signal_ends_the_work_at_once(number, capsys):
    reached = []
    with pytest.raises(SystemExit):
        interrupt_at_once(number, reached)
    assert not reached
    assert f"go on with: {LINE}" in capsys.readouterr().err


def test_the_handlers_are_put_back():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with goes_on_with(LINE), stops_at_safe_points():
        pass
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ([], "swarm-pz train --resume --out 'my runs/a'"),
        (["--overwrite", "--seed", "1"], "swarm-pz train --seed 1 --resume --out 'my runs/a'"),
        (["--out", "elsewhere", "--resume"], "swarm-pz train --resume --out 'my runs/a'"),
        (["--out=elsewhere"], "swarm-pz train --resume --out 'my runs/a'"),
        (["--no-resume", "--no-overwrite", "--games", "2"], "swarm-pz train --games 2 --resume --out 'my runs/a'"),
        (["--opponents", "a b", "--out"], "swarm-pz train --opponents 'a b' --resume --out 'my runs/a'"),
    ],
)
def test_the_line_that_goes_on_has_the_settings_and_the_folder(given, line):
    token = report.arguments.set(["train", *given])
    try:
        assert resuming(Path("my runs/a")) == line
    finally:
        report.arguments.reset(token)
