"""One game between two policies, played to be looked at."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from swarm_pz.batch_env import BatchEnv
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.policy import Player, ask, load_players, name_of
from swarm_pz.scenario import check_seed


class Exhibition:
    """One game between two policies; the same seed gives the same game, whoever looks at it and how.

    Parameters
    ----------
    red, blue : str or Policy
    config : GameConfig, optional
    seed : int

    Attributes
    ----------
    batch : BatchEnv
        The game, row 0.
    simulator : Simulator
    names : (str, str)
        What red and blue are called.

    Raises
    ------
    PolicyError
        If a policy is unknown.
    """

    def __init__(
        self, red: str | Player, blue: str | Player, *, config: GameConfig | None = None, seed: int = 0
    ) -> None:
        check_seed(seed)
        config = config if config is not None else GameConfig()
        self.names = name_of(red), name_of(blue)
        self._players = load_players(red, blue, config)
        self._row = np.zeros(1, np.int64)
        self.batch = BatchEnv(config)
        self.simulator = self.batch.simulator
        self.batch.reset([seed])
        for place, player in enumerate(self._players):
            player.reset([np.random.SeedSequence(seed, spawn_key=(place,))], self._row)

    def play(
        self,
        seconds: float | None = None,
        *,
        after_control_period: Callable[[], None] | None = None,
        after_step: Callable[[], None] | None = None,
    ) -> None:
        """Play until the step in which so many seconds are over, or to the end.

        Parameters
        ----------
        seconds : float, optional
        after_control_period, after_step : callable, optional
            Called whenever one is over.
        """
        end = self.batch.limit_s if seconds is None else seconds
        while self.batch.running[0] and self.simulator.time_s[0] < end:
            commands = [
                ask(player, self.batch, np.array([team]), self._row)[0]
                for team, player in zip((RED, BLUE), self._players, strict=True)
            ]
            self.batch.step_checked(np.stack(commands)[None], after_control_period)
            if after_step is not None:
                after_step()

    @property
    def result(self) -> str:
        """How the game ended, in words."""
        outcomes = {None: "unfinished", "win": "red won", "loss": "blue won", "draw": "a draw"}
        return outcomes[self.batch.outcome(0, RED)]

    @property
    def standing(self) -> str:
        """How the game stands, in words."""
        red, blue = self.simulator.sizes[0]
        return f"{self.result} ({self.simulator.time_s[0]:.1f} s, red {red}, blue {blue})"

    def close(self) -> None:
        """End the simulator's threads."""
        self.batch.close()
