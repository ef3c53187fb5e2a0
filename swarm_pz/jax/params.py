"""Parameters and state of a game in JAX."""

from __future__ import annotations

import dataclasses
import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import numpy as jnp

from swarm_pz.config import CHANNELS, MOTION_CHANNELS, CaptureConfig, GameConfig, ObservationConfig
from swarm_pz.config.base import check, check_count

Array = Any
"""An array of JAX: its own type says nothing of shapes."""
PARTS = 2**32
"""A threshold is stored in units of 1 / `PARTS`, rounded up, so that 0.9 of 100 is not less than 90."""
MOST_DRONES = 200
"""Most drones of both teams: the occupancy of more does not fit into int16."""
MOST_FOR_PALLAS = 126
"""Most drones with Pallas: more do not fit into a GPU's shared memory."""
ABSENT = -1
"""Team of places without a drone."""
GRIDS = (10, 25, 50)
_MAY_DIFFER = ("drones_per_team", "time_limit", "command_period", "capture", "observation")


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["sizes", "step_ticks", "limit_ticks", "threshold", "times_left", "shares"],
    meta_fields=["drones", "grid", "motion", "pallas"],
)
@dataclass(frozen=True)
class Params:
    """Numbers of a game, traced but for the last four; make them by `make_params`."""

    sizes: Array
    """int32 (2,): drones of red and blue at the start."""
    step_ticks: Array
    """int32: ticks of a command period."""
    limit_ticks: Array
    """int32: ticks until a draw."""
    threshold: Array
    """uint32: share of a capture field's maximum above which it captures, in units of 1 / `PARTS`."""
    times_left: Array
    """int32 (255,): last tick at which the channel `time_left` is at least as bright as 1, 2, ..., 255."""
    shares: Array
    """uint8 (drones + 1,): brightness of the channel `own_share`, by the number of own drones."""
    drones: int
    """Places for drones, N. Static: another value compiles anew."""
    grid: int
    """Cells a side of the observed images; 0: lists of drones. Static."""
    motion: bool
    """True: images show `MOTION_CHANNELS` after `CHANNELS`. Static."""
    pallas: bool
    """True: `swarm_pz.jax.kernel` plays. Static."""


class State(NamedTuple):
    """All that changes in a game of N places for drones."""

    tick: Array
    """int32: ticks since the start."""
    positions: Array
    """float32 (N, 2), map widths."""
    velocities: Array
    """float32 (N, 2), map widths a second."""
    accelerations: Array
    """float32 (N, 2), map widths per second squared, held between solves."""
    teams: Array
    """int8 (N,): 0 red, 1 blue, -1 nobody."""
    trails: Array
    """int16 (T, N): cells, row * 50 + column, by the tick modulo T; -1 where there is no past."""
    occupancy: Array
    """int16 (2, 50, 50): ticks that each team's trails count in each cell."""
    memory: Array
    """float32 (K, K, N): each drone's decayed sums of F_k."""
    memory_weight: Array
    """float32 (N,): the weight of these sums."""
    targets: Array
    """float32 (2, A, A): the commands in force; each sums to 1."""
    capture_ticks: Array
    """int32 (N,): tick of each drone's last capture."""
    captures: Array
    """int32 (2,): drones that each team has taken."""
    recaptures: Array
    """int32 (2,): of these, drones that it had lost within the last second."""


def make_params(config: GameConfig | None = None, *, drones: int | None = None, pallas: bool = False) -> Params:
    """Return the parameters of a game, the default one if no `config` is given.

    Team sizes, times, threshold and observation may differ from the default. Games that differ in the first three can
    be stacked and mapped over, and share compiled code, if they have equally many places for `drones`: at least the
    drones of both teams, which is the default. With `pallas`, a Pallas kernel for NVIDIA GPUs plays each command
    period; a CPU interprets it. Raises a ConfigError that names the rule if another rule is not the default, or if
    games in JAX do not have the value.
    """
    rules, default = GameConfig() if config is None else config, GameConfig()
    for field in dataclasses.fields(GameConfig):
        value, expected = getattr(rules, field.name), getattr(default, field.name)
        is_known = field.name in _MAY_DIFFER or value == expected
        check(is_known, field.name, value, f"{expected}, since games in JAX have no other")
    capture = CaptureConfig(threshold=rules.capture.threshold)
    check(rules.capture == capture, "capture", rules.capture, f"{capture}, since games in JAX have no other")
    total = rules.num_drones
    check(total <= MOST_DRONES, "drones_per_team", rules.drones_per_team, f"at most {MOST_DRONES} of both teams")
    places = total if drones is None else check_count(drones, "drones", total, MOST_DRONES)
    check(not pallas or places <= MOST_FOR_PALLAS, "drones", places, f"at most {MOST_FOR_PALLAS} with pallas")
    limit = rules.limit_ticks
    grid, motion = _images_of(rules.observation)

    def dimness(tick: int) -> int:
        return -int(255.0 * (1.0 - tick / limit) + 0.5)

    return Params(
        sizes=jnp.array(rules.team_sizes, jnp.int32),
        step_ticks=jnp.int32(rules.step_ticks),
        limit_ticks=jnp.int32(limit),
        threshold=jnp.uint32(math.ceil(capture.threshold * PARTS)),
        times_left=jnp.array([bisect_right(range(limit + 1), -k, key=dimness) - 1 for k in range(1, 256)], jnp.int32),
        shares=jnp.array(np.minimum(255.0 * np.arange(places + 1) / total + 0.5, 255.0).astype(np.uint8)),
        drones=places,
        grid=grid,
        motion=motion,
        pallas=pallas,
    )


def _images_of(observation: ObservationConfig | tuple[ObservationConfig, ObservationConfig]) -> tuple[int, bool]:
    """Return the images' cells a side (0 for lists of drones), and whether they show motion."""
    if isinstance(observation, ObservationConfig) and observation.kind == "entities":
        return 0, False
    matches = [
        (grid, channels != CHANNELS)
        for grid in GRIDS
        for channels in (CHANNELS, CHANNELS + MOTION_CHANNELS)
        if observation == ObservationConfig(grid=grid, channels=channels)
    ]
    expected = (
        f"the default channels, or these and then {', '.join(MOTION_CHANNELS)}, on a grid of "
        f"{', '.join(map(str, GRIDS))}, or entities, the same for both sides"
    )
    check(bool(matches), "observation", observation, expected)
    return matches[0]
