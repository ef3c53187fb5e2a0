"""The interface of policies: observations in, commands out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.observation import Observations

ANY = "any"
"""The `answers` of a policy that can return every kind, until `for_system` gets its team's system."""


@runtime_checkable
class Policy(Protocol):
    """Plays one side of many games at once: observations in, commands out.

    Its attribute `answers` is the kind of its commands (see `ControlSystem.takes`), by default densities. A policy
    with several kinds has a method `for_system`, called by `swarm_pz.policy.load`: it takes the control system that
    flies the team, and returns the policy that commands it.

    An object may keep a state or a random stream for each row, so it belongs to one environment at a
    time: give another environment another object.
    """

    observation: ObservationConfig
    """The observation that it sees."""

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, each with a random stream of its own."""

    def act(self, observations: Observations, rows: NDArray[np.int64]) -> NDArray[Any]:
        """Return n commands for n observations of the games in `rows`: usually densities (n, A, A) in [0, 1]."""


@runtime_checkable
class PrivilegedPolicy(Protocol):
    """Plays by reading the simulator itself; tables mark it."""

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, each with a random stream of its own."""

    def plan(self, simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[Any]:
        """Return commands (n, ...) of the kind `answers` for the sides `teams` (n,) of the games `rows` (n,)."""


Player = Policy | PrivilegedPolicy


def answers_of(policy: Player) -> str:
    """Return the kind of a policy's commands: its `answers`, or else densities."""
    return str(getattr(policy, "answers", "density"))


def constant(play: Callable[[Any], NDArray[Any]]) -> Callable[[Any], NDArray[Any]]:
    """Mark a tactic's function that always returns the same density: environments ask it once a game."""
    play.is_constant = True  # type: ignore[attr-defined]
    return play


PolicyFactory = Callable[[GameConfig], Player]
