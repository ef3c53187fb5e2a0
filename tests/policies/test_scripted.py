from __future__ import annotations

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.batch_env import BatchEnv
from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.policies.scripted import SCRIPTS, tactic
from swarm_pz.policy import Policy, ask

NAMES = sorted(script.__name__ for script in SCRIPTS)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("cells", [5, 10])
def test_every_policy_answers_every_board(name, cells):
    config = GameConfig(drones_per_team=(2, 5), command_cells=cells)
    batch = BatchEnv(config, 6)
    batch.reset(range(6))
    policy = policies.load(name, config)
    assert isinstance(policy, Policy)
    policy.reset(list(range(6)), np.arange(6))
    for _ in range(15):
        rows = np.flatnonzero(batch.running)
        commands = np.ones((6, 2, cells, cells))
        answer = ask(policy, batch, np.ones_like(rows), rows)
        assert answer.max() == pytest.approx(1.0)
        commands[rows, 1] = answer
        batch.step(commands)


@pytest.mark.parametrize("name", NAMES)
def test_answers_do_not_depend_on_the_batch(name):
    batch = BatchEnv(num_games=4)
    batch.reset(range(4))
    batch.step(np.random.default_rng(0).random((4, 2, 10, 10)))
    together, alone = policies.load(name), policies.load(name)
    together.reset([10, 11, 12, 13], np.arange(4))
    alone.reset([12], np.array([2]))
    seen = batch.observe(together.observation, 0)
    for _ in range(2):
        one = together.act(seen, np.arange(4))[2]
        np.testing.assert_allclose(one, alone.act(seen[2:3], np.array([2]))[0], atol=1e-6)


def test_unknown_names_list_the_nearest():
    with pytest.raises(
        PolicyError,
        match=r"no policy 'unifrom', and no such folder; did you mean 'uniform'\? Known: .*wavefront",
    ):
        policies.load("unifrom")


def test_all_scripts_have_a_name():
    assert set(NAMES) <= set(policies.names())


def test_ring_surrounds_the_opponents():
    batch = BatchEnv()
    positions = np.concatenate([np.full((10, 2), 0.9), np.full((10, 2), 0.5)])
    batch.reset([0], scenario={"positions": positions})
    ring = policies.load("ring")
    ring.reset([0], np.zeros(1, int))
    density = ring.act(batch.observe(ring.observation, 0), np.zeros(1, int))[0]
    assert density[4, 4] < 0.1
    assert density[5, 7] > 0.8
    assert density[0, 0] < 0.01


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (np.ones((10, 10)), r"numbers in \[0, inf\] of shape \(2, 10, 10\), got shape \(10, 10\)"),
        (np.full((2, 10, 10), -1.0), r"got values from -1 to -1"),
        (np.full((2, 10, 10), np.nan), r"got nan at index \(0, 0, 0\)"),
        (None, r"got NoneType None"),
    ],
)
def test_a_tactic_that_returns_nonsense_hears_what_was_expected(returned, message):
    @tactic(sees=("time_left",))
    def lost(view):
        return returned

    policy = lost(GameConfig())
    policy.reset([0, 1], np.arange(2))
    with pytest.raises(PolicyError, match="what tactic 'lost' returns for 2 games must be " + ".*" + f"({message})"):
        policy.act(np.zeros((2, 1, 10, 10), np.uint8), np.arange(2))
