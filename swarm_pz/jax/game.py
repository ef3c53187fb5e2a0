"""The default game as pure functions, for one game: `jax.vmap` over games, `jax.lax.scan` over steps.

The rules and equations are those of `swarm_pz.kernels`; tests compare the states at every tick. All numbers are float32
or integers. Two things differ, for accelerators. Drones are places with a mask, so that games of any size have the same
shapes. Capture fields are computed from occupancies at every tick, as differences of sums over squares, since dense
images are faster there than scattered updates.
"""

from __future__ import annotations

from typing import Any

import jax
import numpy as np
from jax import lax
from jax import numpy as jnp

from swarm_pz.config import (
    AGENTS,
    BLUE,
    GRID_CELLS,
    RED,
    TICKS_PER_CONTROL_PERIOD,
    TICKS_PER_SECOND,
    GameConfig,
)
from swarm_pz.errors import CommandError
from swarm_pz.jax.controller import solve
from swarm_pz.jax.fields import cells_of, fields_of, limits_of
from swarm_pz.jax.observations import observe
from swarm_pz.jax.params import ABSENT, Array, Params, State

_RULES = GameConfig()
_CELLS, _MODES, _TRAIL = _RULES.command_cells, _RULES.controller.modes, _RULES.trail_ticks
_TICK = np.float32(1 / TICKS_PER_SECOND)
_NEVER = -(10**6)


def reset(key: Array, params: Params) -> tuple[dict[str, Any], State]:
    """Begin a game with drones at rest near corners, distributed as in the simulator."""
    spawn = _RULES.spawn
    drawn = jax.random.uniform(key, (4, params.drones))  # one stream: each takes long to compile
    corners = jnp.where(drawn[:2] < 0.5, spawn.inset, 1.0 - spawn.inset).T
    angle, distance = 2.0 * np.pi * drawn[2], spawn.radius * jnp.sqrt(drawn[3])
    offsets = distance[:, None] * jnp.stack([jnp.cos(angle), jnp.sin(angle)], axis=1)
    return begin(jnp.clip(corners + offsets, 0.0, 1.0), params)


def begin(positions: Array, params: Params) -> tuple[dict[str, Any], State]:
    """Begin a game with drones at rest at some positions (N, 2), red's first."""
    places, (red, blue) = params.drones, params.sizes
    number = jnp.arange(places)
    still = jnp.zeros((places, 2), jnp.float32)
    state = State(
        tick=jnp.int32(0),
        positions=positions.astype(jnp.float32),
        velocities=still,
        accelerations=still,
        teams=jnp.where(number < red, RED, jnp.where(number < red + blue, BLUE, ABSENT)).astype(jnp.int8),
        trails=jnp.full((_TRAIL, places), -1, jnp.int16),
        occupancy=jnp.zeros((2, GRID_CELLS, GRID_CELLS), jnp.int16),
        memory=jnp.zeros((_MODES, _MODES, places), jnp.float32),
        memory_weight=jnp.zeros(places, jnp.float32),
        targets=jnp.full((2, _CELLS, _CELLS), 1.0 / _CELLS**2, jnp.float32),
        capture_ticks=jnp.full(places, _NEVER, jnp.int32),
        captures=jnp.zeros(2, jnp.int32),
        recaptures=jnp.zeros(2, jnp.int32),
    )
    return see(state, params), state


def step(
    key: Array, state: State, actions: dict[str, Array], params: Params
) -> tuple[dict[str, Any], State, dict[str, Array], dict[str, Array], dict[str, Array]]:
    """Hold a command of each side for a command period; a game that ends is followed by a new one, drawn by `key`.

    Raises a CommandError during tracing if a side is missing or a command has another shape.

    Parameters
    ----------
    actions : dict of float array (10, 10)
        Densities of `red_0` and `blue_0` in [0, 1], rows from the bottom up. Other values are clipped, NaN becomes 0,
        and `infos` counts both.

    Returns
    -------
    observations, state
        If the game ends, those of the next game.
    rewards, dones, infos : dict
        As of the parallel environment, and `dones["__all__"]`. `infos` are of the game played, each (2,) for red and
        blue: `size`, `captured`, `lost`, `recaptured`, `outcome` (1 won, -1 lost), `time_s`, `truncated` (time is up:
        a draw), and `clipped`, how many values of its command were not in [0, 1].
    """
    observations, after, rewards, dones, infos = step_once(state, actions, params)
    done, begun = dones["__all__"], reset(key, params)
    observations, after = jax.tree.map(lambda new, old: jnp.where(done, new, old), begun, (observations, after))
    return observations, after, rewards, dones, infos


def step_once(
    state: State, actions: dict[str, Array], params: Params
) -> tuple[dict[str, Any], State, dict[str, Array], dict[str, Array], dict[str, Array]]:
    """As `step`, without a new game after an end; a game that has ended stays as it is, with rewards of 0."""
    commands, clipped = _read(actions)
    goes_on = _goes_on(state, params.limit_ticks)
    before = state
    after = advance(
        state._replace(targets=_targets(commands)),
        jnp.minimum(state.tick + params.step_ticks, params.limit_ticks),
        params,
    )
    sizes = sizes_of(after.teams)
    decided = goes_on & (sizes.min() == 0)
    won = jnp.where(sizes == 0, -1, 1) * decided
    captured, recaptured = after.captures - before.captures, after.recaptures - before.recaptures
    gained = (captured[RED] - captured[BLUE]).astype(jnp.float32)
    worth = _RULES.reward
    red = worth.size_change * gained / (0.5 * params.sizes.sum()) + worth.outcome * won[RED]
    done = after.tick >= params.limit_ticks
    truncated = goes_on & ~decided & done
    done |= sizes.min() == 0
    infos = {
        "size": sizes,
        "captured": captured,
        "lost": captured[::-1],
        "recaptured": recaptured,
        "outcome": won,
        "time_s": jnp.full(2, after.tick / TICKS_PER_SECOND),
        "truncated": jnp.full(2, truncated),
        "clipped": clipped,
    }
    rewards = dict(zip(AGENTS, (red, 0.0 - red), strict=True))
    return see(after, params), after, rewards, dict.fromkeys((*AGENTS, "__all__"), done), infos


def sizes_of(teams: Array) -> Array:
    """Return the numbers (2,) of red and blue drones."""
    return jnp.stack([(teams == team).sum(dtype=jnp.int32) for team in (RED, BLUE)])


def advance(state: State, until: Array, params: Params) -> State:
    """Advance to a tick, or to the one that decides the game."""
    if params.pallas:
        from swarm_pz.jax import kernel

        return kernel.advance(state, until, params.threshold)
    periods = -(-params.step_ticks // TICKS_PER_CONTROL_PERIOD)

    def one_tick(_: int, state: State) -> State:
        return advance_tick(state, until, params.threshold)

    def period(_: int, state: State) -> State:
        # Without the barrier, the compiler repeats the solve for every use of its result.
        state = lax.optimization_barrier(solve(state, _goes_on(state, until)))
        return lax.fori_loop(0, TICKS_PER_CONTROL_PERIOD, one_tick, state)

    return lax.fori_loop(0, periods, period, state)


def _goes_on(state: State, until: Array) -> Array:
    return (state.tick < until) & (sizes_of(state.teams).min() > 0)


def see(state: State, params: Params) -> dict[str, Any]:
    """Return the observations of both sides."""
    fields = fields_of(state.occupancy)
    limits = limits_of(fields, params.threshold)
    return {agent: observe(state, fields, limits, team, params) for team, agent in enumerate(AGENTS)}


def _read(actions: dict[str, Array]) -> tuple[Array, Array]:
    """Return commands (2, A, A) in [0, 1], and the numbers (2,) of values that were outside."""
    if sorted(actions) != sorted(AGENTS):
        raise CommandError(f"actions must have the keys {' and '.join(AGENTS)}, got {', '.join(map(str, actions))}")
    for agent, action in actions.items():
        if jnp.shape(action) != (_CELLS, _CELLS):
            raise CommandError(
                f"the action of {agent} must be a density of shape {(_CELLS, _CELLS)} for one game, got shape "
                f"{jnp.shape(action)}: jax.vmap maps over many games"
            )
    densities = jnp.stack([jnp.asarray(actions[agent], jnp.float32) for agent in AGENTS])
    clipped = jnp.clip(jnp.nan_to_num(densities, nan=0.0), 0.0, 1.0)
    return clipped, (clipped != densities).sum(axis=(1, 2), dtype=jnp.int32)


def _targets(commands: Array) -> Array:
    """Scale commands (2, A, A) so that each sums to 1; an empty one becomes uniform."""
    most = commands.max(axis=(1, 2), keepdims=True)
    scaled = jnp.where(most > 0.0, commands / jnp.where(most > 0.0, most, 1.0), 1.0)
    return scaled / scaled.sum(axis=(1, 2), keepdims=True)


def _count(occupancy: Array, cells: Array, ticks: Array) -> Array:
    """Add ticks (...) to cells of an occupancy, which are numbered row by row; skip cells of -1."""
    place = jnp.where(cells >= 0, cells, occupancy.size)
    return occupancy.reshape(-1).at[place].add(ticks, mode="drop").reshape(occupancy.shape)


def advance_tick(state: State, until: Array, threshold: Array) -> State:
    """Move, leave trails, capture: in the order of `swarm_pz.kernels.game.advance_game`."""
    goes_on = _goes_on(state, until)
    moves = goes_on & (state.teams != ABSENT)
    velocities = state.velocities + jnp.where(moves[:, None], state.accelerations * _TICK, 0.0)
    there = state.positions + jnp.where(moves[:, None], velocities * _TICK, 0.0)
    positions = jnp.clip(there, 0.0, 1.0)
    velocities = jnp.where(there == positions, velocities, 0.0)

    cells, slot, teams = cells_of(positions), state.tick % _TRAIL, state.teams.astype(jnp.int32)
    oldest = state.trails[slot].astype(jnp.int32)
    newest = jnp.where(moves, cells, oldest)
    trails = state.trails.at[slot].set(newest.astype(jnp.int16))
    places, ones = teams * GRID_CELLS**2, jnp.ones(len(teams), jnp.int16)
    changed = jnp.stack([jnp.where(oldest >= 0, places + oldest, -1), jnp.where(newest >= 0, places + newest, -1)])
    occupancy = _count(state.occupancy, changed, jnp.stack([-ones, ones]))
    positions, velocities, cells, trails, occupancy = lax.optimization_barrier(
        (positions, velocities, cells, trails, occupancy)
    )
    tick = state.tick + goes_on

    fields = fields_of(occupancy)
    limits = limits_of(fields, threshold)
    opposing = jnp.clip(1 - teams, 0, 1)
    captured = moves & (fields.reshape(2, -1)[opposing, cells] > limits[opposing])

    def hand_over(carried: tuple[Array, Array]) -> tuple[Array, Array]:
        """Move the trail of one captured drone from its team to the other."""
        left, occupancy = carried
        drone = left.argmax()
        cells = trails[:, drone].astype(jnp.int32)
        places = jnp.stack([teams[drone], 1 - teams[drone]])[:, None] * GRID_CELLS**2 + cells
        changed = _count(occupancy, jnp.where(cells >= 0, places, -1), jnp.array([[-1], [1]], jnp.int16))
        return left.at[drone].set(False), changed

    # A loop over captured drones: a scatter of every trail would cost more, and most ticks have no capture.
    _, occupancy = lax.while_loop(lambda carried: carried[0].any(), hand_over, (captured, occupancy))
    winners = jnp.stack([(captured & (teams == 1 - team)).sum(dtype=jnp.int32) for team in (RED, BLUE)])
    again = captured & (tick - state.capture_ticks <= TICKS_PER_SECOND)
    winners_again = jnp.stack([(again & (teams == 1 - team)).sum(dtype=jnp.int32) for team in (RED, BLUE)])
    return state._replace(
        tick=tick,
        positions=positions,
        velocities=velocities,
        teams=jnp.where(captured, 1 - teams, teams).astype(jnp.int8),
        trails=trails,
        occupancy=occupancy,
        capture_ticks=jnp.where(captured, tick, state.capture_ticks),
        captures=state.captures + winners,
        recaptures=state.recaptures + winners_again,
    )
