from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.players import Ensemble, Fixed, Held
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.policy import Policy
from swarm_pz.spaces.densities import disc, ring

LAST_ALONE = np.zeros((2, 2, 25, 25), np.uint8)
"""Opposing drones at the right, near the bottom: two of 20, and one."""
LAST_ALONE[:, 0, 4, 20] = 64
LAST_ALONE[:, 1] = np.array([round(255 * 18 / 20), round(255 * 19 / 20)])[:, None, None]


class Counting:
    """Answers with how often a game was asked, and with the game."""

    name = "counting"
    observation = ObservationConfig(grid=5, channels=("time_left",))

    def __init__(self):
        self.asked, self.seeds = {}, []

    def reset(self, seeds, rows):
        self.seeds += [*seeds]
        self.asked.update(dict.fromkeys(rows.tolist(), 0))

    def act(self, observations, rows):
        for row in rows.tolist():
            self.asked[row] += 1
        return np.stack([np.full((2, 2), 100 * row + self.asked[row]) for row in rows.tolist()])


def given(player, *rows):
    return player.act(np.zeros((len(rows), 1, 5, 5), np.uint8), np.array(rows))[:, 0, 0].tolist()


def test_a_held_command_is_in_force_for_its_steps_and_the_player_is_asked_at_each():
    player = Held(Counting(), 3)
    player.reset([5, 6], np.arange(2))
    assert [given(player, 0, 1) for _ in range(7)] == [[1, 101]] * 3 + [[4, 104]] * 3 + [[7, 107]]


def test_a_game_that_begins_anew_or_runs_on_alone_is_held_for_its_own_steps():
    inner = Counting()
    player = Held(inner, 3)
    player.reset([5, 6], np.arange(2))
    assert given(player, 0, 1) == [1, 101]
    player.reset([7], np.array([0]))
    assert [given(player, 0), given(player, 1), given(player, 1), given(player, 1)] == [[1], [101], [101], [104]]
    assert inner.seeds == [5, 6, 7]


def test_held_for_one_step_a_player_is_itself():
    player = Held(Counting(), 1)
    player.reset([5], np.arange(1))
    assert [given(player, 0) for _ in range(3)] == [[1], [2], [3]]
    assert isinstance(player, Policy) and player.observation is Counting.observation
    assert "counting" in player.name


def test_a_held_answer_is_not_what_the_player_writes_over_later():
    class Reusing(Counting):
        def act(self, observations, rows):
            self.buffer = getattr(self, "buffer", np.zeros((1, 2, 2)))
            self.buffer += 1
            return self.buffer

    player = Held(Reusing(), 2)
    player.reset([5], np.arange(1))
    assert [given(player, 0) for _ in range(3)] == [[1], [1], [3]]


def test_a_fixed_command_is_given_to_every_game_at_every_time():
    density = np.linspace(0, 1, 100).reshape(10, 10)
    player = Fixed(density)
    player.reset([0], np.arange(1))
    np.testing.assert_array_equal(player.act(np.zeros((3, 1, 2, 2), np.uint8), np.arange(3)), [density] * 3)
    assert isinstance(player, Policy)


@pytest.mark.parametrize("shape", [lambda distance: disc(distance, 0.1), lambda distance: ring(distance, 0.2)])
def test_the_tactic_with_one_command_never_leaves_the_centre_and_the_other_goes_to_the_last_drone(shape):
    config = GameConfig()
    rows = np.arange(2)
    tracking = Ensemble(config, shape).act(LAST_ALONE, rows)
    staying = Ensemble(config, shape, last=0).act(LAST_ALONE, rows)
    np.testing.assert_array_equal(tracking[0], staying[0])
    np.testing.assert_array_equal(staying[0], staying[1])
    np.testing.assert_allclose(staying[0], staying[0].T)
    np.testing.assert_allclose(staying[0], staying[0][::-1, ::-1])
    centres = (np.arange(10) + 0.5) / 10
    around = np.hypot(*(np.stack(np.meshgrid(centres, centres)) - np.array([20.5 / 25, 4.5 / 25])[:, None, None]))
    np.testing.assert_allclose(tracking[1], shape(around) / shape(around).max())


def test_the_tactic_asks_for_one_place_as_wide_as_the_script_centre_does():
    images = np.zeros((1, 2, 25, 25), np.uint8)
    density = Ensemble(GameConfig()).act(images, np.arange(1))[0]
    centres = (np.arange(10) + 0.5) / 10
    far = np.hypot(centres[None, :] - 0.5, centres[:, None] - 0.5)
    np.testing.assert_allclose(density, disc(far, 0.1) / disc(far, 0.1).max())
