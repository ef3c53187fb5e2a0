"""The start of a game: at random near the corners, or a scenario."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.config.values import as_floats, check_values
from swarm_pz.errors import CommandError

Seed = int | np.random.SeedSequence


def check_seed(seed: Seed) -> np.random.SeedSequence:
    """Return a seed as a SeedSequence.

    Raises
    ------
    CommandError
        If it is neither a whole number of at least 0 nor a SeedSequence.
    """
    if isinstance(seed, np.random.SeedSequence):
        return seed
    if isinstance(seed, (int, np.integer)) and not isinstance(seed, bool) and seed >= 0:
        return np.random.SeedSequence(int(seed))
    raise CommandError(f"a seed must be a whole number of at least 0 or a SeedSequence, got {seed!r}")


def next_seed(generator: np.random.Generator) -> np.random.SeedSequence:
    """Return the seed of a sequence's next game, spawned from the SeedSequence of the generator."""
    return seeds_of(generator).spawn(1)[0]


def check_team(team: int) -> None:
    """Check that a team is 0 (red) or 1 (blue), as a whole number.

    Raises
    ------
    CommandError
        If it is not.
    """
    if not isinstance(team, (int, np.integer)) or isinstance(team, bool) or team not in (RED, BLUE):
        raise CommandError(f"team must be 0 (red) or 1 (blue), got {team!r}")


def seeds_of(generator: np.random.Generator) -> np.random.SeedSequence:
    """Return the SeedSequence that a generator was made from.

    Raises
    ------
    CommandError
        If it was not made from a SeedSequence.
    """
    seeds = generator.bit_generator.seed_seq
    if not isinstance(seeds, np.random.SeedSequence):
        raise CommandError(f"np_random must be a Generator made from a SeedSequence, got {generator!r}")
    return seeds


def random_start(config: GameConfig, generator: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Draw positions (N, 2), red drones first, and distinct altitudes (N,)."""
    draw = _near_corners if config.spawn.layout == "corners" else _in_squares
    positions = draw(config, generator)
    altitudes = (generator.permutation(config.num_drones) + 1.0) / config.num_drones
    return np.clip(positions, 0.0, 1.0), altitudes


def random_velocities(config: GameConfig, generator: np.random.Generator) -> NDArray[np.float64]:
    """Draw velocities (N, 2) of drones that start moving: red's to the upper right, blue's to the lower left."""
    velocities = generator.uniform(0.0, config.spawn.speed, (config.num_drones, 2))
    velocities[config.team_sizes[RED] :] *= -1.0
    return velocities


def _near_corners(config: GameConfig, generator: np.random.Generator) -> NDArray[np.float64]:
    count, spawn = config.num_drones, config.spawn
    corners = np.where(generator.integers(2, size=(count, 2)) == 1, 1.0 - spawn.inset, spawn.inset)
    angle = generator.uniform(0.0, 2.0 * np.pi, count)
    distance = spawn.radius * np.sqrt(generator.uniform(0.0, 1.0, count))
    return np.asarray(corners + distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def _in_squares(config: GameConfig, generator: np.random.Generator) -> NDArray[np.float64]:
    spawn, red = config.spawn, config.team_sizes[RED]
    positions = spawn.inset + spawn.side * generator.uniform(0.0, 1.0, (config.num_drones, 2))
    positions[red:] = 1.0 - positions[red:]
    return positions


_PARTS = ("positions", "velocities", "teams")
_MISSPELT = 0.76
"""Similarity from which on a name counts as misspelt; "options", which PettingZoo's own tests send, is below it."""


FASTEST = 1e6
"""A velocity that no drone reaches, and with which all computations are finite."""


def check_scenario(scenario: Mapping[str, ArrayLike], config: GameConfig) -> dict[str, NDArray[Any]]:
    """Return the parts of a scenario as arrays that fit the game; other names, which wrappers may use, are left out.

    Raises
    ------
    CommandError
        If a part has the wrong shape, holds values that no drone can have, or has a misspelt name.
    """
    if not isinstance(scenario, Mapping):
        raise CommandError(f"a scenario must be a mapping of positions, velocities and teams, got {scenario!r}")
    for name in scenario:
        for near in difflib.get_close_matches(str(name), _PARTS, n=1, cutoff=_MISSPELT):
            if name != near:
                raise CommandError(f"there is no option {name!r}: did you mean {near!r}? Known: {', '.join(_PARTS)}")
    count = config.num_drones
    start: dict[str, NDArray[Any]] = {}
    for name, low, high in (("positions", 0.0, 1.0), ("velocities", -10.0, 10.0)):
        if name in scenario:
            start[name] = check_values(scenario[name], (count, 2), low, high, f"scenario {name}")
    if "teams" in scenario:
        expected = f"scenario teams must be {count} numbers that are 0 (red) or 1 (blue)"
        values = as_floats(scenario["teams"], expected)
        if values.shape != (count,) or not np.isin(values, (0, 1)).all():
            raise CommandError(f"{expected}, got {scenario['teams']!r}")
        if config.capture.enabled and len(np.unique(values)) < 2:
            raise CommandError(f"{expected}, with at least one of each, got {scenario['teams']!r}")
        start["teams"] = values.astype(np.int8)
    return start
