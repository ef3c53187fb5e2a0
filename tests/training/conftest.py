from __future__ import annotations

import pytest


@pytest.fixture(scope="package", autouse=True)
def _few_games_in_leagues():
    """Evaluate exploiters on few games: the tests check what leagues do, not who plays well."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("swarm_pz.training.selfplay._EXPLOITED_GAMES", 4)
        yield
