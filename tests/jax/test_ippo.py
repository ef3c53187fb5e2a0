"""The example in the shape of JaxMARL's baselines."""

import importlib.util
import sys
from pathlib import Path

import jax
import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig


@pytest.fixture
def example(monkeypatch):
    """Return the example as a module of few and short games, compiled quickly."""
    path = Path(__file__).parents[2] / "examples" / "jax_ippo.py"
    spec = importlib.util.spec_from_file_location("jax_ippo", path)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "jax_ippo", module)  # where `NamedTuple` looks for its fields' types
    spec.loader.exec_module(module)
    module.GAME = GameConfig(drones_per_team=2, time_limit=3.0, observation=ObservationConfig(grid=10))
    module.GAMES, module.STEPS, module.EPOCHS, module.BATCHES = 2, 3, 1, 2
    jax.config.update("jax_disable_most_optimizations", True)
    yield module
    jax.config.update("jax_disable_most_optimizations", False)


def test_it_learns_and_plays(example, monkeypatch, capsys):
    found, make_train = [], example.make_train

    def kept(env, updates, **options):
        train = make_train(env, updates, **options)
        return lambda key: found.append(train(key)) or found[0]

    monkeypatch.setattr(example, "make_train", kept)
    monkeypatch.setattr(sys, "argv", ["jax_ippo.py", "--commands", "24", "--games", "2", "--world-state"])
    example.main()
    said = capsys.readouterr().out
    assert said.startswith("2 updates: ") and "\nagainst uniform: 0 won, 0 lost of 2\n" in said, "three seconds: a draw"
    ((network, told),) = found
    assert network["critic"][0][0].shape == (1800, 64) and told["wins"].shape == (2,)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(network))
    assert all(np.abs(bias).max() > 0 for _, bias in network["actor"]), "a bias is 0 until it has learned"
    env = example.TwoSides(example.make_params(example.GAME), action="discrete", observation="vector")
    network, _ = jax.eval_shape(make_train(env, 1, world_state=False), jax.random.key(0))
    assert network["critic"][0][0].shape == (900, 64)
