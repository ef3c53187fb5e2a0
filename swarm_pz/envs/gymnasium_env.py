"""One learner against an opponent, registered with Gymnasium as ``swarm_pz/Capture-v0``."""

from __future__ import annotations

from typing import Any, Literal

import gymnasium
import numpy as np
from numpy.typing import ArrayLike

from swarm_pz.config import GameConfig, resolve
from swarm_pz.envs.batch_env import by_game
from swarm_pz.envs.opponents import DuelBatch, OneLearner, Opponent
from swarm_pz.rendering.painter import METADATA, Screen
from swarm_pz.simulator.spawn import check_scenario, check_seed, next_seed
from swarm_pz.spaces.actions import ActionKind
from swarm_pz.spaces.observation import Observations, of_game


class DuelEnv(OneLearner, gymnasium.Env[Any, Any]):
    """One learner against an opponent, as a Gymnasium environment.

    Rules, observations and rewards are those of `swarm_pz.envs.parallel_env.CaptureEnv`, seen from the learner's side.
    Infos also have the learner's ``share`` of all drones, its ``side`` (0 red, 1 blue) and ``opponent``, an index into
    `opponent_names`.

    Parameters
    ----------
    config : GameConfig, optional
        The rules; every pair in it is (learner, opponent).
    opponent : str, Path, Policy or model
        A name that `policies.names()` lists, a folder that training wrote, a policy, or a model with
        `predict` and spaces, as Stable-Baselines3's; see `swarm_pz.policy.load`.
    side : {"random", "red", "blue"}
        The learner's side.
    action : {"normalised", "command", "modes", "discrete"}
    action_cells : int, optional
        See `swarm_pz.spaces.formats`.
    render_mode : str, optional
    max_cycles : int, optional
    **rules
        Fields of `GameConfig` to replace; `preset` names a preset to begin with.

    Examples
    --------
    >>> import gymnasium, swarm_pz
    >>> env = gymnasium.make("swarm_pz/Capture-v0", opponent="uniform")
    >>> observation, info = env.reset(seed=0)
    >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    >>> observation.shape, info["time_s"], env.unwrapped.opponent_names[info["opponent"]]
    ((9, 50, 50), 1.0, 'uniform')
    """

    metadata = METADATA

    def __init__(
        self,
        config: GameConfig | None = None,
        *,
        opponent: Opponent = "uniform",
        side: Literal["random", "red", "blue"] = "random",
        action: ActionKind = "normalised",
        action_cells: int | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **rules: Any,
    ) -> None:
        self.duel = DuelBatch(
            resolve(config, rules, type(self)),
            1,
            opponent=opponent,
            side=side,
            action=action,
            action_cells=action_cells,
            max_cycles=max_cycles,
        )
        self.render_mode = render_mode
        self.screen = Screen(render_mode, self.duel.batch.simulator)
        self.metadata = self.screen.metadata
        self.observation_space = self.duel.format.observation_space
        self.action_space = self.duel.format.action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start a game: without a seed, the next of `np_random`'s sequence. `options` may hold a scenario."""
        scenario = check_scenario(options or {}, self.duel.config)  # an error leaves the seeds unchanged
        if seed is not None:
            check_seed(seed)
            seed = int(seed)
        super().reset(seed=seed)
        game_seed = next_seed(self.np_random) if seed is None else np.random.SeedSequence(seed)
        self.duel.reset([game_seed], np.zeros(1, np.int64), scenario)
        self.screen.begin()
        return of_game(self.duel.observe(), 0), by_game(self.duel.infos())[0]

    def step(self, action: ArrayLike) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        """Play one command."""
        result = self.duel.step(np.asarray(action)[None], self.screen.after_control_period)
        return (
            of_game(self.duel.observe(), 0),
            float(result.rewards[0]),
            bool(result.terminated[0]),
            bool(result.truncated[0]),
            by_game(self.duel.infos(result))[0],
        )

    def render(self) -> Any:
        """Show or return the board as the render mode says."""
        return self.screen.render()

    def close(self) -> None:
        """Close the window and end threads."""
        self.screen.close()
        self.duel.batch.close()
