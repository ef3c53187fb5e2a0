from __future__ import annotations

import numpy as np

from benchmarks.paper.claims import ensemble_moments
from benchmarks.paper.players import Ensemble
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.rollout import Rollout
from tests.benchmarks.paper.given import SEED, game


def test_moments_of_a_game():
    sizes = [10] * 25 + [6] * 10 + [5] * 10 + [2] * 5 + [1] * 21 + [0]
    assert ensemble_moments.moments(sizes) == [20, 35, 60, 71]
    assert ensemble_moments.moments([4, 2, 0]) == [1, 1, 2, 2]


def test_the_last_stand_is_counted_from_the_last_time_there_were_several():
    assert ensemble_moments.last_stand([10, 1, 3, 1, 1, 0]) == 2
    assert ensemble_moments.last_stand([10, 4, 0]) == 0


def test_a_game_is_shown_as_it_was_played(monkeypatch):
    shown, looked = [], []

    class Looked(Rollout):
        def __init__(self, policy, opponent, numbers, **options):
            shown.append((policy, opponent, [*numbers], options))
            super().__init__(policy, opponent, numbers, **options)
            looked.append(self.simulator)

        def play(self, *, after_control_period):
            super().play(1.0, after_control_period=after_control_period)

    monkeypatch.setattr(ensemble_moments, "Rollout", Looked)
    monkeypatch.setattr(ensemble_moments, "moments", lambda sizes: [1, 3, 5, len(sizes) - 1])
    config, player = GameConfig(), Ensemble(GameConfig())
    frames = ensemble_moments.frames(player, "uniform", game(14), SEED, config)
    assert shown == [(player, "uniform", [14], {"seed": SEED, "config": config})]
    assert [frame["seconds"] for frame in frames] == [0.2, 0.4, 0.6, 1.0]
    for team, cells in enumerate(frames[-1]["captured_cells"]):
        grounds = np.zeros((50, 50), bool)
        for column, row in cells:
            grounds[row, column] = True
        np.testing.assert_array_equal(grounds, looked[0].captures_here[0, team])
    np.testing.assert_allclose(frames[-1]["trails"][-1], looked[0].positions[0], atol=6e-4)
    assert frames[-1]["teams"] == looked[0].teams[0].tolist() and [len(frame["trails"]) for frame in frames[:2]] == [
        2,
        4,
    ]
    command = looked[0].targets[0, 0] / looked[0].targets[0, 0].max()
    np.testing.assert_allclose(frames[-1]["command"], command, atol=6e-4)
    assert command.min() < 0.1, "red's: blue covers the square"
