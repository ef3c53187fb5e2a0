from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from benchmarks.paper.players import Ensemble
from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.policies.scripted import SCRIPTS, View, tactic
from swarm_pz.policy import Policy


def boards(generator, count, policy):
    """Draw images: few drones on each, none on the first, and sometimes random brightness everywhere."""
    grid = policy.observation.grid
    shape = (count, len(policy.observation.channels), grid, grid)
    images = 64 * generator.integers(1, 4, shape) * (generator.random(shape) < 0.03)
    if generator.random() < 0.3:
        images = generator.integers(0, 256, shape)
    images[0] = 0
    return images.astype(np.uint8)


@pytest.mark.parametrize("make", [*SCRIPTS, Ensemble], ids=lambda make: make.__name__)
def test_a_game_depends_on_no_other_bit_for_bit_nor_on_the_one_before(make):
    assert pickle.loads(pickle.dumps(make)) is make  # noqa: S301
    generator = np.random.default_rng(0)
    for count in (2, 70):
        together, alone, rows = make(GameConfig()), make(GameConfig()), np.arange(count)
        assert isinstance(together, Policy)
        together.reset(rows.tolist(), rows)
        alone.reset(rows.tolist(), rows)
        for step in range(4):
            if step == 2:  # one game begins anew
                together.reset([99], rows[1:2])
                alone = make(GameConfig()) if count == 2 else alone
                alone.reset([99], rows[1:2])
            images = boards(generator, count, together)
            answers = together.act(images, rows)
            for row in rows[1:] if count == 2 and step >= 2 else rows:
                one = alone.act(images[row : row + 1], rows[row : row + 1])[0]
                np.testing.assert_array_equal(answers[row], one, err_msg=f"game {row} of {count}")


def asked_for(x, y, place, step):
    """Return each script's value at (x, y), with opponents at `place`, by independent formulas."""

    def ring(px, py, width=0.08):
        return math.exp(-(((math.hypot(x - px, y - py) - 0.25) / width) ** 2))

    def disc(px, py):
        return math.exp(-((x - px) ** 2 + (y - py) ** 2) / (2 * 0.1**2))

    px, py = place
    front = 0.25 + 0.75 * min(max((step % 12 - 4) / 8, 0), 1)
    return {
        "centre": disc(0.5, 0.5),
        "chase": disc(px, py),
        "corners": max(disc(at_x, at_y) for at_x in (0.1, 0.9) for at_y in (0.1, 0.9)),
        "evade": math.exp(8 * math.hypot(x - px, y - py)),
        "halo": ring(0.5, 0.5, 0.15),
        "lasso": ring(0.5 + 0.3 * (px - 0.5), 0.5 + 0.3 * (py - 0.5), 0.15),
        "ring": ring(px, py),
        "uniform": 1.0,
        "wavefront": 1 / (1 + math.exp(((x if px > 0.5 else 1 - x) - front) / 0.03)),
    }


def assert_asks_for(answers, wanted, name):
    np.testing.assert_allclose(answers, wanted / wanted.max(axis=(1, 2), keepdims=True), atol=1e-9, err_msg=name)


@pytest.mark.parametrize("cells", [5, 10])
def test_scripts_ask_for_what_their_formulas_say(cells):
    drones, rows, line = {3: (20, 6), 1: (4, 17)}, np.array([3, 1]), (np.arange(cells) + 0.5) / cells
    images = np.zeros((2, 1, 25, 25), np.uint8)
    for game, (column, row) in enumerate(drones.values()):
        images[game, 0, row, column] = 64
    players = {name: policies.load(name, GameConfig(command_cells=cells)) for name in asked_for(0, 0, (0, 0), 0)}
    for player in players.values():
        player.reset([0, 1], rows)
    for step in range(14):
        places = [((column + 0.5) / 25, (row + 0.5) / 25) for column, row in drones.values()]
        expected = [[[asked_for(x, y, place, step) for x in line] for y in line] for place in places]
        for name, player in players.items():
            wanted = np.array([[[cell[name] for cell in row] for row in game] for game in expected])
            assert_asks_for(player.act(images, rows), wanted, f"{name} at step {step}")


def test_a_game_keeps_its_traits_and_draws_numbers_of_its_own():
    calls, rows = [], np.arange(2)

    @tactic(sees=("time_left",))
    def nothing(view):
        calls.append((view.steps.tolist(), view.traits.copy(), view.random()))
        return np.zeros((2, 10, 10))

    policy = nothing(GameConfig())
    policy.reset(np.random.SeedSequence(5).spawn(2), rows)
    for _ in range(2):
        assert not policy.act(np.zeros((2, 1, 10, 10), np.uint8), rows).any()  # zeros stay zeros
    (steps, traits, first), (next_steps, still, second) = calls
    assert (steps, next_steps) == ([0, 0], [1, 1])
    np.testing.assert_array_equal(traits, still)
    drawn = np.concatenate([numbers.ravel() for numbers in (traits, first, second)])
    assert len(np.unique(drawn)) == len(drawn)


def test_a_view_gives_the_channel_that_is_asked_for_and_where_a_side_is():
    sees = ("own_positions", "time_left", "opposing_positions")
    images = np.zeros((2, 3, 10, 10), np.uint8)
    images[0, 0, 2, 8], images[0, 1], images[0, 2, 7, 1], images[0, 2, 8, 1] = 64, 9, 64, 192
    view = View(images, sees, 10, np.zeros(2, int), [], np.zeros((2, 0)))
    for place, channel in enumerate(sees):
        np.testing.assert_array_equal(view[channel], images[:, place])
    np.testing.assert_allclose(view.mean_position("own"), [[0.85, 0.25], [0.5, 0.5]], rtol=1e-15)
    np.testing.assert_allclose(view.mean_position("opposing"), [[0.15, 0.825], [0.5, 0.5]], rtol=1e-15)
    with pytest.raises(PolicyError, match=r"'own_target' .*add it to `sees`"):
        view["own_target"]
    with pytest.raises(PolicyError, match="side must be 'own' or 'opposing', got 'red'"):
        view.mean_position("red")


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (np.ones((10, 10)), r"of shape \(2, 10, 10\), got shape \(10, 10\)"),
        (np.full((2, 10, 10), np.nan), "got nan"),
    ],
)
def test_a_tactic_that_returns_nonsense_hears_what_was_expected(returned, message):
    policy = tactic(lambda view: returned)(GameConfig())
    policy.reset([0, 1], np.arange(2))
    with pytest.raises(PolicyError, match="'<lambda>' returns for 2 games must be .*" + message):
        policy.act(np.zeros((2, 9, 10, 10), np.uint8), np.arange(2))
