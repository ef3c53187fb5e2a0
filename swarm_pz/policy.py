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

from swarm_pz.batch_env import BatchEnv
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import CommandError, PolicyError, SwarmError, nearest
from swarm_pz.observation import Observations
from swarm_pz.scenario import Seed
from swarm_pz.simulator import Simulator
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


@runtime_checkable
class PrivilegedPolicy(Protocol):
    """Plays by looking into the simulator itself: it sees more than any seat may, and tables say so."""

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, each with a random stream of its own."""

    def plan(self, simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[Any]:
        """Answer the games in `rows` (n,), from the sides `teams` (n,), with densities (n, A, A) in [0, 1]."""


Player = Policy | PrivilegedPolicy
PolicyFactory = Callable[[GameConfig], Player]


def registered() -> dict[str, importlib.metadata.EntryPoint]:
    """Return the entry point of every installed policy, by name: of several, swarm-pz's own or else the first."""
    found: dict[str, importlib.metadata.EntryPoint] = {}
    for point in _entry_points():
        found.setdefault(point.name, point)
    return found


def _entry_points() -> list[importlib.metadata.EntryPoint]:
    points = importlib.metadata.entry_points(group=GROUP)
    return sorted(points, key=lambda point: (_origin(point) != "swarm-pz", _origin(point), point.value))


def _origin(point: importlib.metadata.EntryPoint) -> str:
    """Return the name of the package that registered a policy."""
    return str(point.dist.name) if point.dist is not None else "unknown"


def faults() -> dict[str, str]:
    """Return what is wrong with what other packages registered, in words: broken policies by name, copies by origin."""
    found: dict[str, str] = {}
    for point in _entry_points():
        where = f"policy {point.name!r} of {_origin(point)} ({point.value})"
        if point != registered()[point.name]:
            taken = _origin(registered()[point.name])
            found[f"{point.name} of {_origin(point)}"] = f"{where}: {taken} has a policy of that name already"
            continue
        try:
            factory = point.load()
        except Exception as error:  # whatever another package's code does wrong
            found[point.name] = f"{where} cannot be imported: {error!r}"
        else:
            if not callable(factory):
                found[point.name] = f"{where} must be callable, got {factory!r}"
    return found


def about(name: str) -> str:
    """Return a line about an installed policy, from the first of its factory's docstring; nothing about others."""
    point = registered().get(name.split(":", 1)[0])
    try:
        text = (getattr(point.load(), "__doc__", None) or "").strip() if point is not None else ""
    except Exception:  # `faults` says it
        return ""
    return text.splitlines()[0] if text else ""


def load(policy: str | Player, config: GameConfig) -> Player:
    """Return the policy of a name, made for a game; a policy is returned as it is.

    A name may carry an argument after a colon, which its factory takes besides the game:
    ``planner:ring`` is a planner that models its opponent as `ring`.

    Raises
    ------
    PolicyError
        If there is no such name, or its policy cannot be made.
    """
    if not isinstance(policy, str):
        return _check(policy, "a policy")
    points = registered()
    name, *argument = policy.split(":", 1)
    if name not in points:
        raise PolicyError(f"there is no policy {name!r}, and no such folder; {nearest(name, points)}")
    try:
        made = points[name].load()(config, *argument)
    except SwarmError:
        raise
    except Exception as error:  # whatever another package's code does wrong
        raise PolicyError(f"policy {policy!r} ({points[name].value}) cannot be made: {error!r}") from error
    return _check(made, f"policy {policy!r}")


def _check(made: object, name: str) -> Player:
    if not isinstance(made, (Policy, PrivilegedPolicy)):
        raise PolicyError(f"{name} must have reset, and observation and act or else plan, got {made!r}")
    return made


def name_of(policy: str | Player) -> str:
    """Return what tables call a policy."""
    return policy if isinstance(policy, str) else str(getattr(policy, "name", type(policy).__name__))


def load_players(first: str | Player, second: str | Player, config: GameConfig) -> tuple[Player, Player]:
    """Load two policies that share nothing, even where the same object is given twice."""
    one, other = load(first, config), load(second, config)
    return one, copy.deepcopy(other) if other is one else other


def ask(policy: Player, batch: BatchEnv, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """Show a policy some games, each from a team's side, and check the commands that it gives.

    Parameters
    ----------
    policy : Player
    batch : BatchEnv
    teams : int64 array (n,)
        The policy's team in each game.
    rows : int64 array (n,)
        The games.

    Returns
    -------
    float64 array (n, A, A)

    Raises
    ------
    PolicyError
        If the answer is not n densities with values in [0, 1].
    """
    cells = batch.config.command_cells
    if isinstance(policy, PrivilegedPolicy):
        answer = policy.plan(batch.simulator, teams, rows)
    else:
        answer = policy.act(batch.observe(policy.observation, teams, rows), rows)
    try:
        return check_densities(answer, (len(rows), cells, cells), f"policy {name_of(policy)}'s answer")
    except CommandError as error:
        raise PolicyError(str(error)) from error
