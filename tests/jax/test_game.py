"""The game in JAX equals the simulator's, different games share a compilation, and bad input is refused."""

from collections import Counter

import jax
import numpy as np
import pytest
from jax import numpy as jnp

from swarm_pz.config import AGENTS, CHANNELS, GameConfig, MemoryConfig, ObservationConfig
from swarm_pz.errors import CommandError, ConfigError, UnknownNameError
from swarm_pz.jax import make_params, reset, step, step_once
from swarm_pz.simulator import Simulator
from tests.jax.held import PLACES, check, compare, play, stacked, step_all

SMALL = GameConfig(drones_per_team=2, observation=ObservationConfig(grid=10))
UNIFORM = dict.fromkeys(AGENTS, jnp.ones((10, 10)))


def test_every_control_period_is_the_simulators():
    counts = Counter()
    for seed in (0, 3):
        compare(seed, 12, counts)
    assert counts["captures"] > 100 and counts["ends"] > 0 and counts["periods"] > 150
    check(counts)


def test_every_control_period_of_the_kernel_of_pallas_is_the_simulators():
    counts = Counter()
    compare(0, 6, counts, pallas=True)
    assert counts["captures"] > 20 and counts["periods"] > 20
    check(counts)


def test_a_longer_period_of_the_kernel_is_several_short_ones_and_stops_where_it_is_decided():
    rules, periods = play(0, 6)
    states, commands = stacked([period[0] for period in periods]), stacked([period[1] for period in periods])
    short = make_params(rules, drones=PLACES, pallas=True)
    long = make_params(rules.replace(command_period=1.0), drones=PLACES, pallas=True)
    at_once, *_ = step_all(states, commands, long)
    for _ in range(10):
        states, *_ = step_all(states, commands, short)
    assert len(np.unique(states.tick)) > 1
    for one, other in zip(jax.tree.leaves(at_once), jax.tree.leaves(states), strict=True):
        assert np.array_equal(one, other)


def test_games_of_other_sizes_times_and_thresholds_share_what_was_compiled_and_begin_anew():
    rules = [
        SMALL.replace(time_limit=1.0, command_period=0.1),
        SMALL.replace(drones_per_team=(1, 3), time_limit=0.5, command_period=0.2),
        SMALL.replace(drones_per_team=1, capture=SMALL.capture.replace(threshold=0.5)),
    ]
    traced = []

    @jax.jit
    def play(keys, params):
        traced.append(params)
        _, states = jax.vmap(reset)(keys, params)
        actions = dict.fromkeys(AGENTS, jnp.ones((len(keys), 10, 10)))

        def one(states, key):
            keys = jax.random.split(key, len(rules))
            views, states, _, dones, infos = jax.vmap(step)(keys, states, actions, params)
            return states, (states.tick, states.teams, dones["__all__"], infos, views["red_0"])

        return jax.lax.scan(one, states, jax.random.split(keys[0], 12))[1]

    params = jax.tree.map(lambda *leaves: jnp.stack(leaves), *(make_params(one, drones=4) for one in rules))
    keys = jax.random.split(jax.random.key(0), len(rules))
    ticks, teams, ends, infos, views = jax.tree.map(np.asarray, play(keys, params))
    assert ticks[:, 0].tolist() == [3, 6, 9, 12, 15, 18, 21, 24, 27, 0, 3, 6]
    assert ticks[:, 1].tolist() == [6, 12, 0, 6, 12, 0, 6, 12, 0, 6, 12, 0]
    assert ends[:, :2].T.nonzero()[1].tolist() == [9, 2, 5, 8, 11] and infos["truncated"][:, :2][ends[:, :2]].all()
    assert ((np.diff(ticks[:, 2]) == 30) | ends[1:, 2])[ticks[1:, 2] > 0].all()
    assert (np.sort(teams[0], axis=1) == [[0, 0, 1, 1], [0, 1, 1, 1], [-1, -1, 0, 1]]).all()
    assert infos["time_s"][2, 1].tolist() == [0.5, 0.5], "a step stops at the time limit"
    shares = views[0, :, CHANNELS.index("own_share"), 0, 0]
    assert shares.tolist() == [128, 64, 128], "shares are of the drones that are there, not of the places"
    play(keys, jax.tree.map(lambda *leaves: jnp.stack(leaves), *(make_params(one, drones=4) for one in rules[::-1])))
    assert len(traced) == 1


def test_starts_are_distributed_as_the_simulators():
    games, rules = 2000, GameConfig(drones_per_team=1)
    params = make_params(rules)
    draw = jax.jit(jax.vmap(lambda key: reset(key, params)[1].positions))
    mine = np.asarray(draw(jax.random.split(jax.random.key(1), games)))
    simulator = Simulator(rules, games)
    simulator.reset(range(games))
    theirs = simulator.games.positions

    def of(positions):
        corners = positions > 0.5
        away = np.hypot(*np.moveaxis(positions - np.where(corners, 0.9, 0.1), -1, 0))
        same_corner = (corners[:, 0] == corners[:, 1]).all(axis=1).mean()
        return [corners.mean(axis=(0, 1)).tolist(), same_corner, np.quantile(away, [0.1, 0.5, 0.9]).tolist()]

    for one, other, allowed in zip(of(mine), of(theirs), (0.04, 0.04, 0.004), strict=True):
        assert np.allclose(one, other, atol=allowed)


def test_wrong_shapes_and_missing_sides_are_told_when_traced():
    params = make_params(SMALL)
    _, state = jax.eval_shape(reset, jax.random.key(0), params)
    for actions, message in (
        ({"red_0": UNIFORM["red_0"]}, "red_0 and blue_0"),
        ({"red_0": jnp.ones((5, 5)), "blue_0": jnp.ones((10, 10))}, r"red_0 .*\(10, 10\).*\(5, 5\).*jax.vmap"),
    ):
        with pytest.raises(CommandError, match=message):
            jax.eval_shape(step_once, state, actions, params)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"controllers": "flocking"}, "controllers"),
        ({"memory": MemoryConfig(trail=2.0)}, "memory"),
        ({"capture": GameConfig().capture.replace(enabled=False)}, "capture"),
        ({"observation": ObservationConfig(grid=5)}, "observation"),
    ],
)
def test_what_is_not_there_is_refused_by_name(changes, said):
    with pytest.raises(ConfigError, match=f"^{said} must be .*got"):
        make_params(GameConfig().replace(**changes))


def test_too_few_places_and_unknown_fields_are_refused():
    with pytest.raises(ConfigError, match="drones"):
        make_params(SMALL, drones=3)
    with pytest.raises(ConfigError, match="drones must be at most 126"):
        make_params(GameConfig(drones_per_team=64), pallas=True)
    with pytest.raises(UnknownNameError, match="drones_per_team"):
        make_params(GameConfig(drones_per_teams=3))
