"""Short games that must not change: who was captured when, exactly; positions to 1e-5.

Games are chaotic, so that they are held for two seconds only. A change here is a change of behaviour:
write it into CHANGELOG.md, then renew the file with ``python -m tests.test_golden``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.simulator import Simulator

GOLDEN = Path(__file__).parent / "golden" / "games.json"
SIZES = [(10, 10), (3, 17), (1, 1), (40, 40)]


def play(seed: int, sizes: tuple[int, int]) -> dict[str, Any]:
    simulator = Simulator(GameConfig(drones_per_team=sizes))
    simulator.reset([seed])
    generator = np.random.default_rng(seed)
    events = []
    for tick in range(1, 61):
        if tick in (1, 31):
            for team in range(2):
                simulator.command(team, generator.random((1, 10, 10)) ** 3)
        before = simulator.teams[0].copy()
        simulator.advance(1)
        events += [[tick, int(drone)] for drone in np.flatnonzero(simulator.teams[0] != before)]
    return {
        "seed": seed,
        "sizes": list(sizes),
        "captures": events,
        "positions": np.round(simulator.positions[0].astype(float), 7).tolist(),
    }


@pytest.mark.parametrize("number", range(len(SIZES)))
def test_golden_games(number):
    golden = json.loads(GOLDEN.read_text())[number]
    game = play(golden["seed"], tuple(golden["sizes"]))
    assert game["captures"] == golden["captures"]
    np.testing.assert_allclose(game["positions"], golden["positions"], atol=1e-5)


if __name__ == "__main__":
    GOLDEN.write_text(json.dumps([play(seed, sizes) for seed, sizes in enumerate(SIZES)]) + "\n")
