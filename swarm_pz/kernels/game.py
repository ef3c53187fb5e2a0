"""One game's tick, in the order of the rules, and the loop over games that Python calls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels import entry_point, kernel
from swarm_pz.kernels.capture import Boards, add_up, find_captured
from swarm_pz.kernels.dynamics import move
from swarm_pz.kernels.ergodic import ErgodicParameters, Scratch, ergodic, make_scratch, saturate
from swarm_pz.kernels.trails import extend_trails, hand_over_trail


class Games(NamedTuple):
    """Everything that changes, of E games; copying these arrays copies the games."""

    ticks: NDArray[np.int64]
    """(E,) ticks since the start."""
    positions: NDArray[np.float32]
    """(E, N, 2) map widths."""
    velocities: NDArray[np.float32]
    """(E, N, 2) map widths per second."""
    accelerations: NDArray[np.float32]
    """(E, N, 2) map widths per second squared, held between solves."""
    altitudes: NDArray[np.float32]
    """(E, N) shown, never used; distinct within a game."""
    teams: NDArray[np.int8]
    """(E, N) 0 red, 1 blue."""
    trails: NDArray[np.int16]
    """(E, T, N) grid cells, -1 where there is no past yet."""
    fields: NDArray[np.integer]
    """(E, 2, G + 4, G + 4) each team's capture field, framed and in units of `capture.FIELD_UNIT`."""
    occupancy: NDArray[np.integer]
    """(E, 2, G + 4, G + 4) what `fields` is added up from, with many drones; else (E, 2, 0, 0)."""
    memory: NDArray[np.float32]
    """(E, K, K, N) the controller's decayed sums of F_k over the past."""
    memory_weight: NDArray[np.float32]
    """(E, N) their weight."""
    targets: NDArray[np.float64]
    """(E, 2, A, A) each team's command in force, summing to 1."""
    coefficients: NDArray[np.float32]
    """(E, 2, K, K) Fourier coefficients phi_k of the targets."""
    capture_ticks: NDArray[np.int64]
    """(E, N) tick of each drone's last capture."""
    captures: NDArray[np.int64]
    """(E, 2) drones that each team has captured since the start."""
    recaptures: NDArray[np.int64]
    """(E, 2) of these, drones that it had itself lost within the last second."""


class RuleParameters(NamedTuple):
    """Numbers of the rules, ready for the kernels."""

    tick: np.float32
    ticks_per_control_period: int
    ticks_per_second: int
    capture_enabled: bool
    capture_threshold: float
    ring_weights: NDArray[np.integer]
    """(G + 4, G + 4) see `swarm_pz.kernels.capture`."""


@kernel
def has_loser(teams: NDArray[np.int8]) -> bool:
    """Whether one team owns every drone."""
    blue = 0
    for i in range(teams.shape[0]):
        blue += teams[i]
    return blue == 0 or blue == teams.shape[0]


@kernel
def advance_game(
    games: Games, e: int, ticks: int, rules: RuleParameters, controller: ErgodicParameters, scratch: Scratch
) -> None:
    """Advance game `e` by some ticks, or to the tick that decides it."""
    positions, velocities, accelerations = games.positions[e], games.velocities[e], games.accelerations[e]
    teams, trails = games.teams[e], games.trails[e]
    boards = Boards(games.fields[e], games.occupancy[e], rules.ring_weights)
    memory, memory_weight = games.memory[e], games.memory_weight[e]
    num_drones = teams.shape[0]
    captured, peaks = np.empty(num_drones, np.bool_), np.zeros(2, np.int64)

    for _ in range(ticks):
        if rules.capture_enabled and has_loser(teams):
            return
        if games.ticks[e] % rules.ticks_per_control_period == 0:
            ergodic(
                positions,
                velocities,
                teams,
                memory,
                memory_weight,
                games.coefficients[e],
                controller,
                scratch,
                accelerations,
            )
            for i in range(num_drones):
                saturate(accelerations[i], controller.max_acceleration)
        move(positions, velocities, accelerations, rules.tick)
        slot = games.ticks[e] % trails.shape[0]
        extend_trails(positions, teams, slot, trails, boards)
        games.ticks[e] += 1
        if not rules.capture_enabled:
            continue
        if not find_captured(trails[slot], teams, boards.fields, rules.capture_threshold, peaks, captured):
            continue
        for i in range(num_drones):
            if captured[i]:
                loser = teams[i]
                winner = 1 - loser
                teams[i] = winner
                hand_over_trail(trails, i, loser, winner, boards)
                memory[:, :, i] = 0.0
                memory_weight[i] = 0.0
                games.captures[e, winner] += 1
                if games.ticks[e] - games.capture_ticks[e, i] <= rules.ticks_per_second:
                    games.recaptures[e, winner] += 1
                games.capture_ticks[e, i] = games.ticks[e]
        add_up(boards)


@entry_point
def advance_games(
    games: Games,
    rows: NDArray[np.int64],
    ticks: NDArray[np.int64],
    rules: RuleParameters,
    controller: ErgodicParameters,
) -> None:
    """Advance the games `rows`, each by its own number of ticks (indexed by game)."""
    scratch = make_scratch(games.teams.shape[1], controller)
    for row in rows:
        advance_game(games, row, ticks[row], rules, controller, scratch)
