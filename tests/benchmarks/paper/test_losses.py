from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.losses import Losses
from swarm_pz.config import BLUE, GameConfig
from swarm_pz.evaluation.rollout import Rollout


def test_first_and_last_losses_are_timed_and_the_spread_is_that_of_before():
    rollout = Rollout("uniform", "uniform", [0, 2, 4], config=GameConfig(drones_per_team=(2, 3)))
    games = rollout.simulator.games
    games.positions[0, 2:] = [[0.1, 0.1], [0.1, 0.1], [0.4, 0.5]]
    losses = Losses(rollout)
    for period in range(1, 9):
        games.ticks[:] = 3 * period
        if period == 2:
            games.teams[0, 2] = 0
            games.positions[0, 2:] = 0.9  # seen with the loss: not how they stood before it
        if period == 4:
            games.teams[0, 2], games.teams[0, 3] = BLUE, 0  # one comes back as another goes
        if period == 7:
            games.teams[:2] = 0
        losses(rollout)
    assert losses.first == pytest.approx([0.2, 0.7, np.inf])
    assert losses.last == pytest.approx([0.7, 0.7, np.inf])
    # Two at one place and one 0.5 away: a third of it from the mean, twice, and two thirds.
    assert losses.spread[0] == pytest.approx(np.sqrt((2 * (0.5 / 3) ** 2 + (1.0 / 3) ** 2) / 3), rel=1e-5)
    assert np.isnan(losses.spread[2])
    assert losses.whole_within(0.5).tolist() == [True, True, False]
    assert losses.whole_within(0.4).tolist() == [False, True, False]


def test_a_team_that_shrinks_but_is_not_lost_was_not_lost_at_once():
    rollout = Rollout("uniform", "uniform", [0], config=GameConfig(drones_per_team=(2, 3)))
    losses = Losses(rollout)
    rollout.simulator.games.teams[0, 3:] = 0
    rollout.simulator.games.ticks[:] = 3
    losses(rollout)
    assert losses.first.tolist() == [pytest.approx(0.1)] and losses.last.tolist() == [np.inf]
    assert not losses.whole_within(1e9).any()
