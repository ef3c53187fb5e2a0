"""One learner against an opponent in each of E games: what the one-learner faces share.

Who sits where, what the learner sees, what its action means, and the opponents' answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.batch_env import BatchEnv, StepResult
from swarm_pz.config import RED, TEAM_NAMES, GameConfig, ObservationConfig
from swarm_pz.errors import ConfigError, GameOverError
from swarm_pz.observation import Observations, observation_space
from swarm_pz.policy import Player, ask, load, name_of
from swarm_pz.target import check_values, interpolation_matrix

LOG_DENSITY_RANGE = 4.0
"""Natural logarithm of the ratio between a command's value at action 1 and at action 0."""

Opponents = str | Player | Sequence[str | Player]


def command_from_action(actions: NDArray[np.float64], cells: int, *, is_log: bool) -> NDArray[np.float64]:
    """Turn actions into commands: interpolate them, and take the softmax of log-densities.

    Parameters
    ----------
    actions : float64 array (n, a, a)
        Densities in [0, 1], or log-densities in [-1, 1] whose unit is `LOG_DENSITY_RANGE`.
    cells : int
        Cells A a side of a command.
    is_log : bool

    Returns
    -------
    float64 array (n, A, A), in [0, 1]; of log-densities the largest value is 1
    """
    fine = interpolation_matrix(cells, actions.shape[-1])
    values = actions if actions.shape[-1] == cells else fine @ actions @ fine.T
    if not is_log:
        return values
    return np.asarray(np.exp(LOG_DENSITY_RANGE * (values - values.max(axis=(1, 2), keepdims=True))))


@dataclass(frozen=True)
class DuelResult:
    """What a step gave the learners: float64 and bool arrays (E,), and the batch's own result."""

    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    result: StepResult


class _Opponent(NamedTuple):
    name: str
    player: Player


class DuelBatch:
    """E games, each with a learner on one side and an opponent on the other.

    Parameters
    ----------
    config : GameConfig
        `observation` of the learner's side is what the learner sees; opponents say for themselves.
    num_games : int
    opponent : str, Policy or sequence of these
        Dealt to the games in turn.
    side : {"random", "red", "blue"}
        Where the learner sits; drawn anew for every game if random.
    action : {"log_density", "density"}
        A Box(-1, 1) that goes through a softmax, or the density itself.
    action_cells : int, optional
        Cells a side of an action, interpolated to the command's; as many as these if not given.
    threads : int
    max_cycles : int, optional
    """

    def __init__(
        self,
        config: GameConfig,
        num_games: int,
        *,
        opponent: Opponents = "uniform",
        side: Literal["random", "red", "blue"] = "random",
        action: Literal["log_density", "density"] = "log_density",
        action_cells: int | None = None,
        threads: int = 1,
        max_cycles: int | None = None,
    ) -> None:
        if side not in ("random", *TEAM_NAMES):
            raise ConfigError(f"side must be 'random', 'red' or 'blue', got {side!r}")
        if action not in ("log_density", "density"):
            raise ConfigError(f"action must be 'log_density' or 'density', got {action!r}")
        self.config = config
        self.batch = BatchEnv(config, num_games, threads=threads, max_cycles=max_cycles)
        seat = config.observations[RED if side == "random" else TEAM_NAMES.index(side)]
        self.seat: ObservationConfig = seat
        self.observation_space = observation_space(config, seat)
        cells = config.command_cells if action_cells is None else action_cells
        if not isinstance(cells, int) or isinstance(cells, bool) or not 2 <= cells <= config.command_cells:
            raise ConfigError(f"action_cells must be a whole number in [2, {config.command_cells}], got {cells!r}")
        low = -1.0 if action == "log_density" else 0.0
        self.action_space = spaces.Box(low, 1.0, (cells, cells), np.float32)
        self._is_log = action == "log_density"
        self._side = side
        self.sides = np.zeros(num_games, np.int64)
        """Team of each game's learner."""
        self.deal(opponent)
        self._seated = [self._dealt[0]] * num_games

    def deal(self, opponent: Opponents, names: Sequence[str] | None = None) -> None:
        """Deal opponents to the games in turn, from each one's next start on.

        Parameters
        ----------
        opponent : str, Policy or sequence of these
        names : sequence of str, optional
            What infos call them; their own names if not given.

        Raises
        ------
        ConfigError, PolicyError
            If none is given, or one cannot be had; the old ones stay.
        """
        given = [opponent] if isinstance(opponent, str) or not isinstance(opponent, Sequence) else list(opponent)
        if not given:
            raise ConfigError("opponent must be a policy, a name or a sequence of these, got none")
        # One object for all games against the same opponent: they are answered together.
        named = {policy: load(policy, self.config) for policy in given if isinstance(policy, str)}
        players = [named[policy] if isinstance(policy, str) else load(policy, self.config) for policy in given]
        called = [name_of(policy) for policy in given] if names is None else list(names)
        dealt = [_Opponent(name, player) for name, player in zip(called, players, strict=True)]
        self._dealt = [dealt[row % len(dealt)] for row in range(self.batch.num_games)]

    def _by_opponent(self, rows: NDArray[np.int64]) -> Iterable[tuple[Player, NDArray[np.int64]]]:
        """Group rows by who plays there."""
        groups: dict[int, list[int]] = {}
        for row in rows.tolist():
            groups.setdefault(id(self._seated[row].player), []).append(row)
        return [(self._seated[group[0]].player, np.array(group)) for group in groups.values()]

    def reset(
        self,
        seeds: Sequence[np.random.SeedSequence],
        rows: NDArray[np.int64],
        scenario: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Start games; each seed decides the start, the learner's side and the opponent's stream."""
        self.batch.reset(seeds, rows, scenario)
        streams = [_child_seeds(seed) for seed in seeds]
        for row, (side_seed, _) in zip(rows, streams, strict=True):
            if self._side == "random":
                self.sides[row] = np.random.default_rng(side_seed).integers(2)
            else:
                self.sides[row] = TEAM_NAMES.index(self._side)
            self._seated[row] = self._dealt[row]
        streams_of = dict(zip(rows.tolist(), (stream for _, stream in streams), strict=True))
        for policy, mine in self._by_opponent(rows):
            policy.reset([streams_of[row] for row in mine.tolist()], mine)

    def observe(self, rows: NDArray[np.int64] | None = None) -> Observations:
        """Return what the learners of some games see."""
        chosen = np.arange(self.batch.num_games) if rows is None else rows
        return self.batch.observe(self.seat, self.sides[chosen], chosen)

    def step(self, actions: ArrayLike, after_control_period: Callable[[], None] | None = None) -> DuelResult:
        """Play the learners' actions (E, A, A) against the opponents' answers.

        Raises
        ------
        CommandError, PolicyError
            If an action or an answer is not valid; no game is changed.
        """
        learners = self._commands(actions)
        rows = np.flatnonzero(self.batch.running)
        if not len(rows):
            raise GameOverError("no game is running: call reset before step")
        cells = self.config.command_cells
        commands = np.zeros((self.batch.num_games, 2, cells, cells))
        commands[rows, self.sides[rows]] = learners[rows]
        for policy, mine in self._by_opponent(rows):
            others = 1 - self.sides[mine]
            commands[mine, others] = ask(policy, self.batch, others, mine)
        result = self.batch.play(commands, after_control_period)
        games = np.arange(self.batch.num_games)
        return DuelResult(result.rewards[games, self.sides], result.terminated, result.truncated, result)

    def _commands(self, actions: ArrayLike) -> NDArray[np.float64]:
        """Turn actions into densities (E, A, A)."""
        shape = (self.batch.num_games, *(self.action_space.shape or ()))
        low = float(self.action_space.low.min())
        values = check_values(actions, shape, low, 1.0, "actions")
        return command_from_action(values, self.config.command_cells, is_log=self._is_log)

    def info(self, result: StepResult, row: int) -> dict[str, Any]:
        """Return the learner's info of one game."""
        side = int(self.sides[row])
        share = float(self.batch.simulator.sizes[row, side] / self.config.num_drones)
        return self.batch.info(result, row, side) | {"share": share} | self._seats(row)

    def start_info(self, row: int) -> dict[str, Any]:
        """Return the learner's info of a game that has just begun."""
        return {"size": int(self.batch.simulator.sizes[row, self.sides[row]])} | self._seats(row)

    def _seats(self, row: int) -> dict[str, str]:
        return {"side": TEAM_NAMES[int(self.sides[row])], "opponent": self._seated[row].name}


def _child_seeds(seed: np.random.SeedSequence) -> list[np.random.SeedSequence]:
    """Derive streams from a seed without changing it, unlike its own `spawn`."""
    return [
        np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, purpose), pool_size=seed.pool_size)
        for purpose in (1_000_001, 1_000_002)
    ]
