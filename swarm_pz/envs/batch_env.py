"""The Markov decision process over E games, which every environment wraps: observations, rewards and ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import (
    BLUE,
    RED,
    TEAM_NAMES,
    TICKS_PER_CONTROL_PERIOD,
    TICKS_PER_SECOND,
    GameConfig,
    ObservationConfig,
)
from swarm_pz.config.base import check_count
from swarm_pz.config.values import check_densities
from swarm_pz.errors import CommandError, GameOverError, PolicyError
from swarm_pz.kernels.observation import count_infos
from swarm_pz.kernels.step import Report
from swarm_pz.policy import Player, Policy, answers_of, name_of
from swarm_pz.simulator import CheckedCommands, Simulator
from swarm_pz.simulator.spawn import Seed, check_team
from swarm_pz.spaces.observation import Observations, observe

_LONGEST = 10**12
"""Largest `max_cycles`."""


class StepResult(NamedTuple):
    """The result of a step of all games; rows of games that had ended before are zero or False."""

    rewards: NDArray[np.float64]
    """(E, 2) of red and blue, which sum to zero; in wrappers (E,) of learners, or (E, N) of drones."""
    terminated: NDArray[np.bool_]
    """(E,) one team owns every drone."""
    truncated: NDArray[np.bool_]
    """(E,) time is up: a draw."""
    captured: NDArray[np.int64]
    """(E, 2) drones that each team took in this step, and the other lost."""
    recaptured: NDArray[np.int64]
    """(E, 2) those of them that the team had lost within the last second."""


class BatchEnv:
    """E games, stepped together by commands of both teams.

    `max_cycles` are the steps until a draw; they follow from the time limit if not given. `running` (E,) are the games
    that have begun and not ended.
    """

    def __init__(
        self, config: GameConfig | None = None, num_games: int = 1, *, threads: int = 1, max_cycles: int | None = None
    ) -> None:
        self.config = config if config is not None else GameConfig()
        self.simulator = Simulator(self.config, num_games, threads)
        self.num_games = self.simulator.num_games
        self.running = np.zeros(self.num_games, np.bool_)
        self._limit_ticks, self._step_ticks = self.config.limit_ticks, self.config.step_ticks
        self._ticks = np.full(self.num_games, self._step_ticks)
        reward = self.config.reward
        self._weights = float(reward.size_change), self.config.num_drones / 2, float(reward.outcome)
        if max_cycles is not None:
            self.max_cycles = max_cycles

    @property
    def max_cycles(self) -> int:
        """Steps until a draw; assigning it replaces the time limit."""
        return -(-self._limit_ticks // self._step_ticks)

    @max_cycles.setter
    def max_cycles(self, cycles: int) -> None:
        self._limit_ticks = check_count(cycles, "max_cycles", 1, _LONGEST) * self._step_ticks

    @property
    def limit_s(self) -> float:
        """Seconds until a draw."""
        return self._limit_ticks / TICKS_PER_SECOND

    @property
    def command_shape(self) -> tuple[int, ...]:
        """The shape of a checked command, the same for all control systems of these games."""
        return self.simulator.control.command_shape

    def pack(self, commands: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return commands (n, ...) of one control system in `command_shape`."""
        return self.simulator.control.pack(commands)

    def reset(
        self,
        seeds: Sequence[Seed] | NDArray[np.integer[Any]] | None = None,
        rows: ArrayLike | None = None,
        scenario: Mapping[str, ArrayLike] | None = None,
        swapped: ArrayLike = False,
        *,
        with_sizes: bool = False,
    ) -> None:
        """Start games afresh; arguments as of `Simulator.reset`."""
        self.simulator.reset(seeds, rows, scenario, swapped, with_sizes=with_sizes)
        self.running[self.simulator.rows(rows)] = True

    def step(
        self, commands: ArrayLike | CheckedCommands, after_control_period: Callable[[], None] | None = None
    ) -> StepResult:
        """Hold one command of each team for a command period, or until the game ends.

        Commands are densities (E, 2, A, A) of red and blue in [0, 1], or checked ones; those of ended games are
        ignored. With other control systems they are a pair of sequences (E,), red's and blue's, of commands that the
        system's `parse` reads. `after_control_period` is called after every control period, for animations.

        Raises
        ------
        CommandError
            If a command is not valid; no game is changed.
        GameOverError
            If no game is running.
        """
        checked = commands if isinstance(commands, CheckedCommands) else CheckedCommands(self._check(commands))
        if not np.count_nonzero(self.running):  # quicker than any
            raise GameOverError("no game is running: call reset before step")
        simulator, games = self.simulator, self.simulator.games
        result = StepResult(
            rewards=np.zeros((self.num_games, 2)),
            terminated=np.zeros(self.num_games, np.bool_),
            truncated=np.zeros(self.num_games, np.bool_),
            captured=games.captures.copy(),
            recaptured=games.recaptures.copy(),
        )
        report = Report(self._limit_ticks, *self._weights, self.running, *result)  # type: ignore[arg-type]  # in order
        if after_control_period is None and not simulator.control.is_given:
            simulator.step(self._ticks, checked, report)
            return result
        running = self.running.copy()
        waiting: CheckedCommands | None = checked
        left = np.maximum(np.minimum(self._limit_ticks - games.ticks, self._ticks), 0) * running
        period = TICKS_PER_CONTROL_PERIOD if after_control_period is not None else self.config.step_ticks
        while left.any() and not simulator.decided[running].all():
            ticks = np.minimum(left, period)
            simulator.advance(ticks, waiting)
            left, waiting = left - ticks, None
            if after_control_period is not None:
                after_control_period()
        simulator.step(np.zeros_like(left), None, report)
        return result

    def _check(self, commands: Any) -> NDArray[np.float64]:
        control, cells = self.simulator.control, self.config.command_cells
        if not control.is_given:
            return check_densities(commands, (self.num_games, 2, cells, cells), "commands")
        if not isinstance(commands, (tuple, list)) or len(commands) != 2:
            raise CommandError(f"commands must be a pair: red's and blue's of each game, got {commands!r}")
        flown_by, sizes, running = self.simulator.games.flown_by, self.simulator.sizes, self.running
        sides = []
        for team in (RED, BLUE):
            name = f"{TEAM_NAMES[team]}'s commands"
            sides.append(control.parse(commands[team], flown_by[:, team], name))
            control.check_sizes(sides[team][running], flown_by[running, team], sizes[running, team], name)
        return np.stack(sides, axis=1)

    def observe(self, observation: ObservationConfig, teams: ArrayLike, rows: ArrayLike | None = None) -> Observations:
        """Return fresh observations of n games (by default all), from the side of one team or one per game (n,)."""
        chosen = self.simulator.rows(rows)
        array = np.asarray(teams)
        whole = np.issubdtype(array.dtype, np.integer) or not array.size
        if not whole or array.shape not in ((), chosen.shape) or not ((array == RED) | (array == BLUE)).all():
            raise CommandError(f"teams must be 0 (red) or 1 (blue), one or one a game, got {teams!r}")
        sides = np.empty(len(chosen), np.int64)
        sides[:] = array
        return self.see(observation, sides, chosen)

    def see(self, observation: ObservationConfig, sides: NDArray[np.int64], rows: NDArray[np.int64]) -> Observations:
        """Return observations as `observe` does, for sides (n,) and rows (n,) that need no check."""
        return observe(self.simulator, observation, sides, rows, self._limit_ticks)

    def ask(
        self,
        policy: Player,
        teams: NDArray[np.int64],
        rows: NDArray[np.int64],
        clock: AbstractContextManager[None] | None = None,
    ) -> NDArray[np.float64]:
        """Return checked commands (n, *command_shape) of a policy, which leads a team (n,) in each of the rows (n,).

        `clock` is entered while the policy computes them, and at no other time.

        Raises
        ------
        PolicyError
            If it returns other than n commands of its kind, or that kind cannot fly its team.
        FlightError
            If the control system that flies its team fails to convert its densities.
        """
        if not len(rows):
            return np.zeros((0, *self.command_shape))
        answers = clock if clock is not None else nullcontext()
        plan = getattr(policy, "plan", None)  # isinstance with a Protocol is slower than most answers
        if plan is not None:
            with answers:
                answer = plan(self.simulator, teams, rows)
        else:
            seeing = cast("Policy", policy)
            observations = self.see(seeing.observation, teams, rows)
            with answers:
                answer = seeing.act(observations, rows)
        try:
            control, games, name = self.simulator.control, self.simulator.games, f"policy {name_of(policy)}'s answer"
            commands = control.read(answer, games, rows, teams, answers_of(policy), name)
            if control.is_given:
                control.check_sizes(commands, games.flown_by[rows, teams], self.simulator.sizes[rows, teams], name)
            return commands
        except CommandError as error:
            raise PolicyError(str(error)) from error

    def outcome(self, row: int, team: int) -> str | None:
        """Return "win", "loss" or "draw" of a game for a team, None while it runs."""
        check_team(team)
        chosen = self.simulator.rows(row)
        if len(chosen) != 1:
            raise CommandError(f"row must be the number of one game, got {row!r}")
        if self.running[chosen[0]]:
            return None
        sizes = self.simulator.sizes[chosen[0]]
        if self.config.capture.enabled and sizes.min() == 0:
            return "win" if sizes[team] else "loss"
        return "draw"

    def infos(
        self, result: StepResult | None, teams: NDArray[np.int64], rows: NDArray[np.int64]
    ) -> dict[str, NDArray[Any]]:
        """Return the infos of one team (n,) in each of the rows (n,): numbers, always by the same names.

        `result` is the last step's, None before the first. The names are size, captured, lost, recaptured, time_s, and
        outcome: 1 for a win, -1 for a loss, else 0.
        """
        games, counts, times = self.simulator.games, np.empty((5, len(rows)), np.int64), np.empty(len(rows))
        taken = (np.zeros((self.num_games, 2), np.int64),) * 2 if result is None else result[-2:]
        count_infos(games.ticks, games.teams, *taken, rows, teams, self.config.capture.enabled, counts, times)
        size, captured, lost, recaptured, outcome = counts
        infos = {"size": size, "captured": captured, "lost": lost, "recaptured": recaptured, "time_s": times}
        return infos | {"outcome": outcome}

    def close(self) -> None:
        """End the simulator's threads."""
        self.simulator.close()


def by_game(infos: dict[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """Turn infos of several games into a dict of plain numbers for each."""
    columns = [values.tolist() for values in infos.values()]
    return [dict(zip(infos, values)) for values in zip(*columns)]  # noqa: B905  # strict takes as long again
