"""The interfaces of JaxMARL and Gymnax: shapes, spaces, actions, the opponent, and resets after an end."""

import runpy
import sys
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from jax import numpy as jnp

from swarm_pz.config import AGENTS, CHANNELS, MOTION_CHANNELS, GameConfig, ObservationConfig
from swarm_pz.jax import environments, make_params
from swarm_pz.jax.environments import OneSide, TwoSides, make_actions
from swarm_pz.jax.players import SCRIPTS, Player
from swarm_pz.spaces.actions import make_actions as simulator_actions

GAME = GameConfig(drones_per_team=2, time_limit=0.2, command_period=0.1, observation=ObservationConfig(grid=10))
PARAMS = make_params(GAME)
MOTION = make_params(GAME.replace(observation=ObservationConfig(grid=10, channels=CHANNELS + MOTION_CHANNELS)))
KEY, EVEN = jax.random.key(0), jnp.ones((10, 10))


@pytest.mark.parametrize(
    ("options", "agents", "shape"),
    [
        ({"params": MOTION}, AGENTS, (13, 10, 10)),
        ({"action": "modes", "final_observation": True}, AGENTS, (9, 10, 10)),
        ({"action": "discrete", "observation": "vector"}, AGENTS, (900,)),
        ({"action": "discrete", "observation": "vector", "opponent": SCRIPTS["halo"]}, AGENTS[:1], (900,)),
    ],
)
def test_steps_have_the_shapes_of_the_spaces(options, agents, shape):
    env = TwoSides(**{"params": PARAMS} | options)
    count = len(agents)
    assert env.agents == list(agents) and env.num_agents == count
    actions = {agent: env.action_space(agent).sample(KEY) for agent in agents}
    assert all(env.action_space(agent).contains(action) for agent, action in actions.items())
    views, state = jax.eval_shape(env.reset, KEY)
    for step in (jax.eval_shape(env.step, KEY, state, actions), jax.eval_shape(env.step_env, KEY, state, actions)):
        again, after, rewards, dones, infos = step
        assert again == views == jax.eval_shape(env.get_obs, state) and after == state
        assert set(rewards) == set(agents) and set(dones) == {*agents, "__all__"}
        last = infos.pop("final_observation", None)
        assert last is None or last.shape == (count, *shape)
        assert all(info.shape == (count,) for info in jax.tree.leaves(infos)), "trainers reshape them by agents"
    space = env.observation_space("red_0")
    assert all((views[agent].shape, views[agent].dtype) == (space.shape, space.dtype) for agent in agents)
    if "observation" in options:
        assert views["world_state"].shape == (count, env.world_state_size())
        assert {agent: mask.tolist() for agent, mask in env.get_avail_actions(state).items()} == dict.fromkeys(
            agents, [True] * 57
        )


@pytest.mark.parametrize("kind", ["modes", "discrete"])
def test_actions_become_the_densities_of_the_other_wrappers(kind):
    form = simulator_actions(GAME, GAME.team_systems[0], kind, None)
    actions, (_, read) = np.arange(57), make_actions(kind)
    if kind == "modes":
        actions = np.random.default_rng(0).uniform(-2.0, 2.0, (20, 5)).astype(np.float32)
        assert jnp.allclose(read(2 * actions[0]), read(np.clip(2 * actions[0], -2.0, 2.0)))
    expected = form.read(actions, len(actions), "action")
    assert np.abs(np.stack([read(action) for action in actions]) - expected).max() < 1e-5
    if kind == "discrete":
        assert (read(jnp.array([9])) == read(9)).all(), "trainers of JaxMARL hand over arrays (1,)"


def test_vectors_are_the_images_and_the_world_begins_with_ones_own():
    envs = [TwoSides(PARAMS, observation=kind) for kind in ("images", "vector")]
    images, vectors = jax.jit(lambda key: [env.reset(key)[0] for env in envs])(KEY)
    red, blue = (images[agent].reshape(-1) / np.float32(255) for agent in AGENTS)
    assert jnp.array_equal(vectors["red_0"], red) and jnp.array_equal(vectors["blue_0"], blue) and (red != blue).any()
    assert jnp.array_equal(vectors["world_state"], [[*red, *blue], [*blue, *red]])


def test_the_spaces_are_of_the_libraries_that_are_installed(monkeypatch):
    kinds = {}
    for library in ("jaxmarl", "gymnax"):
        kinds[library] = SimpleNamespace(Box=type("Box", (), {}), Discrete=type("Discrete", (), {}))
        monkeypatch.setitem(sys.modules, library, SimpleNamespace())
        monkeypatch.setitem(sys.modules, f"{library}.environments", SimpleNamespace())
        monkeypatch.setitem(sys.modules, f"{library}.environments.spaces", kinds[library])
    env = runpy.run_path(environments.__file__)["TwoSides"](PARAMS, action="discrete", observation="vector")
    box, number = env.observation_space("red_0"), env.action_space("red_0")
    assert all(isinstance(box, kind.Box) and isinstance(number, kind.Discrete) for kind in kinds.values())
    assert (box.shape, box.low, box.high, box.dtype, number.n) == ((900,), 0.0, 1.0, jnp.float32, 57)


@pytest.fixture(scope="module")
def both_sides():
    """Return a compiled step of both sides, a state, and the state that follows the end of a game."""
    env, step = TwoSides(PARAMS), jax.jit(TwoSides(PARAMS).step)
    state, other = (jax.jit(env.reset)(jax.random.key(seed))[1] for seed in (0, 1))
    return lambda state, red, blue: step(KEY, state, {"red_0": red, "blue_0": blue}, other), state, other


def test_a_given_state_follows_an_end(both_sides):
    step, state, other = both_sides
    _, second, _, dones, _ = step(state, EVEN, EVEN)
    assert not dones["__all__"] and second.tick == 3
    _, third, _, dones, _ = step(second, EVEN, EVEN)
    assert dones["__all__"] and all(jnp.array_equal(a, b) for a, b in zip(third, other, strict=True))


def test_values_beyond_a_density_are_clipped_and_counted_by_side(both_sides):
    step, state, _ = both_sides
    bad = 0.5 * EVEN.at[0].set(jnp.nan).at[1, :3].set(jnp.inf).at[2, 0].set(-1.0)
    mended = 0.5 * EVEN.at[0].set(0.0).at[1, :3].set(2.0).at[2, 0].set(0.0)
    _, one, rewards, _, infos = step(state, bad, mended)
    _, other, _, _, _ = step(state, mended, mended)
    assert infos["clipped"].tolist() == [14, 0] and jnp.isfinite(rewards["red_0"])
    assert all(jnp.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_a_learner_meets_the_player_and_sees_the_end(both_sides):
    both, state, _ = both_sides
    corner = jnp.zeros((10, 10)).at[0, 0].set(1.0)
    env = OneSide(Player(25, lambda key, views: corner * (views.shape == (13, 25, 25)), motion=True))
    mine, step = env.action_space(PARAMS).sample(KEY), jax.jit(env.step)
    _, after, reward, terminated, truncated, info = step(KEY, state, mine, PARAMS)
    _, expected, rewards, _, _ = both(state, mine, corner)
    assert all(jnp.array_equal(a, b) for a, b in zip(after, expected, strict=True)) and reward == rewards["red_0"]
    assert not terminated and not truncated and info["size"] == 2
    views, fresh, _, terminated, truncated, info = step(KEY, after, mine, PARAMS)
    last = np.asarray(info["final_observation"])
    assert truncated and not terminated and fresh.tick == 0 and (np.asarray(views) != last).any()
    assert (last[CHANNELS.index("time_left")] == 0).all()
