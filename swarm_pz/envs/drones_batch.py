"""E games in which every drone is an agent: the common base of the wrappers for drones."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import BLUE, CONTROL_PERIOD, RED, TEAM_NAMES, GameConfig
from swarm_pz.config.base import check, check_choice, check_number
from swarm_pz.envs.batch_env import BatchEnv, StepResult, by_game
from swarm_pz.envs.opponents import DuelBatch, Opponents
from swarm_pz.errors import ConfigError
from swarm_pz.kernels.sight import BOTH
from swarm_pz.simulator import CheckedCommands
from swarm_pz.spaces.drones import DroneAction, DroneActions, DroneView

Side = Literal["random", "red", "blue", "both"]


class DronesBatch:
    """E games in which agents fly the drones of the learning side, by `direct`; keywords as of `DronesEnv`.

    Several opponents are dealt to the games in turn. `duel` is None where both sides learn.
    """

    def __init__(
        self,
        config: GameConfig,
        num_games: int,
        *,
        side: Side = "random",
        opponent: Opponents | None = None,
        action: DroneAction = "acceleration",
        action_period: float = 0.2,
        neighbours: int = 5,
        grid: int = 10,
        patch: int = 5,
        threads: int = 1,
        max_cycles: int | None = None,
    ) -> None:
        check_choice(side, "side", ("random", *TEAM_NAMES, "both"))
        both = config.controllers
        if isinstance(both, tuple) and config.team_controllers[0] != "direct":
            raise ConfigError(
                f"drones that learn are flown by 'direct': give controllers=('direct', other), got {both!r}"
            )
        own = config.replace(
            command_period=_check_period(config, action_period, is_free=side == "both"),
            controllers="direct" if side == "both" else ("direct", config.team_systems[1]),
        )
        self.config = own
        self.view = DroneView(own, neighbours=neighbours, grid=grid, patch=patch)
        self.actions = DroneActions(action)
        self.duel: DuelBatch | None = None
        if side == "both":
            if opponent is not None:
                raise ConfigError(f"there is no opponent where both sides learn: leave it out, got {opponent!r}")
            self.batch = BatchEnv(own, num_games, threads=threads, max_cycles=max_cycles)
        else:
            self.duel = DuelBatch(
                own,
                num_games,
                opponent="uniform" if opponent is None else opponent,
                side=side,
                threads=threads,
                max_cycles=max_cycles,
                answer_ticks=config.step_ticks,
                action="command",
            )
            self.batch = self.duel.batch

    @property
    def flies(self) -> NDArray[np.bool_]:
        """(E, N) active drones: working drones of a side that learns."""
        games = self.batch.simulator.games
        if self.duel is None:
            return ~games.failed
        return np.asarray((games.teams == self.duel.sides[:, None]) & ~games.failed)

    @property
    def sides(self) -> NDArray[np.int64]:
        """(E, N) the team that each drone plays for, or would if it were active."""
        teams = self.batch.simulator.games.teams
        return teams.astype(np.int64) if self.duel is None else np.repeat(self.duel.sides[:, None], teams.shape[1], 1)

    def reset(
        self,
        seeds: Sequence[np.random.SeedSequence],
        rows: NDArray[np.int64],
        scenario: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Start games; each seed decides the start, the learning side and the opponent's stream."""
        if self.duel is None:
            self.batch.reset(seeds, rows, scenario)
        else:
            self.duel.reset(seeds, rows, scenario)

    def observe(self, rows: NDArray[np.int64] | None = None) -> NDArray[np.float32]:
        """Return the drones' observations (n, N, D) of some games."""
        chosen = np.arange(self.batch.num_games) if rows is None else rows
        sides = np.full(len(chosen), BOTH) if self.duel is None else self.duel.sides[chosen]
        return self.view.observe(self.batch.simulator, sides, chosen)

    def step(
        self, accelerations: NDArray[np.float64], after_control_period: Callable[[], None] | None = None
    ) -> StepResult:
        """Hold accelerations (E, N, 2), as `DroneActions.read` returns them, for a step; inactive drones have none."""
        sides = self.sides
        # A drone captured from an opponent in this step coasts to its end, until its agent has an observation.
        commands = np.where(self.flies[:, :, None], accelerations, 0.0)
        packed = self.batch.pack(commands)
        if self.duel is None:
            result = self.batch.step(CheckedCommands(np.stack([packed, packed], axis=1)), after_control_period)
            return result._replace(rewards=result.rewards[np.arange(len(sides))[:, None], sides])
        result = self.duel.step(CheckedCommands(packed), after_control_period)
        return result._replace(rewards=np.repeat(result.rewards[:, None], sides.shape[1], axis=1))

    def infos(self, result: StepResult | None, row: int) -> list[dict[str, Any]]:
        """Return the infos of one game's drones: `BatchEnv.infos` of its team, `side`, and `flies`, 0 or 1."""
        teams, rows = np.array([RED, BLUE]), np.array([row, row])
        of_team = by_game(self.batch.infos(result, teams, rows))
        flies = self.flies[row].astype(np.int64).tolist()
        return [
            {**of_team[side], "side": side, "flies": plays}
            for side, plays in zip(self.sides[row].tolist(), flies, strict=True)
        ]


def _check_period(config: GameConfig, period: float, *, is_free: bool) -> float:
    """Return the seconds of a step, if opponents' commands can hold for a whole number of steps."""
    period = check_number(period, "action_period", CONTROL_PERIOD, 1e6)
    periods = period / CONTROL_PERIOD
    is_whole = abs(periods - round(periods)) < 1e-6
    check(is_whole, "action_period", period, "a whole number of control periods of 0.1 s")
    if not is_free:
        ticks = config.replace(command_period=period).step_ticks
        expected = f"a whole part of command_period, which is {config.command_period:g} s and holds opponents' commands"
        check(config.step_ticks % ticks == 0, "action_period", period, expected)
    return period
