"""The Pallas kernel, interpreted, plays the simulator's game."""

from collections import Counter

import jax
import numpy as np

from swarm_pz.jax import make_params
from tests.jax.held import PLACES, check, compare, play, stacked, step_all


def test_every_control_period_is_the_simulators():
    counts = Counter()
    compare(0, 6, counts, pallas=True)
    assert counts["captures"] > 20 and counts["periods"] > 20
    check(counts)


def test_a_longer_period_is_several_short_ones_and_stops_where_it_is_decided():
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
