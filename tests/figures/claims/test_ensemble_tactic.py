from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.figures.claims import ensemble_tactic
from tests.figures.given import SEED, game, results

SMALL = {"GAMES": 4}
"""What makes the figure quick."""


LAST_ALONE = np.zeros((2, 2, 25, 25), np.uint8)
"""Opposing drones at the right, near the bottom: two of 20, and one."""
LAST_ALONE[:, 0, 4, 20] = 64
LAST_ALONE[:, 1] = np.array([round(255 * 18 / 20), round(255 * 19 / 20)])[:, None, None]


@pytest.mark.parametrize(("wins", "holds"), [(40, False), (55, False), (62, True), (90, True)])
def test_a_tactic_wins_where_it_surely_wins_more_than_half(monkeypatch, wins, holds):
    asked, shown, tracks, looked = [], [], [], []

    def play(policy, opponent, numbers, *, seed, config):
        asked.append((opponent, [*numbers], seed, config))
        alone = policy.act(LAST_ALONE, np.arange(2))
        tracks.append(not np.allclose(alone[0], alone[1]))
        won = wins if len(asked) == 1 else wins - 10
        # The last drone is alone for the longest in the game of pair 7.
        sizes = [[10, 15, *[19] * (30 if number == 7 else 3), 20] for number in range(100)]
        return [game(2 * number, outcome, sizes=sizes[number]) for number, outcome in enumerate(results(won, 100))]

    class Looked(Rollout):
        def __init__(self, policy, opponent, numbers, **options):
            shown.append((opponent, [*numbers], options))
            super().__init__(policy, opponent, numbers, **options)
            looked.append(self.simulator)

        def play(self, *, after_control_period):
            super().play(1.0, after_control_period=after_control_period)

    monkeypatch.setattr(ensemble_tactic, "play_games", play)
    monkeypatch.setattr(ensemble_tactic, "Rollout", Looked)
    monkeypatch.setattr(ensemble_tactic, "moments", lambda sizes: [1, 3, 5, len(sizes) - 1])
    finding = ensemble_tactic.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic == {"win_rate": wins / 100, "win_rate_gained_by_tracking": pytest.approx(0.1)}
    assert asked == [("uniform", [*range(0, 200, 2)], SEED, GameConfig())] * 2
    assert shown == [("uniform", [14], {"seed": SEED, "config": GameConfig()})]
    assert tracks == [True, False]
    assert finding.series["pair"] == 7
    for team, cells in enumerate(finding.series["frames"][-1]["captured_cells"]):
        grounds = np.zeros((50, 50), bool)
        for column, row in cells:
            grounds[row, column] = True
        np.testing.assert_array_equal(grounds, looked[0].captures_here[0, team])
    assert [frame["seconds"] for frame in finding.series["frames"]] == [0.2, 0.4, 0.6, 1.0]


def test_the_tactic_with_one_command_never_leaves_the_centre_and_the_other_goes_to_the_last_drone():
    config = GameConfig()
    rows = np.arange(2)
    tracking = ensemble_tactic.Ensemble(config).act(LAST_ALONE, rows)
    staying = ensemble_tactic.Ensemble(config, last=0).act(LAST_ALONE, rows)
    np.testing.assert_array_equal(tracking[0], staying[0])
    np.testing.assert_array_equal(staying[0], staying[1])
    np.testing.assert_allclose(staying[0], staying[0].T)
    np.testing.assert_allclose(staying[0], staying[0][::-1, ::-1])
    centres = (np.arange(10) + 0.5) / 10
    around = np.hypot(*(np.stack(np.meshgrid(centres, centres)) - np.array([20.5 / 25, 4.5 / 25])[:, None, None]))
    np.testing.assert_allclose(tracking[1], np.exp(-(((around - 0.2) / 0.08) ** 2)))


def test_moments_of_a_game():
    sizes = [10] * 25 + [6] * 10 + [5] * 10 + [2] * 5 + [1] * 21 + [0]
    assert ensemble_tactic.moments(sizes) == [20, 35, 60, 71]
    assert ensemble_tactic.moments([4, 2, 0]) == [1, 1, 2, 2]


def test_the_last_stand_is_counted_from_the_last_time_there_were_several():
    assert ensemble_tactic.last_stand([10, 1, 3, 1, 1, 0]) == 2
    assert ensemble_tactic.last_stand([10, 4, 0]) == 0
