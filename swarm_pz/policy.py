"""What a policy is, and how a name becomes one.

Names resolve through the entry-point group `swarm_pz.policies`, so that other packages can add
their own: each entry point is a callable that takes the game's `GameConfig` and returns a policy.
"""

from __future__ import annotations

import copy
import importlib.metadata
from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import CommandError, PolicyError, SwarmError, nearest
from swarm_pz.observation import Observations
from swarm_pz.scenario import Seed
from swarm_pz.target import check_densities

GROUP = "swarm_pz.policies"


@runtime_checkable
class Policy(Protocol):
    """Plays one seat of many games at once: observations in, commands out.

    An object may keep a state or a random stream for each row, so it belongs to one environment at a
    time: give another environment another object.
    """

    observation: ObservationConfig
    """What it wants to see."""

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, each with a random stream of its own."""

    def act(self, observations: Observations, rows: NDArray[np.int64]) -> NDArray[Any]:
        """Answer n observations, of the games in `rows` (n,), with densities (n, A, A) in [0, 1]."""


PolicyFactory = Callable[[GameConfig], Policy]


def registered() -> dict[str, importlib.metadata.EntryPoint]:
    """Return the entry point of every installed policy, by name."""
    return {point.name: point for point in importlib.metadata.entry_points(group=GROUP)}


def load(policy: str | Policy, config: GameConfig) -> Policy:
    """Return the policy of a name, made for a game; a policy is returned as it is.

    Raises
    ------
    PolicyError
        If there is no such name, or its policy cannot be made.
    """
    if not isinstance(policy, str):
        if not isinstance(policy, Policy):
            raise PolicyError(f"a policy must have observation, reset and act, got {policy!r}")
        return policy
    points = registered()
    if policy not in points:
        raise PolicyError(f"there is no policy {policy!r}; {nearest(policy, points)}")
    try:
        made = points[policy].load()(config)
    except SwarmError:
        raise
    except Exception as error:  # whatever another package's code does wrong
        raise PolicyError(f"policy {policy!r} ({points[policy].value}) cannot be made: {error!r}") from error
    if not isinstance(made, Policy):
        raise PolicyError(f"policy {policy!r} must have observation, reset and act, got {made!r}")
    return made


def load_players(first: str | Policy, second: str | Policy, config: GameConfig) -> tuple[Policy, Policy]:
    """Load two policies that share nothing, even where the same object is given twice."""
    one, other = load(first, config), load(second, config)
    return one, copy.deepcopy(other) if other is one else other


def ask(policy: Policy, observations: Observations, rows: NDArray[np.int64], config: GameConfig) -> NDArray[np.float64]:
    """Ask a policy for its commands and check them.

    Returns
    -------
    float64 array (n, A, A)

    Raises
    ------
    PolicyError
        If the answer is not n densities with values in [0, 1].
    """
    cells = config.command_cells
    name = getattr(policy, "name", type(policy).__name__)
    try:
        return check_densities(policy.act(observations, rows), (len(rows), cells, cells), f"policy {name}'s answer")
    except CommandError as error:
        raise PolicyError(str(error)) from error
