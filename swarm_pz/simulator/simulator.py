"""E games of two swarms side by side: states in arrays, rules in `swarm_pz.kernels`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import BLUE, GRID_CELLS, RED, TEAM_NAMES, TICKS_PER_SECOND, GameConfig
from swarm_pz.config.base import check_count
from swarm_pz.config.values import describe
from swarm_pz.errors import CommandError
from swarm_pz.kernels import code_for
from swarm_pz.kernels.capture import FIELD_UNIT, FRAMED_CELLS, RING_RADIUS, capture_fields
from swarm_pz.kernels.controllers.ergodic import ergodic_parameters, room_for
from swarm_pz.kernels.fourier import Aims, make_targets
from swarm_pz.kernels.game import GIVEN, Games, are_decided, take_up
from swarm_pz.kernels.observation import Shown
from swarm_pz.kernels.step import NO_REPORT, Report, step_games
from swarm_pz.simulator.commands import CheckedCommands, coefficient_matrix, make_target
from swarm_pz.simulator.control import Control
from swarm_pz.simulator.openmp import limit_spinning
from swarm_pz.simulator.parameters import boards_of, check_finite, external_rules, rule_parameters, rule_variants
from swarm_pz.simulator.spawn import (
    FASTEST,
    Seed,
    check_scenario,
    check_seed,
    check_team,
    random_start,
    random_velocities,
)

_BOTH = np.array([RED, BLUE])
_NEVER = -(10**9)
_MOST_GAMES = 10**9

_RANGES = {
    "ticks": (0, 10**12),
    "positions": (0, 1),
    "velocities": (-FASTEST, FASTEST),
    "teams": (RED, BLUE),
    "trails": (-1, GRID_CELLS**2 - 1),
    "peaks": (0, GRID_CELLS**2 - 1),
}
"""Ranges of a snapshot's numbers: kernels index arrays by teams, trails and peaks."""


class Simulator:
    """E = `num_games` independent games, advanced together by `threads`.

    With `external_motion` the caller writes positions, velocities and `failed` into `games` before each tick.

    Row e of a batch is bit for bit the same game as that game alone, for any number of games or threads (on one
    kind of processor and one version).

    Examples
    --------
    >>> sim = Simulator(num_games=4)
    >>> sim.reset(seeds=[0, 1, 2, 3])
    >>> sim.command(0, np.ones((4, 10, 10)))
    >>> sim.advance(ticks=30)
    >>> sim.positions.shape, sim.sizes.sum(axis=1).tolist(), sim.time_s.tolist()
    ((4, 20, 2), [20, 20, 20, 20], [1.0, 1.0, 1.0, 1.0])
    """

    def __init__(
        self, config: GameConfig | None = None, num_games: int = 1, threads: int = 1, *, external_motion: bool = False
    ) -> None:
        self.config = config if config is not None else GameConfig()
        self.num_games = check_count(num_games, "num_games", 1, _MOST_GAMES)
        self.threads = min(check_count(threads, "threads", 1, _MOST_GAMES), os.cpu_count() or 1, self.num_games)
        self._pool = self._make_pool()
        self.rules, self._variants = rule_parameters(self.config), rule_variants(self.config)
        if external_motion:
            self.rules, self._variants = external_rules(self.config)
        self.control = Control(self.config)
        """The control systems of the teams."""
        self.controller = ergodic_parameters(self.config)
        check_finite(self.rules)
        check_finite(self.controller)
        self._all_rows = np.arange(num_games)
        self._no_densities = np.zeros((0, 2, self.config.command_cells, self.config.command_cells))
        self._solved = np.full((num_games, 2), _NEVER, np.int64)
        """(E, 2) the tick for which the `solve` of a control system has last chosen accelerations."""
        self.games = self._empty_games()
        """The arrays of all games; see `swarm_pz.kernels.game.Games`."""
        self.shown = Shown(*(getattr(self.games, name) for name in Shown._fields))
        """The arrays of `games` that observations show."""
        games, matrix = self.games, coefficient_matrix(self.config.controller.modes, self.config.command_cells)
        sent, mass = games.sent if self.config.tells_sending else None, self.config.controller.target_mass
        self._aims = Aims(games.targets, games.coefficients, sent, matrix, float(mass), holds=True)
        self._code: dict[Callable[..., None], Callable[..., None]] = {}
        self.reset()

    def _make_pool(self) -> ThreadPoolExecutor | None:
        return ThreadPoolExecutor(self.threads - 1) if self.threads > 1 else None

    def __getstate__(self) -> dict[str, Any]:
        """Leave out machine code and threads, which cannot be copied; a copy starts its own threads unless closed."""
        return self.__dict__ | {"_pool": self._pool is not None, "_code": {}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._pool = self._make_pool() if state["_pool"] else None

    def _empty_games(self) -> Games:
        e, n, cells = self.num_games, self.config.num_drones, self.config.command_cells
        modes, horizon = self.config.controller.modes, self.config.controller.horizon
        variants, board = self._variants, boards_of(self.config).occupancy
        forgets = variants is not None and any(variants.command_forgets + variants.sending_forgets)
        followed = cells if forgets else 0
        grid = GRID_CELLS if self._reconstructs else 0
        return Games(
            ticks=np.zeros(e, np.int64),
            positions=np.zeros((e, n, 2), np.float32),
            velocities=np.zeros((e, n, 2), np.float32),
            accelerations=np.zeros((e, n, 2), np.float32),
            altitudes=np.zeros((e, n), np.float32),
            teams=np.zeros((e, n), np.int8),
            trails=np.zeros((e, self.config.trail_ticks, n), np.int16),
            occupancy=np.zeros((e, 2, FRAMED_CELLS, FRAMED_CELLS), board.dtype),
            peaks=np.zeros((e, 2), np.int64),
            memory=np.zeros((e, modes, modes, room_for(n)), np.float32),
            memory_weight=np.zeros((e, n), np.float32),
            plans=np.zeros((e, n, horizon if self.config.controller.warm_start else 0, 2), np.float32),
            targets=np.zeros((e, 2, cells, cells), np.float64),
            coefficients=np.zeros((e, 2, modes, modes), np.float32),
            capture_ticks=np.zeros((e, n), np.int64),
            captures=np.zeros((e, 2), np.int64),
            recaptures=np.zeros((e, 2), np.int64),
            seeds=np.zeros(e, np.uint64),
            failed=np.zeros((e, n), np.bool_),
            flown_by=np.zeros((e, 2), np.int8),
            followed=np.zeros((e, 2, followed, followed), np.float64),
            sent=np.zeros((e, 2), np.bool_),
            reconstruction=np.zeros((e, 2, grid, grid), np.float32),
            given=np.zeros((e, n if self.control.is_given else 0, 2), np.float32),
            commands=np.zeros((e, 2, self.control.room), np.float64),
            former=np.zeros((e, 2, self.control.room), np.float64),
            commanded=np.zeros((e, 2), np.int64),
        )

    # --- what happens -------------------------------------------------------------------------

    def reset(
        self,
        seeds: Sequence[Seed] | NDArray[np.integer[Any]] | None = None,
        rows: ArrayLike | None = None,
        scenario: Mapping[str, ArrayLike] | None = None,
        swapped: ArrayLike = False,
        *,
        with_sizes: bool = False,
    ) -> None:
        """Start games afresh, both teams with a uniform target.

        Parameters
        ----------
        seeds : sequence of int or SeedSequence, optional
            One for each of the rows; drawn from the system's entropy if not given.
        rows : sequence of int, optional
            Games to start; all of them if not given.
        scenario : mapping, optional
            Any of `positions` (N, 2) in [0, 1], `velocities` (N, 2) and `teams` (N,), the same for
            all rows, in place of the random start; N as in the configuration.
        swapped : bool or array_like of bool (n,)
            True where the pair `controllers` of the configuration is (blue, red).
        with_sizes : bool
            Whether `swapped` holds for the pair `drones_per_team`, too.

        Raises
        ------
        CommandError
            If seeds, rows, scenario or `swapped` do not fit; no game is changed.
        """
        limit_spinning()
        chosen = self.rows(rows)
        if seeds is None:
            seeds = list(np.random.SeedSequence().spawn(len(chosen)))
        if not hasattr(seeds, "__len__") or len(seeds) != len(chosen):
            raise CommandError(f"seeds must be one for each of the {len(chosen)} games, got {seeds!r}")
        generators = [np.random.default_rng(check_seed(seed)) for seed in seeds]
        start = check_scenario(scenario or {}, self.config)
        flown_by = self._flown_by(swapped, len(chosen))
        cells = self.config.command_cells
        uniform, coefficients = make_target(np.ones((cells, cells)), self.config.controller.modes)
        games = self.games
        for array in games:
            array[chosen] = 0
        games.trails[chosen] = -1
        self._solved[chosen] = _NEVER
        games.capture_ticks[chosen] = _NEVER
        games.flown_by[chosen] = flown_by
        games.targets[chosen] = uniform
        games.coefficients[chosen] = coefficients
        if games.followed.size:
            games.followed[chosen] = uniform
        turned = np.broadcast_to(np.asarray(swapped) & with_sizes, len(chosen)).tolist()
        sizes, other = self.config.drones_per_team, self.config
        if with_sizes and isinstance(sizes, tuple):
            other = other.replace(drones_per_team=sizes[::-1])
        for row, generator, is_turned in zip(chosen, generators, turned, strict=True):
            config = other if is_turned else self.config
            games.teams[row, config.team_sizes[RED] :] = 1
            games.positions[row], games.altitudes[row] = random_start(config, generator)
            games.seeds[row] = generator.integers(2**64, dtype=np.uint64)
            if config.spawn.speed > 0.0:
                games.velocities[row] = random_velocities(config, generator)
        for name, values in start.items():
            getattr(games, name)[chosen] = values
        if self.control.is_given:
            games.former[chosen] = games.commands[chosen] = self.control.defaults(flown_by)
            shape = (len(chosen), *self.control.command_shape)
            for team in (RED, BLUE):
                self.command(team, CheckedCommands(games.commands[chosen, team].reshape(shape)), chosen, holds=True)

    def _flown_by(self, swapped: ArrayLike, games: int) -> NDArray[np.int8]:
        """Return the numbers of the controllers of red and blue, (games, 2)."""
        is_swapped = np.asarray(swapped)
        if is_swapped.dtype != np.bool_ or is_swapped.shape not in ((), (games,)):
            raise CommandError(f"swapped must be True or False, once or for each of the {games} games, got {swapped!r}")
        numbers = np.array(self.control.numbers, np.int8)
        return np.where(np.broadcast_to(is_swapped, games)[:, None], numbers[::-1], numbers)

    def command(
        self,
        team: int,
        commands: ArrayLike | Sequence[Any] | CheckedCommands,
        rows: ArrayLike | None = None,
        *,
        holds: bool = False,
    ) -> None:
        """Send a team a command, even an unchanged one; it sets the team's target from the next solve on.

        Parameters
        ----------
        team : int
            0 red, 1 blue.
        commands : array_like (n, ...), sequence (n,) or CheckedCommands
            One for each of the games in `rows`, in a form that the `parse` of the team's system reads.
        rows : sequence of int, optional
            All games if not given.
        holds : bool
            If True, a command that is in force already is held, not sent, as in a step.

        Raises
        ------
        CommandError
            If the team or the commands are not valid; no game is changed.
        """
        check_team(team)
        chosen = self.rows(rows)
        if not isinstance(commands, CheckedCommands):
            name, flown_by = f"{TEAM_NAMES[team]}'s command", self.games.flown_by[chosen, team]
            commands = CheckedCommands(self.control.parse(commands, flown_by, name))
            if self.control.is_given:
                self.control.check_sizes(commands.values, flown_by, self.sizes[chosen, team], name)
        values = self._values_of(commands, (len(chosen),))
        self._aim(values[:, None], chosen, np.array([team]), holds=holds)

    def _values_of(self, commands: CheckedCommands, games: tuple[int, ...]) -> NDArray[np.float64]:
        """Return the values of commands; check shape and type, since kernels could read beyond the end."""
        expected, values = (*games, *self.control.command_shape), np.ascontiguousarray(commands.values)
        if values.dtype != np.float64 or values.shape != expected:
            raise CommandError(
                f"commands must be float64 of shape {expected}, got {values.dtype} of shape {values.shape}"
            )
        return values

    def _aim(
        self,
        commands: NDArray[np.float64],
        rows: NDArray[np.int64],
        teams: NDArray[np.int64],
        *,
        holds: bool,
    ) -> None:
        games = self.games
        if self.control.is_given:
            pictures = self.control.pictures(games, commands, rows, teams)  # first, since only this can fail
            flat, now = commands.reshape(*commands.shape[:2], self.control.room), (games.ticks, games.flown_by)
            take_up(flat, rows, teams, holds, *now, games.commands, games.former, games.commanded)
            commands = pictures
        make_targets(commands, rows, teams, self._aims._replace(holds=holds))

    def advance(self, ticks: ArrayLike = TICKS_PER_SECOND, commands: CheckedCommands | None = None) -> None:
        """Advance every game, or until the tick in which one team owns every drone.

        Parameters
        ----------
        ticks : int or array_like of int (E,)
            Ticks of 1/30 s, for all games or for each one; 0 leaves a game as it is.
        commands : CheckedCommands (E, 2, *control.command_shape), optional
            Of red and blue, for the games that advance. A command that is in force already is held, not sent.

        Raises
        ------
        CommandError
            If a number of ticks is negative or not whole, or the commands are of another shape or type.
        FlightError
            If a control system raises, returns invalid accelerations, or is slower than its games, which stop there.
        """
        amounts = np.asarray(ticks)
        shape_fits = amounts.shape in ((), (self.num_games,))
        if not np.issubdtype(amounts.dtype, np.integer) or not shape_fits or (amounts < 0).any():
            raise CommandError(f"ticks must be whole and not negative, one number or one a game, got {ticks!r}")
        per_game = np.empty(self.num_games, np.int64)
        per_game[:] = amounts
        rows = np.flatnonzero((per_game > 0) & ~self.decided)
        values = None if commands is None else self._values_of(commands, (self.num_games, 2))

        def work(part: NDArray[np.int64]) -> None:
            if values is not None and self.control.is_given:
                self._aim(values[part], part, _BOTH, holds=True)
            if self.control.solves:
                self._advance_by_periods(part, per_game.copy())
            else:
                self._step(part, per_game, None if self.control.is_given else values)

        self.for_rows(rows, work)

    def step(self, ticks: NDArray[np.int64], commands: CheckedCommands | None, report: Report) -> None:
        """Advance the running games by ticks (E,) with kernels alone; see `step_games` for the report."""
        values = None if commands is None else self._values_of(commands, (self.num_games, 2))
        self.for_rows(self._all_rows, lambda part: self._step(part, ticks, values, report))

    def _step(
        self,
        rows: NDArray[np.int64],
        ticks: NDArray[np.int64],
        densities: NDArray[np.float64] | None = None,
        report: Report = NO_REPORT,
    ) -> None:
        new_densities = self._no_densities if densities is None else densities
        parameters = (self.rules, self.controller, self._variants)
        self.call(step_games, self.games, rows, ticks, *parameters, new_densities, self._aims, report)

    def call(self, kernel: Callable[..., None], *arguments: Any) -> None:
        """Call an entry point with arguments of the same types at every call for these games, and arrays in C order."""
        code = self._code.get(kernel)
        if code is None:
            code = self._code[kernel] = code_for(kernel, *arguments)
        code(*arguments)

    def solve(self, team: int, rows: ArrayLike | None = None) -> None:
        """Choose a team's accelerations by the `solve` of its control system, where a control period begins.

        `advance` does so itself; an earlier call may run in a thread, while others read the games. Raises as `advance`.
        """
        chosen = self.rows(rows)
        self._solve(team, chosen[self.games.ticks[chosen] % self.rules.ticks_per_control_period == 0])

    def _solve(self, team: int, rows: NDArray[np.int64]) -> None:
        due = rows[(self.games.flown_by[rows, team] >= GIVEN) & (self._solved[rows, team] != self.games.ticks[rows])]
        if not len(due):
            return
        self.control.fly(self.games, due, team)
        self._solved[due, team] = self.games.ticks[due]

    def _advance_by_periods(self, part: NDArray[np.int64], left: NDArray[np.int64]) -> None:
        """Advance games by the ticks that are left (E,), from one solve to the next; count `left` down."""
        games, period = self.games, self.rules.ticks_per_control_period
        while len(part := part[(left[part] > 0) & ~self._are_decided(part)]):
            phase = games.ticks[part] % period
            due = part[phase == 0]
            for team in (RED, BLUE):
                self._solve(team, due)
            ticks = np.zeros_like(left)
            ticks[part] = np.minimum(left[part], period - phase)
            self._step(part, ticks)
            left[part] -= ticks[part]

    def _are_decided(self, rows: NDArray[np.int64] | slice) -> NDArray[np.bool_]:
        teams = self.games.teams[rows]
        if not self.config.capture.enabled:
            return np.zeros(len(teams), np.bool_)
        return are_decided(teams)

    def for_rows(self, rows: NDArray[np.int64], work: Callable[[NDArray[np.int64]], None]) -> None:
        """Call `work` for parts of the rows in this simulator's threads; raise the first failing part's exception."""
        if self._pool is None or len(rows) < 2:
            if len(rows):
                work(rows)
            return
        # Games share no state. One part for each thread, this one included, since every hand-over costs time.
        parts = range(min(self.threads, len(rows)))
        own, *others = [np.ascontiguousarray(rows[first :: self.threads]) for first in parts]
        waiting = [self._pool.submit(work, part) for part in others]
        try:
            work(own)
        finally:
            wait(waiting)  # no thread may change games once the caller has an exception
        for done in waiting:
            done.result()

    def snapshot(self, rows: ArrayLike | None = None) -> Games:
        """Copy games mid-flight; `restore` continues them bit for bit."""
        chosen = self.rows(rows)
        copies: list[Any] = [array[chosen] for array in self.games]
        return Games(*copies)

    def restore(self, snapshot: Games, rows: ArrayLike | None = None) -> None:
        """Put copied games back, into these rows or any others.

        Parameters
        ----------
        snapshot : Games
            From a simulator of the same configuration; a single game fills all rows.
        rows : sequence of int, optional
            Rows to overwrite; all if not given.

        Raises
        ------
        CommandError
            If the snapshot does not fit; no game is changed.
        """
        chosen = self.rows(rows)
        if not isinstance(snapshot, Games):
            raise CommandError(f"snapshot must be what Simulator.snapshot returned, got {describe(snapshot)}")
        arrays: list[tuple[str, NDArray[Any], NDArray[Any]]] = list(
            zip(Games._fields, self.games, snapshot, strict=True)
        )
        for name, array, copied in arrays:
            if copied.shape[1:] != array.shape[1:] or len(copied) not in (1, len(chosen)):
                raise CommandError(
                    f"snapshot must hold 1 or {len(chosen)} games with {name} of shape {array.shape[1:]}, "
                    f"got {len(copied)} of shape {copied.shape[1:]}"
                )
            if copied.dtype != array.dtype:
                raise CommandError(f"snapshot's {name} must be {array.dtype}, got {copied.dtype}: they are no game's")
            low, high = _RANGES.get(name, (0, 0))
            if high and copied.size and not low <= copied.min() <= copied.max() <= high:  # NaN does not fit, either
                raise CommandError(f"snapshot's {name} must be in [{low}, {high}]: they are no game's")
        if not set(snapshot.flown_by.flat) <= set(self.control.numbers):
            raise CommandError(f"snapshot's flown_by must be of {self.control.numbers}, as this configuration has it")
        places = slice(None) if rows is None else chosen  # a slice copies faster, which makes up for the checks
        for _, array, copied in arrays:
            array[places] = copied
        self._solved[chosen] = _NEVER

    def close(self) -> None:
        """End the threads; the games stay readable."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    # --- what can be seen -----------------------------------------------------------------------

    @property
    def positions(self) -> NDArray[np.float32]:
        """(E, N, 2) positions x, y in map widths; read-only view."""
        return _read_only(self.games.positions)

    @property
    def velocities(self) -> NDArray[np.float32]:
        """(E, N, 2) velocities; drones move at `dynamics.speed_factor` times them; read-only view."""
        return _read_only(self.games.velocities)

    @property
    def speeds(self) -> NDArray[np.float32]:
        """(E, N, 2) how drones move, in map widths per second."""
        return self.games.velocities * np.float32(self.config.dynamics.speed_factor)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """(E, N) drones that have failed and not returned to work; read-only view."""
        return _read_only(self.games.failed)

    def controller_of(self, row: int, team: int) -> str:
        """Return the name of the control system that flies a team of a game."""
        return self.control.systems[int(self.games.flown_by[row, team])].name

    @property
    def altitudes(self) -> NDArray[np.float32]:
        """(E, N) altitudes in (0, 1], distinct within a game; read-only view."""
        return _read_only(self.games.altitudes)

    @property
    def teams(self) -> NDArray[np.int8]:
        """(E, N) team of each drone, 0 red or 1 blue; read-only view."""
        return _read_only(self.games.teams)

    @property
    def sizes(self) -> NDArray[np.int64]:
        """(E, 2) drones of red and blue."""
        sizes = np.empty((self.num_games, 2), np.int64)
        sizes[:, BLUE] = self.games.teams.sum(axis=1, dtype=np.int64)
        sizes[:, RED] = self.config.num_drones - sizes[:, BLUE]
        return sizes

    @property
    def occupancy(self) -> NDArray[np.int64]:
        """(E, 2, G, G) ticks that each team's trails count in each cell."""
        return self.games.occupancy[:, :, RING_RADIUS:-RING_RADIUS, RING_RADIUS:-RING_RADIUS].astype(np.int64)

    @property
    def capture_field(self) -> NDArray[np.float64]:
        """(E, 2, G, G) each team's occupancy, or rescaled density, averaged over the ring around each cell."""
        if self._reconstructs:
            return self.games.reconstruction.astype(np.float64)
        return np.asarray(capture_fields(self.games.occupancy) / FIELD_UNIT)

    @property
    def captures_here(self) -> NDArray[np.bool_]:
        """(E, 2, G, G) where each team would capture an opposing drone."""
        if self._reconstructs:
            return np.asarray(self.games.reconstruction >= np.float32(self.config.capture.threshold))
        fields = capture_fields(self.games.occupancy)
        return np.asarray(fields > self.config.capture.threshold * fields.max(axis=(2, 3), keepdims=True))

    @property
    def _reconstructs(self) -> bool:
        return self.config.capture.field == "reconstruction"

    @property
    def targets(self) -> NDArray[np.float64]:
        """(E, 2, A, A) each team's command in force, normalised to sum to 1; read-only view."""
        return _read_only(self.games.targets)

    @property
    def target_coefficients(self) -> NDArray[np.float32]:
        """(E, 2, K, K) Fourier coefficients phi_k of the targets, as densities: phi_0 = 1."""
        coefficients = self.games.coefficients
        return coefficients / coefficients[:, :, :1, :1]

    @property
    def time_s(self) -> NDArray[np.float64]:
        """(E,) seconds since the start."""
        return np.asarray(self.games.ticks / TICKS_PER_SECOND)

    @property
    def decided(self) -> NDArray[np.bool_]:
        """(E,) whether one team owns every drone; never without captures."""
        return self._are_decided(slice(None))

    def rows(self, rows: ArrayLike | None) -> NDArray[np.int64]:
        """Return numbers of games as an array; all of them for None.

        Raises
        ------
        CommandError
            If they are not whole numbers in [0, E).
        """
        if rows is None:
            return np.arange(self.num_games)
        try:
            chosen = np.asarray(rows).reshape(-1)
        except ValueError as error:  # lists of different lengths
            raise CommandError(f"rows must be whole numbers in [0, {self.num_games}), got {rows!r}") from error
        whole = np.issubdtype(chosen.dtype, np.integer) or chosen.size == 0
        if not whole or (chosen.size and (chosen.min() < 0 or chosen.max() >= self.num_games)):
            raise CommandError(f"rows must be whole numbers in [0, {self.num_games}), got {rows!r}")
        return chosen.astype(np.int64)


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    view = array.view()
    view.flags.writeable = False
    return view
