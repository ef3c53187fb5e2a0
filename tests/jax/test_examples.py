"""The examples that train in JAX: what they compute, and the policies that they write."""

import importlib.util
import sys
from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from jax import numpy as jnp
from safetensors.numpy import load_file

from swarm_pz.config import CHANNELS, MOTION_CHANNELS, GameConfig, ObservationConfig
from swarm_pz.jax.network import decide, density_of, features_of
from swarm_pz.policies import load
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.policies.pattern import KINDS, PatternPlayer

GAME = GameConfig(drones_per_team=2, time_limit=3.0, observation=ObservationConfig(grid=10))
SEEN = np.random.default_rng(0).integers(0, 256, (4, len(CHANNELS), 10, 10), dtype=np.uint8)


@pytest.fixture(scope="module")
def examples():
    """Return the examples as modules with few, short games and quick compilation: PPO, IPPO and a league."""
    modules = []
    for name in ("jax_ppo", "jax_ippo", "jax_league"):
        spec = importlib.util.spec_from_file_location(name, Path(__file__).parents[2] / "examples" / f"{name}.py")
        modules.append(importlib.util.module_from_spec(spec))
        sys.modules[name] = modules[-1]  # where `NamedTuple` looks for its fields' types
        spec.loader.exec_module(modules[-1])
    ppo, ippo, league = modules
    ppo.RECIPE = ppo.RECIPE.replace(game=GAME, total_steps=16, num_envs=2, rollout=2, batch_size=4)
    ippo.GAME, ippo.GAMES, ippo.STEPS, ippo.EPOCHS, ippo.BATCHES = GAME, 2, 3, 1, 2
    ippo.OPPONENTS = ("uniform",)
    rules = GAME.replace(observation=ObservationConfig(grid=10, channels=CHANNELS + MOTION_CHANNELS))
    league.CONFIG = league.CONFIG.replace(game=rules, num_envs=16, rollout=4, batch_size=8, epochs=1)
    league.EXPLOITERS, league.SLOTS, league.PATTERNS, league.WARM, league.YOUNG = 2, 2, 3, 1, 2
    league.DEAL = league.SNAPSHOT = league.LIFE = 2
    jax.config.update("jax_disable_most_optimizations", True)
    yield ppo, ippo, league
    jax.config.update("jax_disable_most_optimizations", False)
    for module in modules:
        del sys.modules[module.__name__]


def test_what_is_trained_plays_the_same_everywhere(examples, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["jax_ppo.py", "--commands", "16", "--games", "2", "--out", str(tmp_path)])
    examples[0].main()
    out = capsys.readouterr().out
    assert " of 2 games won, " in out, "three seconds end in the second of two updates of two seconds"
    assert "\ncommands seen: 16\n" in out and "\nagainst uniform: " in out
    policy, weights = load(str(tmp_path), GAME), load_file(tmp_path / "policy.safetensors")
    assert isinstance(policy, LearnedPolicy) and policy.card["steps"] == 16
    assert abs(np.linalg.norm(weights["head.weight"]) - 0.01) > 1e-5, "as long as it was before it learned"
    answer = jax.jit(lambda images: density_of(decide(weights, features_of(weights, images / np.float32(255)))))
    assert np.abs(np.asarray(answer(SEEN)) - policy.act(SEEN, np.arange(len(SEEN)))).max() <= 1e-5


def test_a_turned_board_is_worth_as_much_and_answered_as_turned(examples):
    ppo, *_ = examples
    network = ppo.begin(ppo.RECIPE, jax.random.key(3), ppo.make_params(GAME)).network
    answer = jax.jit(ppo.answer)
    means, values = answer(network, SEEN)
    turned_means, turned_values = answer(network, np.rot90(SEEN, axes=(2, 3)))
    assert values.std() > 0.01 and jnp.allclose(values, turned_values, atol=1e-5)
    assert jnp.allclose(jnp.rot90(means, axes=(1, 2)), turned_means, atol=1e-5)


def test_nothing_is_expected_after_an_end(examples):
    rewards, values = np.array([[1.0, 1.0], [2.0, 2.0]], np.float32), np.full((2, 2), 0.5, np.float32)
    steps = examples[0].Step(None, None, None, values, rewards, np.array([[False, True], [False, False]]))
    found = examples[0].advantages(examples[0].RECIPE, steps, np.full(2, 4.0, np.float32))
    gamma, decay = 0.98, 0.98 * 0.95
    second = 2.0 + gamma * 4.0 - 0.5
    assert np.allclose(found, [[1.0 + gamma * 0.5 - 0.5 + decay * second, 1.0 - 0.5], [second, second]])


def test_ippo_learns_and_plays(examples, monkeypatch, capsys):
    _, ippo, _ = examples
    trained, make_train = [], ippo.make_train

    def noted(env, updates, **options):
        train = make_train(env, updates, **options)
        return lambda key: trained.append(train(key)) or trained[0]

    monkeypatch.setattr(ippo, "make_train", noted)
    monkeypatch.setattr(sys, "argv", ["jax_ippo.py", "--commands", "24", "--games", "2", "--world-state"])
    ippo.main()
    out = capsys.readouterr().out
    assert out.startswith("2 updates: ") and "\nagainst uniform: 0 won, 0 lost of 2\n" in out, "three seconds: a draw"
    ((network, metrics),) = trained
    assert network["critic"][0][0].shape == (1800, 64) and metrics["wins"].shape == (2,)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(network))
    assert all(np.abs(bias).max() > 0 for _, bias in network["actor"]), "a bias is 0 until it has learned"
    env = ippo.TwoSides(ippo.make_params(GAME), action="discrete", observation="vector")
    network, _ = jax.eval_shape(make_train(env, 1, world_state=False), jax.random.key(0))
    assert network["critic"][0][0].shape == (900, 64)


def test_a_league_meets_patterns_and_policies_as_they_are(examples):
    """Else a league would learn to beat players that exist nowhere else."""
    league, game = examples[2], examples[2].CONFIG.game
    network = league.widened("hunter", league.CONFIG, np.random.default_rng(0))
    assert network["head.weight"].shape[1] == 8 and network["trunk.near.0.weight"].shape[1] == 14
    boards = np.random.default_rng(1).integers(0, 256, (4, 13, 10, 10), dtype=np.uint8)
    answer = jax.jit(lambda boards: density_of(decide(network, features_of(network, boards / np.float32(255)))))
    assert np.abs(np.asarray(answer(boards)) - load("hunter", game).act(boards[:, :9], np.arange(4))).max() <= 1e-5

    numbers, rows = np.array([list(kind.values()) for kind in KINDS.values()]), np.arange(len(KINDS))
    cells = np.random.default_rng(2).integers(0, 25, (20, 2))  # at centres of cells, where images show the exact mean
    teams = np.repeat([0, 1], 10)
    images = np.zeros((2, 25, 25), np.uint8)
    for (x, y), team in zip(cells, teams, strict=True):
        images[1 - team, y, x] += 64
    player = PatternPlayer(numbers, game)
    player.reset(rows, rows)
    towards = (cells[:10].mean(axis=0) + 0.5) / 25 - 0.5
    for second in range(3):
        state = SimpleNamespace(tick=30 * second, positions=(cells + 0.5) / 25, teams=teams)
        expected = player.act(np.broadcast_to(images, (len(rows), *images.shape)), rows)
        for one, answer in zip(numbers, expected, strict=True):
            mine = league.fly(
                np.append(one, [0.0] * 4), np.arctan2(*towards[::-1]), state, SimpleNamespace(step_ticks=30)
            )
            assert np.abs(np.asarray(mine) - answer).max() < 1e-3


def test_a_league_deals_counts_and_leaves_a_player(examples, tmp_path, monkeypatch, capsys):
    arguments = ["--commands", "128", "--opponents", "hunter", "veteran", "--games", "16", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["jax_league.py", *arguments])
    examples[2].main()
    out = capsys.readouterr().out
    assert "128 commands" in out and "3 patterns" in out and "2 exploiters" in out
    policy, warden = load(str(tmp_path), GAME), load("warden", GAME)
    boards = np.random.default_rng(1).integers(0, 256, (4, 13, 10, 10), dtype=np.uint8)
    far = np.abs(policy.act(boards, np.arange(4)) - warden.act(boards, np.arange(4))).max()
    assert 1e-6 < far < 0.3, "it begins with warden, and learns"
    assert policy.card["steps"] == 128 and policy.card["ancestors"][0]["name"] == "warden"
