"""Fixtures: the event loop of coroutine tests, a lobby, and a clock that tests move."""

import importlib
from types import SimpleNamespace

import pytest

from swarm_pz.play.server import rate_limit
from tests.play.server.test_client_handler import Hall


@pytest.fixture
def anyio_backend():
    return "asyncio"


@pytest.fixture
async def hall(tmp_path):
    """Give a lobby without policy processes."""
    made = Hall(tmp_path)
    yield made
    made.close()


@pytest.fixture
def clock(request, monkeypatch):
    """Give a clock that the test moves, to `rate_limit` and to the module under test."""
    made = SimpleNamespace(now=1000.0)
    name = "swarm_pz.play.server." + request.module.__name__.rpartition(".test_")[2]
    for tested in {rate_limit, importlib.import_module(name)} if name.rpartition(".")[2] != "attacks" else {rate_limit}:
        if hasattr(tested, "time"):
            monkeypatch.setattr(tested, "time", SimpleNamespace(monotonic=lambda: made.now))
    return made
