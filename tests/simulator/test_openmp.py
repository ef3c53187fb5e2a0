"""PyTorch's idle threads leave the cores to the game, whichever is imported first."""

import os
import sys
from pathlib import Path

import pytest
import torch

from swarm_pz import Simulator
from swarm_pz.simulator.openmp import limit_spinning

CHOICES = ("GOMP_SPINCOUNT", "OMP_WAIT_POLICY")


@pytest.fixture
def _no_choice(monkeypatch):
    for name in CHOICES:
        monkeypatch.setenv(name, "")  # so that what is set later is undone
        monkeypatch.delenv(name)


def threads():
    return len(list(Path("/proc/self/task").iterdir()))


@pytest.mark.skipif(sys.platform != "linux", reason="GNU's OpenMP is Linux's")
@pytest.mark.usefixtures("_no_choice")
def test_a_game_crowds_openmp_where_pytorch_was_imported_first():
    """An environment variable comes too late then: GNU's OpenMP has read it."""
    before, largest = threads(), torch.get_num_threads()
    Simulator().reset([0])
    assert threads() - before > len(os.sched_getaffinity(0))
    assert (os.environ["GOMP_SPINCOUNT"], torch.get_num_threads()) == ("1000", largest)


@pytest.mark.usefixtures("_no_choice")
def test_a_later_import_of_pytorch_reads_short_waits(monkeypatch):
    """As many threads as before: OpenMP is not loaded yet."""
    monkeypatch.delitem(sys.modules, "torch")
    before = threads() if sys.platform == "linux" else 0
    limit_spinning()
    assert os.environ["GOMP_SPINCOUNT"] == "1000"
    assert before == (threads() if sys.platform == "linux" else 0)


@pytest.mark.usefixtures("_no_choice")
@pytest.mark.parametrize("name", CHOICES)
def test_waits_that_the_user_has_chosen_stay(name, monkeypatch):
    monkeypatch.setenv(name, "7")
    limit_spinning()
    assert [os.environ.get(one) for one in CHOICES if one != name] == [None]
    assert os.environ[name] == "7"
