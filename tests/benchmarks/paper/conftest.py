from __future__ import annotations

import pytest

from swarm_pz.evaluation import intervals


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    """Take fewer resamples than results do: no case here is near its bound."""
    monkeypatch.setattr(intervals, "RESAMPLES", 250)
