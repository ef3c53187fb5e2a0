"""One learner against an opponent: Gymnasium faces of the environment.

`DuelBatch` holds what these faces share: who sits where, what each seat sees, and the opponents'
answers. `DuelEnv` and `DuelVectorEnv` are registered with Gymnasium as ``swarm_pz/Capture-v0``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from swarm_pz.batch_env import BatchEnv, StepResult
from swarm_pz.config import RED, TEAM_NAMES, GameConfig, ObservationConfig
from swarm_pz.errors import CommandError, ConfigError, GameOverError
from swarm_pz.observation import Observations, observation_space
from swarm_pz.policy import Policy, ask, load
from swarm_pz.render import METADATA, Screen
from swarm_pz.target import check_values, interpolation_matrix

LOG_DENSITY_RANGE = 4.0
"""Natural logarithm of the ratio between a command's value at action 1 and at action 0."""

Opponents = str | Policy | Sequence[str | Policy]


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
    values = np.stack([fine @ action @ fine.T for action in actions])
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
        self._deal(opponent)

    def _deal(self, opponent: Opponents) -> None:
        given = [opponent] if isinstance(opponent, str) or not isinstance(opponent, Sequence) else list(opponent)
        if not given:
            raise ConfigError("opponent must be a policy, a name or a sequence of these, got none")
        self.opponents = [load(policy, self.config) for policy in given]
        self._dealt = np.arange(self.batch.num_games) % len(self.opponents)

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
        for number, policy in enumerate(self.opponents):
            mine = np.flatnonzero(self._dealt[rows] == number)
            if len(mine):
                policy.reset([streams[place][1] for place in mine], rows[mine])

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
        for number, policy in enumerate(self.opponents):
            mine = rows[self._dealt[rows] == number]
            if len(mine):
                seen = self.batch.observe(policy.observation, 1 - self.sides[mine], mine)
                commands[mine, 1 - self.sides[mine]] = ask(policy, seen, mine, self.config)
        result = self.batch.step(commands, after_control_period)
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
        return self.batch.info(result, row, side) | {"side": TEAM_NAMES[side]}

    def start_info(self, row: int) -> dict[str, Any]:
        """Return the learner's info of a game that has just begun."""
        return {"side": TEAM_NAMES[int(self.sides[row])], "size": int(self.batch.simulator.sizes[row, self.sides[row]])}


def _child_seeds(seed: np.random.SeedSequence) -> list[np.random.SeedSequence]:
    """Derive streams from a seed without changing it, unlike its own `spawn`."""
    return [
        np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, purpose), pool_size=seed.pool_size)
        for purpose in (1_000_001, 1_000_002)
    ]


class DuelEnv(gymnasium.Env[Any, NDArray[np.float32]]):
    """One learner against an opponent, as a Gymnasium environment.

    Rules, observations and rewards are those of `swarm_pz.parallel_env.CaptureEnv`, seen from the
    learner's side.

    Parameters
    ----------
    config : GameConfig, optional
    opponent : str or Policy
        A name that `policies.names()` lists, or a policy.
    side : {"random", "red", "blue"}
        Where the learner sits.
    action : {"log_density", "density"}
        With ``log_density``, the action space is Box(-1, 1) and the command its softmax, which
        suits Gaussian policies; with ``density`` it is the command itself.
    action_cells : int, optional
        Cells a side of an action, interpolated to the command's; as many as these if not given.
    render_mode : str, optional
    max_cycles : int, optional
    **overrides
        Fields of `GameConfig` to replace.

    Examples
    --------
    >>> import gymnasium, swarm_pz
    >>> env = gymnasium.make("swarm_pz/Capture-v0", opponent="uniform")
    >>> observation, info = env.reset(seed=0)
    >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    >>> observation.shape, info["time_s"]
    ((9, 50, 50), 1.0)
    """

    metadata = METADATA

    def __init__(
        self,
        config: GameConfig | None = None,
        *,
        opponent: str | Policy = "uniform",
        side: Literal["random", "red", "blue"] = "random",
        action: Literal["log_density", "density"] = "log_density",
        action_cells: int | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **overrides: Any,
    ) -> None:
        config = (config if config is not None else GameConfig()).replace(**overrides)
        self.duel = DuelBatch(
            config, 1, opponent=opponent, side=side, action=action, action_cells=action_cells, max_cycles=max_cycles
        )
        self.render_mode = render_mode
        self.screen = Screen(render_mode, self.duel.batch.simulator)
        self.metadata = self.screen.metadata
        self.observation_space = self.duel.observation_space
        self.action_space = self.duel.action_space
        self._seeds = np.random.SeedSequence()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start a game; `options` may hold a scenario."""
        super().reset(seed=seed)
        if seed is not None:
            self._seeds = np.random.SeedSequence(seed)
            game_seed = np.random.SeedSequence(seed)
        else:
            game_seed = self._seeds.spawn(1)[0]
        self.duel.reset([game_seed], np.zeros(1, np.int64), options)
        self.screen.begin()
        return _first(self.duel.observe()), self.duel.start_info(0)

    def step(self, action: ArrayLike) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        """Play one command."""
        result = self.duel.step(np.asarray(action)[None], self.screen.after_control_period)
        return (
            _first(self.duel.observe()),
            float(result.rewards[0]),
            bool(result.terminated[0]),
            bool(result.truncated[0]),
            self.duel.info(result.result, 0),
        )

    def render(self) -> Any:
        """Show or return the board as the render mode says."""
        return self.screen.render()

    def close(self) -> None:
        """Close the window and end threads."""
        self.screen.close()
        self.duel.batch.close()


class DuelVectorEnv(VectorEnv[Any, Any, Any]):
    """Many games at once, one learner in each; what ``gymnasium.make_vec`` gives.

    A game that has ended starts afresh at the next step (`AutoresetMode.NEXT_STEP`).

    Parameters
    ----------
    num_envs : int
    config, opponent, side, action, action_cells, max_cycles, **overrides
        As of `DuelEnv`; `opponent` may be a sequence, dealt to the games in turn.
    threads : int

    Examples
    --------
    >>> import gymnasium, swarm_pz
    >>> envs = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=4, opponent="ring")
    >>> observations, infos = envs.reset(seed=0)
    >>> observations, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
    >>> observations.shape, rewards.shape
    ((4, 9, 50, 50), (4,))
    """

    metadata = METADATA | {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        config: GameConfig | None = None,
        *,
        opponent: Opponents = "uniform",
        side: Literal["random", "red", "blue"] = "random",
        action: Literal["log_density", "density"] = "log_density",
        action_cells: int | None = None,
        threads: int = 1,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **overrides: Any,
    ) -> None:
        config = (config if config is not None else GameConfig()).replace(**overrides)
        self.num_envs = num_envs
        self.duel = DuelBatch(
            config,
            num_envs,
            opponent=opponent,
            side=side,
            action=action,
            action_cells=action_cells,
            threads=threads,
            max_cycles=max_cycles,
        )
        self.render_mode = render_mode
        self.screen = Screen(render_mode, self.duel.batch.simulator)
        self.single_observation_space = self.duel.observation_space
        self.single_action_space = self.duel.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._streams = np.random.SeedSequence().spawn(num_envs)

    def reset(
        self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start all games; one seed s gives game i the seed s + i, as Gymnasium does."""
        if seed is not None:
            seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else list(seed)
            if len(seeds) != self.num_envs:
                raise CommandError(f"seed must be one number or {self.num_envs}, got {len(seeds)}")
            self._streams = [np.random.SeedSequence(number) for number in seeds]
            first = [np.random.SeedSequence(number) for number in seeds]
        else:
            first = [stream.spawn(1)[0] for stream in self._streams]
        self.duel.reset(first, np.arange(self.num_envs), options)
        self.screen.begin()
        return self.duel.observe(), self._gather([self.duel.start_info(row) for row in range(self.num_envs)])

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Play one command in every running game and start afresh those that had ended."""
        ended = np.flatnonzero(~self.duel.batch.running)
        if len(ended) == self.num_envs:
            nothing = np.zeros(self.num_envs)
            never = np.zeros(self.num_envs, np.bool_)
            self._restart(ended)
            infos = [self.duel.start_info(row) for row in range(self.num_envs)]
            return self.duel.observe(), nothing, never, never.copy(), self._gather(infos)
        result = self.duel.step(actions, self.screen.after_control_period)
        if len(ended):
            self._restart(ended)
        infos = [
            self.duel.start_info(row) if row in ended else self.duel.info(result.result, row)
            for row in range(self.num_envs)
        ]
        return self.duel.observe(), result.rewards, result.terminated, result.truncated, self._gather(infos)

    def _restart(self, rows: NDArray[np.int64]) -> None:
        self.duel.reset([self._streams[row].spawn(1)[0] for row in rows], rows)

    def _gather(self, infos: list[dict[str, Any]]) -> dict[str, Any]:
        gathered: dict[str, Any] = {}
        for row, info in enumerate(infos):
            gathered = self._add_info(gathered, info, row)
        return gathered

    def render(self) -> Any:
        """Show or return the first game's board as the render mode says."""
        return self.screen.render()

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window and end threads."""
        self.screen.close()
        self.duel.batch.close()


def _first(observations: Observations) -> Observations:
    if isinstance(observations, dict):
        return {name: part[0] for name, part in observations.items()}
    return observations[0]
