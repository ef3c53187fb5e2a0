"""The faces of JaxMARL and Gymnax: shapes, spaces, the player's part, and what follows an end."""

import jax
import numpy as np
import pytest
from jax import numpy as jnp

from swarm_pz.config import AGENTS, CHANNELS, GameConfig, ObservationConfig
from swarm_pz.jax import make_params
from swarm_pz.jax.environments import OneSide, TwoSides
from swarm_pz.jax.players import Player

GAME = GameConfig(drones_per_team=2, time_limit=0.2, command_period=0.1, observation=ObservationConfig(grid=10))
PARAMS = make_params(GAME)
KEY, EVEN = jax.random.key(0), jnp.ones((10, 10))


def test_jaxmarls_face_gives_what_its_spaces_say():
    env = TwoSides(PARAMS)
    assert env.agents == list(AGENTS) and env.num_agents == 2
    actions = {agent: env.action_space(agent).sample(KEY) for agent in env.agents}
    seen, state = jax.eval_shape(env.reset, KEY)
    for given in (jax.eval_shape(env.step, KEY, state, actions), jax.eval_shape(env.step_env, KEY, state, actions)):
        again, after, rewards, dones, infos = given
        assert again == seen == jax.eval_shape(env.get_obs, state) and after == state
        assert set(rewards) == set(AGENTS) and set(dones) == {*AGENTS, "__all__"}
        assert all(info.shape == (2,) for info in jax.tree.leaves(infos)), "trainers reshape them by agents"
    for agent in AGENTS:
        space = env.observation_space(agent)
        assert (seen[agent].shape, seen[agent].dtype) == (space.shape, space.dtype)
    space = env.observation_space("red_0")
    drawn = space.sample(KEY)
    assert space.contains(drawn) and drawn.max() == 255 and not env.action_space("red_0").contains(drawn)


@pytest.fixture(scope="module")
def both_sides():
    """Return a step of both sides, compiled, a state, and another, which follows an end."""
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
    env = OneSide(Player(25, lambda key, seen: corner * (seen.shape == (9, 25, 25))))
    mine, step = env.action_space(PARAMS).sample(KEY), jax.jit(env.step)
    _, after, reward, terminated, truncated, info = step(KEY, state, mine, PARAMS)
    _, expected, rewards, _, _ = both(state, mine, corner)
    assert all(jnp.array_equal(a, b) for a, b in zip(after, expected, strict=True)) and reward == rewards["red_0"]
    assert not terminated and not truncated and info["size"] == 2
    seen, fresh, _, terminated, truncated, info = step(KEY, after, mine, PARAMS)
    last = np.asarray(info["final_observation"])
    assert truncated and not terminated and fresh.tick == 0 and (np.asarray(seen) != last).any()
    assert (last[CHANNELS.index("time_left")] == 0).all()
