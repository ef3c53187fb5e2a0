"""A command period of a game as one kernel of Pallas, for GPUs: the game stays on chip.

Each program plays one game. Drones are lanes, padded with absent drones to a power of two, so that nothing needs a
mask. Small arrays stay in registers; caches hold trails, occupancy and memory. A whole capture field is computed only
if it may capture a drone, as in `swarm_pz.kernels.capture`.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import lax
from jax import numpy as jnp
from jax.experimental import pallas as pl
from jax.experimental.pallas import triton

from swarm_pz.config import BLUE, GRID_CELLS, RED, TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND, GameConfig
from swarm_pz.jax.controller import CONTROLLER, HORIZON, MODES, circle, wanted_of
from swarm_pz.jax.fields import WEIGHTS, along, limit_of
from swarm_pz.jax.params import ABSENT, Array, State
from swarm_pz.kernels.capture import FRAMED_CELLS, RING_RADIUS

_ROWS = 16
"""Modes along an axis, padded to a power of two."""
_TRAIL = GameConfig().trail_ticks
_TICK = np.float32(1 / TICKS_PER_SECOND)
_BOARD = FRAMED_CELLS**2
_MIDDLE = RING_RADIUS * FRAMED_CELLS + RING_RADIUS
_RING = [
    row * FRAMED_CELLS + column
    for row in range(2 * RING_RADIUS + 1)
    for column in range(2 * RING_RADIUS + 1)
    if max(abs(row - RING_RADIUS), abs(column - RING_RADIUS)) == RING_RADIUS
]
"""Offsets of a ring's cells from its first corner."""
_SECONDS = float(CONTROLLER.times[1])


class _Game(NamedTuple):
    """What changes with every tick: scalars, and vectors (P,) of drones."""

    tick: Array
    x: Array
    y: Array
    speed_x: Array
    speed_y: Array
    push_x: Array
    push_y: Array
    weight: Array
    teams: Array
    capture_ticks: Array
    captures: tuple[Array, Array]
    recaptures: tuple[Array, Array]
    peaks: tuple[Array, Array]
    """Cells where the fields were highest when last computed as a whole."""


def advance(state: State, until: Array, threshold: Array) -> State:
    """Advance one game to a tick, or to the one that decides it; as `swarm_pz.jax.game.advance`."""
    places = len(state.teams)
    lanes = max(32, 1 << (places + 1).bit_length())  # two more than drones: for the highest cells
    more, frame = lanes - places, (RING_RADIUS, RING_RADIUS)

    def widen(array: Array, value: int = 0) -> Array:
        return jnp.pad(array, [(0, 0)] * (array.ndim - 1) + [(0, more)], constant_values=value)

    drones = [state.positions.T, state.velocities.T, state.accelerations.T, state.memory_weight[None]]
    numbers = [state.tick, until, lax.bitcast_convert_type(threshold, jnp.int32), jnp.int32(0)]
    changing = (
        jnp.concatenate([jnp.stack(numbers), state.captures, state.recaptures]),
        jnp.pad(widen(jnp.concatenate(drones)), ((0, 1), (0, 0))),
        jnp.stack([widen(state.teams.astype(jnp.int32), ABSENT), widen(state.capture_ticks)]),
        widen(state.trails, -1),
        jnp.pad(state.occupancy.astype(jnp.int32), ((0, 0), frame, frame)).reshape(-1),
        jnp.pad(widen(state.memory), ((0, 0), (0, _ROWS - MODES), (0, 0))),
    )
    fill = [(0, 0), (0, _ROWS - MODES)]
    wanted = jnp.pad(wanted_of(state.targets), [(0, 0), *fill])
    fixed = wanted, np.pad(CONTROLLER.spectrum, fill), WEIGHTS.reshape(-1)
    interpret = jax.default_backend() == "cpu"
    play = pl.pallas_call(
        partial(_play, barrier=(lambda: None) if interpret else triton.debug_barrier),
        out_shape=[jax.ShapeDtypeStruct(array.shape, array.dtype) for array in changing],
        input_output_aliases={len(fixed) + i: i for i in range(len(changing))},
        compiler_params=triton.CompilerParams(num_warps=lanes // 16, num_stages=1),
        interpret=interpret,
    )
    numbers, floats, whole, trails, occupancy, memory = play(*fixed, *changing)
    boards = occupancy.reshape(2, FRAMED_CELLS, FRAMED_CELLS)[:, RING_RADIUS:-RING_RADIUS, RING_RADIUS:-RING_RADIUS]
    return state._replace(
        tick=numbers[0],
        positions=floats[:2, :places].T,
        velocities=floats[2:4, :places].T,
        accelerations=floats[4:6, :places].T,
        teams=whole[0, :places].astype(jnp.int8),
        trails=trails[:, :places],
        occupancy=boards.astype(jnp.int16),
        memory=memory[:, :MODES, :places],
        memory_weight=floats[6, :places],
        capture_ticks=whole[1, :places],
        captures=numbers[4:6],
        recaptures=numbers[6:8],
    )


def _play(*refs: Any, barrier: Any) -> None:
    """Play until the end of the period; the last six references are the arrays of `changing` in `advance`."""
    wanted, spectrum, weights, *_, numbers, floats, whole, trails, occupancy, memory = refs
    until, threshold = numbers[1], lax.bitcast_convert_type(numbers[2], jnp.uint32)
    lanes = trails.shape[1]
    lane = lax.iota(jnp.int32, lanes)

    def count(places: Array, ticks: Array) -> None:
        """Add ticks to places of the occupancy."""
        jax.ref.addupdate(occupancy, places, ticks)
        barrier()

    def value_at(team: Array, cells: Array) -> Array:
        """Return a team's field at cells."""
        first = team * _BOARD + _corner(cells)
        total = occupancy[first + _RING[0]]
        for step in _RING[1:]:
            total += occupancy[first + step]
        return weights[cells] * total

    def highest(team: int) -> tuple[Array, Array]:
        """Return the largest value of a team's field, and its cell."""
        size = 8 * lanes
        several = lax.iota(jnp.int32, size)

        def look(i: Array, best: tuple[Array, Array]) -> tuple[Array, Array]:
            cells = jnp.minimum(i * size + several, GRID_CELLS**2 - 1)
            values = value_at(jnp.int32(team), cells)
            return jnp.maximum(best[0], values), jnp.where(values > best[0], cells, best[1])

        values, cells = lax.fori_loop(
            0, -(-(GRID_CELLS**2) // size), look, (jnp.full(size, -1), jnp.zeros(size, jnp.int32))
        )
        most = values.max()
        return most, jnp.where(values == most, cells, -1).max()

    def hand_over(captured: Array, teams: Array) -> None:
        """Move the trails of captured drones from their team to the other."""
        times = lax.iota(jnp.int32, 1 << (_TRAIL - 1).bit_length())
        barrier()

        def one(left: Array) -> Array:
            drone = jnp.where(left, lane, lanes).min()
            loser = jnp.where(lane == drone, teams, 0).sum()
            cells = trails[jnp.minimum(times, _TRAIL - 1), drone].astype(jnp.int32)
            is_past = (times < _TRAIL) & (cells >= 0)
            ticks = jnp.where(is_past, 1, 0)
            jax.ref.addupdate(occupancy, _place(loser, cells, is_past), -ticks)
            jax.ref.addupdate(occupancy, _place(1 - loser, cells, is_past), ticks)
            return left & (lane != drone)

        lax.while_loop(lambda left: _any(left), one, captured)
        barrier()

    def tick(game: _Game) -> _Game:
        """Move, leave trails, capture: in the order of `swarm_pz.kernels.game.advance_game`."""
        teams, moves = game.teams, game.teams != ABSENT
        x, speed_x = _move(game.x, game.speed_x, game.push_x)
        y, speed_y = _move(game.y, game.speed_y, game.push_y)
        cells, slot = along(y) * GRID_CELLS + along(x), lax.rem(game.tick, _TRAIL)
        oldest = trails[slot].astype(jnp.int32)
        barrier()  # until every warp has read this slot, and the occupancy of the tick before
        trails[slot] = jnp.where(moves, cells, -1).astype(jnp.int16)
        count(_place(teams, oldest, oldest >= 0), jnp.where(oldest >= 0, -1, 0))
        count(_place(teams, cells, moves), jnp.where(moves, 1, 0))
        now = game.tick + 1

        # The maximum is at least the value at the last peak: most tests fail already against that value.
        tested, board = cells, jnp.where(moves, 1 - teams, RED)
        for team, peak in enumerate(game.peaks):
            is_peak = lane == lanes - 2 + team
            tested, board = jnp.where(is_peak, peak, tested), jnp.where(is_peak, team, board)
        values, captured, peaks = value_at(board, tested), moves & False, []
        for team, peak in enumerate(game.peaks):
            reached = jnp.where(lane == lanes - 2 + team, values, 0).sum()
            theirs = moves & (teams == 1 - team)
            may = theirs & (values > limit_of(reached, threshold))
            most, peak = lax.cond(_any(may), lambda team=team: highest(team), lambda r=reached, p=peak: (r, p))
            captured |= theirs & (values > limit_of(most, threshold))
            peaks.append(peak)
        again = captured & (now - game.capture_ticks <= TICKS_PER_SECOND)
        lax.cond(_any(captured), lambda: hand_over(captured, teams), lambda: None)

        def gained(drones: Array, before: tuple[Array, Array]) -> Any:
            return tuple(before[team] + _count(drones & (teams == 1 - team)) for team in (RED, BLUE))

        return game._replace(
            tick=now,
            x=x,
            y=y,
            speed_x=speed_x,
            speed_y=speed_y,
            teams=jnp.where(captured, 1 - teams, teams),
            capture_ticks=jnp.where(captured, now, game.capture_ticks),
            captures=gained(captured, game.captures),
            recaptures=gained(again, game.recaptures),
            peaks=tuple(peaks),
        )

    def goes_on(game: _Game) -> Array:
        return (game.tick < until) & _any(game.teams == RED) & _any(game.teams == BLUE)

    def solve(game: _Game) -> _Game:
        """Choose accelerations; see `swarm_pz.jax.controller.solve`.

        Tables of y are (L, P), of all modes; those of x are lists, a row (1, P) for each mode.
        """
        barrier()
        decay = jnp.where(game.capture_ticks > game.tick - TICKS_PER_CONTROL_PERIOD, 0.0, CONTROLLER.decay)
        weight = decay * game.weight + 1.0
        is_blue = game.teams == BLUE
        red, blue = (jnp.maximum(_count(game.teams == team), 1).astype(jnp.float32) for team in (RED, BLUE))
        share = jnp.where(game.teams == ABSENT, 0.0, 1.0 / (jnp.where(is_blue, blue, red) * (weight + HORIZON)))
        mix = jnp.where(game.teams[:, None] == game.teams[None], share[:, None], 0.0)
        mix_high, mix_low = _split(mix)
        mode = lax.broadcasted_iota(jnp.float32, (_ROWS, lanes), 0)
        x, y = circle(game.x[None]), circle(mode * game.y[None])
        # Angles grow by the same amount from each point to the next.
        by_x, by_y = circle(_SECONDS * game.speed_x[None]), circle(mode * (_SECONDS * game.speed_y[None]))
        sums = []
        for k, cos_x in enumerate(_modes_of(x)[0]):
            whole = decay[None] * memory[k] + cos_x * y[0]
            memory[k] = whole
            sums.append(whole)

        def expect(_: Array, carried: Any) -> Any:
            x, y, sums = carried
            x, y = _turn(x, by_x), _turn(y, by_y)
            return x, y, [whole + cos_x * y[0] for whole, cos_x in zip(sums, _modes_of(x)[0], strict=True)]

        x, y, sums = lax.fori_loop(0, HORIZON, expect, (x, y, sums))
        errors = []
        for k, whole in enumerate(sums):
            high, low = _split(whole)
            mean = jnp.dot(high, mix_high) + (jnp.dot(high, mix_low) + jnp.dot(low, mix_high))
            target = jnp.where(is_blue[None], wanted[BLUE, k][:, None], wanted[RED, k][:, None])
            errors.append(spectrum[k][:, None] * (mean - target))

        def steer(step: Array, carried: Any) -> Any:
            x, y, total_x, total_y, wall_x, wall_y = carried
            time = _SECONDS * (HORIZON - step).astype(jnp.float32)
            before = time - _SECONDS
            cos_x, sin_x = _modes_of(x)
            slope = sum(np.float32(np.pi * k) * sin_x[k] * errors[k] for k in range(1, MODES))
            total_x += before * slope * y[0]
            total_y += before * sum(one * error for one, error in zip(cos_x, errors, strict=True)) * y[1]
            wall_x += before * _wall(game.x + time * game.speed_x)
            wall_y += before * _wall(game.y + time * game.speed_y)
            x, y = _turn(x, (by_x[0], -by_x[1])), _turn(y, (by_y[0], -by_y[1]))
            return x, y, total_x, total_y, wall_x, wall_y

        none, still = jnp.zeros((_ROWS, lanes), jnp.float32), jnp.zeros(lanes, jnp.float32)
        _, _, total_x, total_y, wall_x, wall_y = lax.fori_loop(0, HORIZON - 1, steer, (x, y, none, none, still, still))
        scale = -CONTROLLER.inverse_control_weight * _SECONDS
        push_x = scale * (wall_x - total_x.sum(axis=0))
        push_y = scale * (wall_y - (np.float32(np.pi) * mode * total_y).sum(axis=0))
        size, limit = jnp.sqrt(push_x * push_x + push_y * push_y), CONTROLLER.max_acceleration
        factor = jnp.where(size > limit, limit / jnp.where(size > limit, size, 1.0), 1.0)
        factor = jnp.where(game.teams == ABSENT, 0.0, factor)
        return game._replace(push_x=push_x * factor, push_y=push_y * factor, weight=weight)

    def period(game: _Game) -> _Game:
        last = game.tick + TICKS_PER_CONTROL_PERIOD
        return lax.while_loop(lambda game: goes_on(game) & (game.tick < last), tick, solve(game))

    x, y, speed_x, speed_y, push_x, push_y, weight = (floats[i] for i in range(7))
    game = _Game(
        tick=numbers[0],
        x=x,
        y=y,
        speed_x=speed_x,
        speed_y=speed_y,
        push_x=push_x,
        push_y=push_y,
        weight=weight,
        teams=whole[0],
        capture_ticks=whole[1],
        captures=(numbers[4], numbers[5]),
        recaptures=(numbers[6], numbers[7]),
        peaks=(jnp.int32(0), jnp.int32(0)),
    )
    game = lax.while_loop(goes_on, period, game)
    numbers[0] = game.tick
    for team in (RED, BLUE):
        numbers[4 + team], numbers[6 + team] = game.captures[team], game.recaptures[team]
    for i, values in enumerate(game[1:8]):
        floats[i] = values
    whole[0], whole[1] = game.teams, game.capture_ticks


def _corner(cells: Array) -> Array:
    """Return the first corner of the ring around cells on a framed board."""
    return cells + (FRAMED_CELLS - GRID_CELLS) * lax.div(cells, GRID_CELLS)


def _place(team: Array, cells: Array, is_there: Array) -> Array:
    """Return the indices of cells in the occupancy; for absent ones, that of a corner that stays empty."""
    return jnp.where(is_there, team * _BOARD + _MIDDLE + _corner(cells), 0)


def _move(place: Array, speed: Array, push: Array) -> tuple[Array, Array]:
    speed = speed + push * _TICK
    there = place + speed * _TICK
    kept = jnp.clip(there, 0.0, 1.0)
    return kept, jnp.where(there == kept, speed, 0.0)


def _turn(one: tuple[Array, Array], by: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return cosines and sines of the sums of two angles."""
    return one[0] * by[0] - one[1] * by[1], one[1] * by[0] + one[0] * by[1]


def _wall(place: Array) -> Array:
    margin = CONTROLLER.wall_margin
    beyond = jnp.maximum(place - (1.0 - margin), 0.0) + jnp.minimum(place - margin, 0.0)
    return 2.0 * CONTROLLER.wall_weight * beyond


def _modes_of(one: tuple[Array, Array]) -> tuple[list[Array], list[Array]]:
    """Return cosines and sines of k times an angle, for all modes k."""
    both = [(jnp.ones_like(one[0]), jnp.zeros_like(one[0])), one]
    while len(both) < MODES:
        both.append(_turn(both[-1], one))
    return [cos for cos, _ in both], [sin for _, sin in both]


def _split(x: Array) -> tuple[Array, Array]:
    """Return two parts that add up to x, since tensor cores multiply numbers of 11 bits."""
    high = lax.bitcast_convert_type(lax.bitcast_convert_type(x, jnp.int32) & -(2**13), jnp.float32)
    return high, x - high


def _any(which: Array) -> Array:
    return _count(which) > 0


def _count(which: Array) -> Array:
    return which.astype(jnp.int32).sum()
