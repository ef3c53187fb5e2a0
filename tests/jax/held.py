"""Compare the game in JAX with the simulator: one step from the simulator's state at every control period.

`python -m tests.jax.held` compares 50 games of a minute, with 1 to 40 drones a team.
"""

import argparse
from collections import Counter
from functools import cache

import jax
import numpy as np

from swarm_pz.config import (
    AGENTS,
    CHANNELS,
    CONTROL_PERIOD,
    GRID_CELLS,
    MOTION_CHANNELS,
    TICKS_PER_CONTROL_PERIOD,
    GameConfig,
    ObservationConfig,
)
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.jax import State, make_params, see, step_once
from tests.play.engine_cases import random_density

LARGEST = 40
PLACES = 2 * LARGEST
PERIODS = 100
"""Control periods that are compared at once; games of all lengths share one compilation."""
SEEN = (
    ObservationConfig(grid=10, channels=CHANNELS + MOTION_CHANNELS),
    ObservationConfig(grid=25),
    ObservationConfig(kind="entities"),
)
CLOSE = {"positions": 1e-6, "velocities": 1e-5, "accelerations": 1e-4, "memory": 1e-4, "memory_weight": 1e-5}
"""Largest allowed differences of floats from the simulator's; integers must be equal."""


def state_of(games, places=PLACES):
    """Return the simulator's only game as a state with room for `places` drones."""
    empty = places - games.teams.shape[1]
    teams, trails = games.teams[0], games.trails[0]
    occupancy = np.zeros((2, GRID_CELLS**2), np.int16)
    for team in (0, 1):
        cells = trails[:, teams == team]
        np.add.at(occupancy[team], cells[cells >= 0], 1)
    never = -(10**6)
    captured = np.maximum(games.capture_ticks[0], never).astype(np.int32)
    values = {
        "tick": games.ticks[0].astype(np.int32),
        "teams": np.append(teams, np.full(empty, -1)).astype(np.int8),
        "trails": np.pad(trails, ((0, 0), (0, empty)), constant_values=-1).astype(np.int16),
        "occupancy": occupancy.reshape(2, GRID_CELLS, GRID_CELLS),
        "memory": np.pad(games.memory[0, ..., : len(teams)], ((0, 0), (0, 0), (0, empty))),
        "memory_weight": np.pad(games.memory_weight[0], (0, empty)),
        "targets": games.targets[0].astype(np.float32),
        "capture_ticks": np.pad(captured, (0, empty), constant_values=never),
    }
    values |= {
        name: np.pad(getattr(games, name)[0], ((0, empty), (0, 0)))
        for name in ("positions", "velocities", "accelerations")
    }
    values |= {name: getattr(games, name)[0].astype(np.int32) for name in ("captures", "recaptures")}
    return State(**values)


@cache
def play(seed, seconds):
    """Play a game; return its rules and, of each control period: state before, commands, state after, result, views."""
    generator = np.random.default_rng(seed)
    sizes = tuple(int(size) for size in generator.integers(1, LARGEST + 1, size=2))
    limit, threshold = generator.choice([seconds / 2, 2.0 * seconds]), generator.choice([0.5, 0.75, 0.9])
    rules = GameConfig(drones_per_team=sizes, time_limit=limit, command_period=CONTROL_PERIOD)
    rules = rules.replace(capture=rules.capture.replace(threshold=threshold))
    env, periods = BatchEnv(rules), []
    env.reset([seed])
    while env.running[0] and len(periods) < 10 * seconds:
        if len(periods) % 10 == 0:
            commands = np.stack([random_density(generator) for _ in range(2)])
        before = state_of(env.simulator.games)
        result = env.step(commands[None])
        views = [[env.observe(observation, side) for side in (0, 1)] for observation in SEEN]
        periods.append((before, commands, state_of(env.simulator.games), result, views))
    return rules, periods


@jax.jit
def step_all(states, commands, params):
    """Take a step from many states, without observations, which `see_all` computes."""
    actions = {agent: commands[:, side] for side, agent in enumerate(AGENTS)}
    return jax.vmap(step_once, (0, 0, None))(states, actions, params)[1:]


see_all = jax.jit(jax.vmap(see, (0, None)))


def stacked(trees):
    """Stack trees of the same structure, and repeat the last one up to `PERIODS`."""
    every = [*trees, *[trees[-1]] * (PERIODS - len(trees))]
    return jax.tree.map(lambda *leaves: np.stack(leaves), *every)


def compare(seed, seconds, counts, *, pallas=False):
    """Compare a game, and count the differences in `counts`.

    Rounding can put a drone into a neighbouring cell. Such a step is a tie: it is counted and not compared.
    """
    rules, periods = play(seed, seconds)
    params = make_params(rules, drones=PLACES, pallas=pallas)
    for begin in range(0, len(periods), PERIODS):
        befores, commands, afters, results, views = zip(*periods[begin : begin + PERIODS], strict=True)
        count, theirs = len(befores), stacked(afters)
        stepped = step_all(stacked(befores), stacked(commands), params)
        mine, rewards, dones, infos = jax.tree.map(np.asarray, stepped)
        differing = mine.trails != theirs.trails
        cells = np.abs(mine.trails.astype(int) - theirs.trails)[differing]
        assert np.isin(cells, (1, GRID_CELLS)).all(), f"game {seed}: a drone is in another part of the board"
        same = np.flatnonzero(~differing.any(axis=(1, 2))[:count])
        # A captured drone loses its memory at once in the simulator, and at the next solve in JAX.
        is_old = theirs.capture_ticks <= theirs.tick[:, None] - TICKS_PER_CONTROL_PERIOD
        knows = {"memory": (is_old & (theirs.teams >= 0))[:, None, None], "memory_weight": is_old & (theirs.teams >= 0)}
        counts["periods"] += count
        counts["ties"] += count - len(same)
        for name, one, other in zip(State._fields, mine, theirs, strict=True):
            far = np.abs(one[same].astype(float) - other[same])
            if name.startswith("memory"):
                far = far * knows[name][same]
            if name in CLOSE:
                counts[f"most of {name}"] = max(counts[f"most of {name}"], float(far.max(initial=0.0)))
            elif name != "targets":
                counts[f"other {name}"] += int((far > 0).reshape(len(far), -1).any(axis=1).sum())
        for row in same:
            result, red = results[row], float(rewards[AGENTS[0]][row])
            ends = bool(result.terminated[0]), bool(result.truncated[0])
            counts["other rewards"] += abs(red - result.rewards[0, 0]) > 1e-6 or red != -rewards[AGENTS[1]][row]
            counts["other ends"] += (bool(dones["__all__"][row]), infos["truncated"][row].all()) != (any(ends), ends[1])
            for name in ("captured", "recaptured"):
                counts["other infos"] += (infos[name][row] != getattr(result, name)[0]).any()
            counts["ends"] += any(ends)
            counts["captures"] += int(result.captured.sum())
        for number, observation in enumerate(() if pallas else SEEN):  # the kernel does not observe
            observed = see_all(theirs, make_params(rules.replace(observation=observation), drones=PLACES))
            for side, agent in enumerate(AGENTS):
                for row, view in enumerate(views):
                    one = jax.tree.map(lambda values, row=row: np.asarray(values[row]), observed[agent])
                    compare_views(one, jax.tree.map(lambda values: values[0], view[number][side]), observation, counts)
    return counts


def compare_views(mine, theirs, observation, counts):
    """Compare a side's observations; halves may be rounded either way, depending on the processor."""
    if isinstance(theirs, dict):
        for name, values in theirs.items():
            ours = mine[name][: len(values)]
            counts["other lists"] += not np.allclose(ours, values, rtol=0, atol=1e-6) or mine[name][len(values) :].any()
        return
    for channel, one, other in zip(observation.channels, mine, theirs, strict=True):
        far = np.abs(one.astype(int) - other)
        if channel.endswith(("capture_field", "own_target", "now", "soon")):
            counts[f"{channel}, by 1"] += int((far == 1).sum())
            far = far * (far > 1)
        counts[f"other {channel}"] += bool(far.any())


def check(counts):
    """Check that all differences come from rounding."""
    assert counts["ties"] <= 0.01 * counts["periods"]
    assert not {name: count for name, count in counts.items() if name.startswith("other") and count}
    assert all(counts[f"most of {name}"] <= most for name, most in CLOSE.items())
    # Values half-way between two integers may be rounded either way.
    assert sum(counts[name] for name in counts if name.endswith("by 1")) < 3 * counts["periods"]


def main():
    """Compare many games, and print what was found."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--games", type=int, default=50)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--pallas", action="store_true", help="play by the kernel of Pallas")
    options = parser.parse_args()
    counts = Counter()
    for seed in range(options.games):
        compare(seed, options.seconds, counts, pallas=options.pallas)
        print(seed + 1, dict(counts), flush=True)


if __name__ == "__main__":
    main()
