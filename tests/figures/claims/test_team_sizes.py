from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.figures.claims import team_sizes
from tests.figures.given import SEED, game

SMALL = {"GAMES": 3}
"""What makes the figure quick."""


@pytest.mark.parametrize(
    ("rates", "holds"), [([0.3] * 20, True), ([0.1, 0.35] * 10, False), ([0.21, 0.23] * 10, True), ([0.1] * 20, False)]
)
def test_sizes_fluctuate_rapidly_where_the_lower_end_says_so(monkeypatch, rates, holds):
    asked = []

    def play(policy, opponent, numbers, *, seed, config):
        asked.append((policy, opponent, [*numbers], seed, config))
        seconds = np.random.default_rng(0).permutation(20) + 10.0
        return [
            game(2 * number, seconds=float(length), captures=rate * length, sizes=[10, 12, 9])
            for number, (length, rate) in enumerate(zip(seconds, rates, strict=True))
        ]

    monkeypatch.setattr(team_sizes, "play_games", play)
    finding = team_sizes.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic == {
        "captures_a_second": pytest.approx(np.mean(rates)), "turns_of_the_lead_a_game": 1.0
    }  # fmt: skip
    assert asked == [("ring", "uniform", [*range(0, 40, 2)], SEED, GameConfig())]
    assert finding.series["seconds"][finding.series["bold"]] == 20.0


def test_turns_of_the_lead_do_not_count_equal_teams():
    assert team_sizes.turns_of_lead([10, 11, 10, 12, 9, 10, 8, 13], 20) == 2
    assert team_sizes.turns_of_lead([10, 10], 20) == 0
