"""Tests that are coroutines run on an event loop of their own, and some by a clock of their own."""

import importlib
from types import SimpleNamespace

import pytest


@pytest.fixture
def anyio_backend():
    return "asyncio"


@pytest.fixture
def clock(request, monkeypatch):
    """Give the module that a file tests a clock that goes on when it is told."""
    made = SimpleNamespace(now=1000.0)
    tested = importlib.import_module("swarm_pz.play.server." + request.module.__name__.rpartition(".test_")[2])
    monkeypatch.setattr(tested, "time", SimpleNamespace(monotonic=lambda: made.now))
    return made
