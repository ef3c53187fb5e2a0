"""The PettingZoo environment: two agents, each commanding a swarm."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pettingzoo import AECEnv
from pettingzoo.utils import wrappers
from pettingzoo.utils.conversions import parallel_to_aec_wrapper

from swarm_pz.config import AGENTS, BLUE, RED, GameConfig, resolve
from swarm_pz.envs.batch_env import BatchEnv, StepResult, by_game
from swarm_pz.envs.one_game import OneGameEnv, Step
from swarm_pz.errors import CommandError, GameOverError
from swarm_pz.simulator import CheckedCommands
from swarm_pz.spaces.actions import ActionKind
from swarm_pz.spaces.formats import Format
from swarm_pz.spaces.observation import Observations, of_game

_GAMES, _TEAMS = np.zeros(2, np.int64), np.array([RED, BLUE])
"""Row and team of each side of the one game."""


class CaptureEnv(OneGameEnv):
    """Two swarms, each trying to capture all of the other's drones.

    Each agent sends a coarse *density image*, its command; a decentralized ergodic controller flies the team's drones
    so that, over time, they cover the square as the image asks. A drone that enters ground that the other swarm
    surrounds is captured and changes sides. A team that owns every drone wins. See docs/rules.md.

    |                   |                                                                |
    |-------------------|----------------------------------------------------------------|
    | Import            | `from swarm_pz import parallel_env`                            |
    | Registered as     | `swarm_pz/Capture-v0` (PettingZoo parallel and AEC, Gymnasium) |
    | Agents            | `red_0`, `blue_0`                                              |
    | Actions           | continuous, parallel                                           |
    | Action space      | `Box(0, 1, (10, 10), float32)`                                 |
    | Observation space | `Box(0, 255, (9, 50, 50), uint8)`                              |
    | State space       | `Box(0, 255, (10, 50, 50), uint8)`                             |
    | Reward            | zero-sum; in `[-3, 3]` at each step                            |
    | Episode           | 300 steps of 1 s, or until a team owns every drone             |

    **Action.** A density `[row = y, column = x]`, row 0 at the bottom, held for a step. Only ratios of values count;
    zeros mean uniform.

    **Observation.** Images from the agent's own side, in the order of `swarm_pz.config.CHANNELS`; see
    `swarm_pz.spaces.observation`.

    **Reward.** The team's change of size over the mean starting size of a team, plus 1 for a win, minus 1 for a loss,
    weighted by ``RewardConfig``.

    **Infos.** Numbers, the same names at every step: ``size``, ``captured``, ``lost``, ``recaptured`` (drones
    taken back within a second), ``time_s``, and ``outcome``: 1 for a win, -1 for a loss, else 0.

    **Reset options.** ``positions`` (N, 2), ``velocities`` (N, 2), ``teams`` (N,) set up a
    scenario. A misspelt option is an error; others are ignored.

    Parameters
    ----------
    config : GameConfig, optional
        The rules; preset `paper` if not given.
    action, action_cells
        See `swarm_pz.spaces.formats`.
    render_mode : str, optional
        ``human`` and ``rgb_array_list`` show every control period (0.1 s); ``rgb_array`` and ``ansi``
        the board as it is.
    max_cycles : int, optional
        Steps until a draw; follows from the time limit if not given.
    **rules
        Fields of `GameConfig` to replace; `preset` names a preset to begin with.

    Examples
    --------
    >>> from swarm_pz import parallel_env
    >>> env = parallel_env(drones_per_team=6, max_cycles=3)
    >>> observations, infos = env.reset(seed=0)
    >>> while env.agents:
    ...     actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    ...     observations, rewards, terminations, truncations, infos = env.step(actions)
    >>> infos["red_0"]["time_s"], infos["red_0"]["outcome"]
    (3.0, 0)

    Notes
    -----
    Version history: v0, the first.
    """

    def __init__(
        self,
        config: GameConfig | None = None,
        *,
        action: ActionKind = "command",
        action_cells: int | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **rules: Any,
    ) -> None:
        self.config = resolve(config, rules, type(self))
        super().__init__(BatchEnv(self.config, max_cycles=max_cycles), render_mode)
        self.possible_agents = list(AGENTS)
        self.formats = {
            agent: Format(self.config, observation, system, action=action, action_cells=action_cells)
            for agent, observation, system in zip(
                AGENTS, self.config.observations, self.config.team_systems, strict=True
            )
        }
        self._are_alike = self.config.team_systems[RED] == self.config.team_systems[BLUE]
        self.observation_spaces = {agent: form.observation_space for agent, form in self.formats.items()}
        self.action_spaces = {agent: form.action_space for agent, form in self.formats.items()}

    @property
    def command_names(self) -> tuple[str, ...]:
        """The names of red's discrete actions; empty for other actions."""
        return self.formats[AGENTS[RED]].command_names

    def _start(self, seed: np.random.SeedSequence, scenario: Mapping[str, NDArray[Any]]) -> None:
        self.batch.reset([seed], scenario=scenario)

    def step(self, actions: Mapping[str, Any]) -> Step:
        """Hold one action of each agent for a command period, or until the game ends.

        Raises
        ------
        CommandError
            If agents are unknown or missing, or a command is not valid; the game stays as it was.
        GameOverError
            If the game has ended or not begun.
        """
        if not self.agents:
            raise GameOverError("the game has ended or not begun: call reset before step")
        if not isinstance(actions, Mapping) or actions.keys() != self.formats.keys():
            received = sorted(map(str, actions)) if isinstance(actions, Mapping) else repr(actions)
            raise CommandError(f"actions must hold one command for each of {list(AGENTS)}, got {received}")
        result = self.batch.step(CheckedCommands(self._read(actions)), self.screen.after_control_period)
        return self._stepped(result, result.rewards[0])

    def _read(self, actions: Mapping[str, Any]) -> NDArray[np.float64]:
        """Return the commands (1, 2, *command_shape) of both agents."""
        red, blue = ordered = [actions[agent] for agent in AGENTS]
        if self._are_alike and type(red) is type(blue) is np.ndarray and red.dtype == blue.dtype == np.float32:
            with suppress(CommandError, ValueError):  # both at once is quicker; below, errors name the agent
                return self.batch.pack(self.formats[AGENTS[RED]].read(np.array(ordered), 2, ""))[None]
        return np.array(
            [[self.check_action(agent, action).values for agent, action in zip(AGENTS, ordered, strict=True)]]
        )

    def check_action(self, agent: str, action: Any) -> CheckedCommands:
        """Return an agent's action as a command (*command_shape); a checked one as it is.

        Raises
        ------
        CommandError
            If the action is not in its space.
        """
        if isinstance(action, CheckedCommands):
            return action
        command = self.formats[agent].read_one(action, f"{agent}'s command")
        return CheckedCommands(self.batch.pack(command[None])[0])

    def _observations(self) -> dict[str, Observations]:
        red, blue = self.config.observations
        if red == blue:  # at once, which is quicker
            observations = self.batch.see(red, _TEAMS, _GAMES)
            return {agent: of_game(observations, team) for team, agent in enumerate(AGENTS)}
        return {
            agent: of_game(self.batch.observe(form.observation, team), 0)
            for team, (agent, form) in enumerate(self.formats.items())
        }

    def _infos(self, result: StepResult | None) -> dict[str, dict[str, Any]]:
        return dict(zip(AGENTS, by_game(self.batch.infos(result, _TEAMS, _GAMES)), strict=True))


def parallel_env(config: GameConfig | None = None, **keywords: Any) -> CaptureEnv:
    """Make the PettingZoo parallel environment; keywords are those of `CaptureEnv`."""
    return CaptureEnv(config, **keywords)


def raw_env(config: GameConfig | None = None, **keywords: Any) -> CaptureAECEnv:
    """Make the AEC environment without PettingZoo's check that `reset` comes first; keywords as of `env`."""
    return CaptureAECEnv(CaptureEnv(config, **keywords))


def env(config: GameConfig | None = None, **keywords: Any) -> AECEnv[str, Observations, Any]:
    """Make PettingZoo's AEC environment, whose agents take turns; keywords are those of `CaptureEnv`."""
    return wrappers.OrderEnforcingWrapper(raw_env(config, **keywords))


class CaptureAECEnv(parallel_to_aec_wrapper):  # type: ignore[misc]  # untyped base
    """`CaptureEnv` with agents that move in turn; a bad command is refused in its agent's own turn."""

    env: CaptureEnv

    def step(self, action: Any) -> None:
        """Take the selected agent's command; both are played in the second agent's turn."""
        agent = self.agent_selection
        if not (self.terminations[agent] or self.truncations[agent]):
            action = self.env.check_action(agent, action)
        super().step(action)
