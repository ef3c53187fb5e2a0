"""Ctrl-C and SIGTERM stop work at safe points, and the command that continues it is printed."""

import os
import signal

import pytest

from swarm_pz.cli import report
from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.errors import Stopped

LINE = "swarm-pz train --out runs/swarm-pz"


def work(number, times, reached, asks):
    """Work in five steps, and then without safe points; signal `number` comes at `times`."""
    with goes_on_with(LINE):
        with stops_at_safe_points() as should_stop:
            for step in range(5):
                if step in times:
                    os.kill(os.getpid(), number)
                reached.append(step)
                if asks and should_stop():
                    raise Stopped(f"{step + 1} of 5 steps")
        if "after" in times:
            os.kill(os.getpid(), number)
        reached.append("after")


@pytest.mark.parametrize(
    ("number", "times", "asks", "reached", "where"),
    [
        (signal.SIGINT, {1}, True, [0, 1], ": 2 of 5 steps"),
        (signal.SIGINT, {1, 3}, False, [0, 1, 2], ""),  # a second signal stops it at once
        (signal.SIGINT, {1}, False, [0, 1, 2, 3, 4], ""),  # the work never asks `should_stop`
        (signal.SIGTERM, {"after"}, True, [0, 1, 2, 3, 4], ""),
    ],
)
def test_a_signal_stops_the_work_and_the_line_that_goes_on_is_named(
    number, times, asks, reached, where, capsys, monkeypatch
):
    monkeypatch.setattr(report, "program", lambda: "./bin/swarm-pz")
    before, done = [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)], []
    with pytest.raises(SystemExit, match="130"):
        work(number, times, done, asks)
    assert done == reached
    assert capsys.readouterr().err.endswith(f"\nstopped{where}\ngo on with: ./bin/{LINE}\n")
    assert [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)] == before, "handlers are put back"
