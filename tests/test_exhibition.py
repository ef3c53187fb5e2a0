from __future__ import annotations

import numpy as np

from swarm_pz.config import GameConfig
from swarm_pz.exhibition import Exhibition


def test_looking_does_not_change_the_game():
    seen = []
    watched, unwatched = Exhibition("ring", "noise", seed=4), Exhibition("ring", "noise", seed=4)
    watched.play(3.0, after_control_period=lambda: seen.append(float(watched.simulator.time_s[0])))
    unwatched.play(3.0)
    np.testing.assert_allclose(seen, np.arange(1, 31) / 10)
    np.testing.assert_array_equal(watched.simulator.positions, unwatched.simulator.positions)


def test_a_game_goes_on_where_it_was_left_and_says_how_it_stands():
    game = Exhibition("uniform", "uniform", config=GameConfig(drones_per_team=1, time_limit=3.0))
    game.play(1.5)
    assert game.standing == "unfinished (2.0 s, red 1, blue 1)"
    game.play()
    assert game.standing == "a draw (3.0 s, red 1, blue 1)"
    assert game.names == ("uniform", "uniform")
