"""What a game must have been between two looks at its drones: their trails, and the capture fields of those."""

from __future__ import annotations

import numpy as np

from swarm_pz.kernels import entry_point, kernel
from swarm_pz.kernels.arrays import Float32s, Int8s, Int64s
from swarm_pz.kernels.capture import Boards, add_up
from swarm_pz.kernels.game import Games, RuleParameters, RuleVariants, change_team, swarm_of
from swarm_pz.kernels.trails import extend_trails, take_back_newest


@kernel
def between(
    from_position: np.float32,
    from_velocity: np.float32,
    to_position: np.float32,
    to_velocity: np.float32,
    share: np.float32,
) -> np.float32:
    """Return a coordinate at some share of the way, on the cubic with these ends (Hermite's); velocities a way."""
    rest = np.float32(1.0) - share
    ahead = from_position + share * from_velocity + share * share * (to_position - from_position - from_velocity)
    behind = to_position - rest * to_velocity + rest * rest * (from_position - to_position + to_velocity)
    return min(max(rest * ahead + share * behind, np.float32(0.0)), np.float32(1.0))


@kernel
def stands(begun: Float32s, position: Float32s, velocity: Float32s) -> bool:
    """Whether a drone is at rest where it was: one at work never is, not to the last bit."""
    return bool(np.all(position == begun) and np.all(velocity == np.float32(0.0)))


@kernel
def retrace_game(
    games: Games,
    e: int,
    ticks: int,
    positions: Float32s,
    velocities: Float32s,
    teams: Int8s,
    rules: RuleParameters,
    variants: RuleVariants | None,
) -> None:
    """Bring game `e` to where its drones were seen, some ticks later."""
    swarm = swarm_of(games, e)
    trails, num_drones = games.trails[e], teams.shape[0]
    boards = Boards(games.fields[e], games.occupancy[e], rules.ring_weights)
    begun, moving = swarm.positions.copy(), swarm.velocities * (rules.drift * np.float32(ticks))
    moved = velocities * (rules.drift * np.float32(ticks))
    if variants is not None:  # noqa: SIM102  (only a test for None alone is decided when compiling)
        if variants.can_fail:
            for i in range(num_drones):
                games.failed[e, i] = stands(begun[i], positions[i], velocities[i])
    for tick in range(ticks):
        share = np.float32(tick + 1) / np.float32(ticks)
        for i in range(num_drones):
            for axis in range(2):
                swarm.positions[i, axis] = between(
                    begun[i, axis], moving[i, axis], positions[i, axis], moved[i, axis], share
                )
        slot = games.ticks[e] % trails.shape[0]
        extend_trails(swarm.positions, swarm.teams, slot, trails, boards)
        if variants is not None:  # noqa: SIM102
            if variants.can_fail:
                take_back_newest(games.failed[e], swarm.teams, slot, trails, boards)
        games.ticks[e] += 1
    for i in range(num_drones):
        for axis in range(2):  # one by one: copying whole arrays takes seconds to compile
            swarm.positions[i, axis], swarm.velocities[i, axis] = positions[i, axis], velocities[i, axis]
    for i in range(num_drones):
        if teams[i] != swarm.teams[i]:
            change_team(games, e, i, rules, boards, variants)
    add_up(boards)


@entry_point
def retrace_games(
    games: Games,
    rows: Int64s,
    ticks: int,
    positions: Float32s,
    velocities: Float32s,
    teams: Int8s,
    rules: RuleParameters,
    variants: RuleVariants | None,
) -> None:
    """Bring the games `rows` (n,) to where their drones were seen (n, N, ...), all as many ticks later."""
    for place in range(len(rows)):
        retrace_game(games, rows[place], ticks, positions[place], velocities[place], teams[place], rules, variants)
