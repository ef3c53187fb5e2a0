"""Many games at once, one learner in each: ``gymnasium.make_vec("swarm_pz/Capture-v0")``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import GameConfig, resolve
from swarm_pz.envs.batch_env import StepResult
from swarm_pz.envs.opponents import DuelBatch, OneLearner, Opponents
from swarm_pz.errors import CommandError, ConfigError, GameOverError
from swarm_pz.rendering.painter import METADATA, Screen
from swarm_pz.simulator.spawn import check_scenario, check_seed, next_seed, seeds_of
from swarm_pz.spaces.actions import ActionKind
from swarm_pz.spaces.observation import Observations, of_game


class DuelVectorEnv(OneLearner, VectorEnv[Any, Any, Any]):
    """Many games at once, one learner in each; made by ``gymnasium.make_vec``.

    Parameters
    ----------
    num_envs : int
    config, opponent, side, action, action_cells, max_cycles, **rules
        As of `DuelEnv`; `opponent` may be a sequence, dealt to the games in turn.
    threads : int
    render_mode : str, optional
        `render` returns a tuple, with an entry for each game; ``human`` shows the first.
    autoreset_mode : AutoresetMode or str
        When an ended game starts afresh, as Gymnasium defines it: at the next step, which ignores its action
        (``NextStep``); at once, with its last observation and info in ``final_obs`` and ``final_info``
        (``SameStep``); or only by `reset` (``Disabled``).

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
        action: ActionKind = "normalised",
        action_cells: int | None = None,
        threads: int = 1,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **rules: Any,
    ) -> None:
        self.autoreset_mode = _check_autoreset(autoreset_mode)
        self.num_envs = num_envs
        self.duel = DuelBatch(
            resolve(config, rules, type(self)),
            num_envs,
            opponent=opponent,
            side=side,
            action=action,
            action_cells=action_cells,
            threads=threads,
            max_cycles=max_cycles,
        )
        self.render_mode = render_mode
        shown = 1 if render_mode in (None, "human") else num_envs
        self.screens = [Screen(render_mode, self.duel.batch.simulator, row) for row in range(shown)]
        self.metadata = self.screens[0].metadata | {"autoreset_mode": self.autoreset_mode}
        self.single_observation_space = self.duel.format.observation_space
        self.single_action_space = self.duel.format.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators = [seeding.np_random()[0] for _ in range(num_envs)]

    @property  # type: ignore[misc]  # as of SyncVectorEnv
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The random generator of each game, which seeds its next games."""
        return tuple(self._generators)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]  # as of SyncVectorEnv
        """The seed of each game's generator."""
        return tuple(seeds_of(generator).entropy for generator in self._generators)  # type: ignore[misc]

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start all games, or some; return observations and infos of all.

        Parameters
        ----------
        seed : int or sequence of int or None, optional
            One seed s gives game i the seed s + i; without one each game continues the sequence of its last seed.
        options : mapping, optional
            A scenario; and ``reset_mask``, a bool array (num_envs,) of the games to start: the others
            continue unchanged, and have no infos.

        Raises
        ------
        CommandError
            If seed, mask or scenario do not fit; no game is changed.
        """
        options = dict(options or {})
        mask = _check_mask(options.pop("reset_mask", None), self.num_envs)
        rows, games = np.flatnonzero(mask), []
        seeds, scenario = self._check_seeds(seed), check_scenario(options, self.duel.config)
        for row in rows.tolist():
            if (number := seeds[row]) is not None:
                self._generators[row] = seeding.np_random(number)[0]
            games.append(next_seed(self._generators[row]) if number is None else np.random.SeedSequence(number))
        self._start(games, rows, scenario)
        return self.duel.observe(), _masked(self.duel.infos(), mask)

    def _check_seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, (Sequence, np.ndarray)):
            seeds: list[int | None] = list(seed)
        else:
            check_seed(seed)
            seeds = [int(seed) + i for i in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise CommandError(f"seed must be one number or {self.num_envs}, got {len(seeds)}")
        for number in seeds:
            if number is not None:
                check_seed(number)
        return [None if number is None else int(number) for number in seeds]

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Play one command in every running game, and start ended games afresh as the autoreset mode says."""
        waiting = np.flatnonzero(~self.duel.batch.running)
        if len(waiting) and self.autoreset_mode == AutoresetMode.DISABLED:
            raise GameOverError(
                f"games {waiting.tolist()} have ended or not begun, and autoreset is disabled: call "
                "reset(options={'reset_mask': ...}) before step"
            )
        if len(waiting) == self.num_envs:
            self._restart(waiting)
            nothing, never = np.zeros(self.num_envs), np.zeros(self.num_envs, np.bool_)
            return self.duel.observe(), nothing, never, never.copy(), _masked(self.duel.infos())
        shows = self.screens[0].after_control_period is not None
        result = self.duel.step(actions, self._show if shows else None)
        if len(waiting):
            self._restart(waiting)
        over = result.terminated | result.truncated
        final = self._finish(result, over) if self.autoreset_mode == AutoresetMode.SAME_STEP and over.any() else {}
        # Games that have just begun have only zeros in the result.
        infos = self.duel.infos(result)
        if final:
            for name in ("captured", "lost", "recaptured"):
                infos[name][over] = 0
        return self.duel.observe(), result.rewards, result.terminated, result.truncated, _masked(infos) | final

    def _finish(self, result: StepResult, over: NDArray[np.bool_]) -> dict[str, Any]:
        """Restart the games that are over, and return their last observations and infos in Gymnasium's form."""
        rows = np.flatnonzero(over)
        last, infos = self.duel.observe(rows), self.duel.infos(result)
        observations = np.full(self.num_envs, None, dtype=object)
        for place, row in enumerate(rows.tolist()):
            observations[row] = of_game(last, place)
        self._restart(rows)
        return {
            "final_obs": observations,
            "_final_obs": over.copy(),
            "final_info": _masked(infos, over),
            "_final_info": over.copy(),
        }

    def _restart(self, rows: NDArray[np.int64]) -> None:
        self._start([next_seed(self._generators[row]) for row in rows], rows, None)

    def _start(
        self, seeds: Sequence[np.random.SeedSequence], rows: NDArray[np.int64], scenario: Mapping[str, Any] | None
    ) -> None:
        self.duel.reset(seeds, rows, scenario)
        if self.render_mode is not None:
            for row in rows[rows < len(self.screens)].tolist():
                self.screens[row].begin()

    def _show(self) -> None:
        for screen in self.screens:
            screen.after_control_period()

    def render(self) -> tuple[Any, ...] | None:
        """Return each game's picture as the render mode says; a window shows the first game, and returns None."""
        frames = tuple(screen.render() for screen in self.screens)
        return None if self.render_mode in (None, "human") else frames

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window and end threads."""
        for screen in self.screens:
            screen.close()
        self.duel.batch.close()


def _check_autoreset(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError as error:
        names = " or ".join(repr(known.value) for known in AutoresetMode)
        raise ConfigError(f"autoreset_mode must be {names}, got {mode!r}") from error


def _check_mask(mask: Any, count: int) -> NDArray[np.bool_]:
    if mask is None:
        return np.ones(count, np.bool_)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (count,) or not mask.any():
        raise CommandError(f"reset_mask must be a bool array of shape ({count},) with at least one True, got {mask!r}")
    return mask.copy()


def _masked(infos: dict[str, NDArray[Any]], mask: NDArray[np.bool_] | None = None) -> dict[str, Any]:
    """Return infos with Gymnasium's masks, of all games or of those in `mask`; other games have zeros."""
    masked: dict[str, Any] = {}
    for name, values in infos.items():
        masked[name] = values if mask is None else values * mask
        masked[f"_{name}"] = np.ones(len(values), np.bool_) if mask is None else mask.copy()
    return masked
