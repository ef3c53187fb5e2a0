"""Drones as agents: a PettingZoo environment with an agent for every drone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import AGENTS, GameConfig, resolve
from swarm_pz.envs.batch_env import StepResult
from swarm_pz.envs.drones_batch import DronesBatch, Side
from swarm_pz.envs.one_game import OneGameEnv, Step
from swarm_pz.envs.opponents import Opponent
from swarm_pz.errors import CommandError, ConfigError, GameOverError
from swarm_pz.spaces.drones import DroneAction, DroneActions


class DronesEnv(OneGameEnv):
    """Each drone of the learning side is an agent; an opponent commands the other swarm.

    The game is that of `swarm_pz.envs.parallel_env.CaptureEnv`; the learning side's control system is `direct`, and
    each agent sends one row of its command.

    |                   |                                                                       |
    |-------------------|-----------------------------------------------------------------------|
    | Import            | `from swarm_pz import drones_env`                                     |
    | Agents            | `red_0_drone_0`, `red_0_drone_1`, ..., `blue_0_drone_0`, ...: all drones |
    | Actions           | continuous or discrete, parallel                                      |
    | Action space      | `Box(-1, 1, (2,), float32)` or `Discrete(9)`                          |
    | Observation space | `Box(-1, 1, (160,), float32)`                                         |
    | State space       | `Box(0, 255, (10, 50, 50), uint8)`                                    |
    | Reward            | the team's, the same for all                                          |
    | Episode           | 1500 steps of 0.2 s, or until a team owns every drone                 |

    **Agents.** Every drone is an agent for the whole game, named after the side with which it begins. It is
    *active* while its drone works and belongs to a side that learns. Otherwise it sees -1 and zeros, its action is
    ignored, and learners leave it out. So the opponent's drones are inactive until they are captured.

    **Action.** An acceleration in units of the largest; a vector longer than 1 counts as one of length 1. With
    ``action="discrete"``, the number of one of `swarm_pz.spaces.drones.DIRECTIONS`. It is held for one step. A drone
    that is captured from an opponent within a step coasts until the next.

    **Observation.** One vector; `swarm_pz.spaces.drones` lists its parts, and `view.parts` has their slices and shapes.

    **Reward.** That of the team that the agent plays for when the step begins, also for inactive agents.

    **Infos.** Those of `CaptureEnv` for that team; ``side``, the team (0 red, 1 blue); and ``flies``, 1 for an active
    agent, else 0.

    Parameters
    ----------
    config : GameConfig, optional
        The rules. Pairs are (learner, opponent), or (red, blue) if both sides learn; unequal teams need a `side` other
        than "random". `controllers` flies the opponent's drones; of a pair ("direct", other) the second does.
        `command_period` is how long an opponent's command holds.
    side : {"random", "red", "blue", "both"}
        The side that learns.
    opponent : str, Path, Policy or model, optional
        As of `swarm_pz.envs.gymnasium_env.DuelEnv`, ``uniform`` if not given; there is none if both sides learn.
    action : {"acceleration", "discrete"}
    action_period : float
        Seconds of a step: a multiple of 0.1 s that divides `command_period`, unless both sides learn.
    neighbours, grid, patch : int
        See `swarm_pz.spaces.drones.DroneView`.
    render_mode, max_cycles, **overrides
        As of `CaptureEnv`.

    Examples
    --------
    >>> from swarm_pz import drones_env
    >>> env = drones_env(drones_per_team=3, side="red", max_cycles=3)
    >>> observations, infos = env.reset(seed=0)
    >>> infos["red_0_drone_0"]["flies"], infos["blue_0_drone_2"]["flies"]
    (1, 0)
    >>> while env.agents:
    ...     actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    ...     observations, rewards, terminations, truncations, infos = env.step(actions)
    >>> infos["red_0_drone_0"]["time_s"]
    0.6
    """

    def __init__(
        self,
        config: GameConfig | None = None,
        *,
        side: Side = "random",
        opponent: Opponent | None = None,
        action: DroneAction = "acceleration",
        action_period: float = 0.2,
        neighbours: int = 5,
        grid: int = 10,
        patch: int = 5,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **overrides: Any,
    ) -> None:
        self.drones = DronesBatch(
            resolve(config, overrides, type(self)),
            1,
            side=side,
            opponent=opponent,
            action=action,
            action_period=action_period,
            neighbours=neighbours,
            grid=grid,
            patch=patch,
            max_cycles=max_cycles,
        )
        self.config, self.view = self.drones.config, self.drones.view
        super().__init__(self.drones.batch, render_mode)
        self.metadata = self.metadata | {"name": "swarm_pz_drones_v0"}
        sizes = self.config.team_sizes
        if side == "random" and sizes[0] != sizes[1]:
            raise ConfigError(
                "agents are named after the side that they begin with, and must be the same in every game: with "
                f"unequal teams give side='red' or side='blue', got side='random' and drones_per_team={sizes}"
            )
        self.possible_agents = [
            f"{player}_drone_{number}"
            for player, size in zip(AGENTS, sizes[::-1] if side == "blue" else sizes, strict=True)
            for number in range(size)
        ]
        self.observation_spaces = dict.fromkeys(self.possible_agents, self.view.space)
        self.action_spaces = {agent: DroneActions(action).space for agent in self.possible_agents}

    def _start(self, seed: np.random.SeedSequence, scenario: Mapping[str, NDArray[Any]]) -> None:
        self.drones.reset([seed], np.zeros(1, np.int64), scenario)

    def step(self, actions: Mapping[str, Any]) -> Step:
        """Hold one action of every agent, also of inactive ones, for a step, or until the game ends.

        Raises
        ------
        CommandError
            If agents are unknown or missing, or an action is not valid; the game stays as it was.
        PolicyError
            If the opponent's answer is not valid.
        GameOverError
            If the game has ended or not begun.
        """
        if not self.agents:
            raise GameOverError("the game has ended or not begun: call reset before step")
        agents = self.possible_agents
        if not isinstance(actions, Mapping) or actions.keys() != self.action_spaces.keys():
            raise CommandError(
                f"actions must hold one for each agent, inactive ones too: {_key_mismatch(actions, agents)}"
            )
        read = self.drones.actions.read
        try:  # all at once, which is quicker
            accelerations = read([actions[agent] for agent in agents], (len(agents),), "actions")
        except CommandError:  # one by one, to name the agent
            accelerations = np.stack([read(actions[agent], (), f"{agent}'s action") for agent in agents])
        result = self.drones.step(accelerations[None], self.screen.after_control_period)
        return self._stepped(result, result.rewards[0])

    def _observations(self) -> dict[str, NDArray[np.float32]]:
        return dict(zip(self.possible_agents, self.drones.observe()[0], strict=True))

    def _infos(self, result: StepResult | None) -> dict[str, dict[str, Any]]:
        return dict(zip(self.possible_agents, self.drones.infos(result, 0), strict=True))


def _key_mismatch(actions: Any, agents: list[str]) -> str:
    """Return the difference between the names of actions and the agents."""
    if not isinstance(actions, Mapping):
        return f"got {type(actions).__name__} in place of a mapping"
    missing = [agent for agent in agents if agent not in actions]
    unknown = sorted(str(name) for name in set(actions) - set(agents))
    parts = [f"{word} {', '.join(names[:5])}" for word, names in (("missing", missing), ("unknown", unknown)) if names]
    return "; ".join(parts)


def drones_env(config: GameConfig | None = None, **keywords: Any) -> DronesEnv:
    """Make the PettingZoo environment whose agents are drones; keywords are those of `DronesEnv`."""
    return DronesEnv(config, **keywords)
