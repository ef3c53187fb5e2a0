"""Opponents and team sizes that no policy trains against: they show how well a tactic generalises.

They have no registered names, so that no training run finds them among the installed policies.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.bundles import PolicyBundle, unpacked_policy
from swarm_pz.evaluation.match import MatchResult, play_match
from swarm_pz.evaluation.workers import SerialExecutor, share
from swarm_pz.policies.scripted import (
    CLOCK,
    OPPONENTS,
    SCRIPTS,
    Tactic,
    View,
    halo,
    lasso,
    noise,
    ring,
    tactic,
    uniform,
    wavefront,
)
from swarm_pz.policy import folder_of

Array = NDArray[np.float64]


class Trial(NamedTuple):
    """One match of the suite: an opponent, and drones a team (None for the size evaluated)."""

    opponent: Tactic
    drones_per_team: int | None = None

    @property
    def name(self) -> str:
        """What tables call it."""
        size = "" if self.drones_per_team is None else f", {self.drones_per_team} a team"
        return f"{self.opponent.__name__}{size}"


def _blob(view: View, number: int, speed: float, width: float) -> Array:
    """Return a Gaussian (n, A, A) that wanders over the square, in each game on a curve of its own."""
    first = 4 * number
    phases, rates = view.traits[:, first : first + 2], view.traits[:, first + 2 : first + 4]
    angles = 2 * np.pi * phases + speed * (0.5 + 0.5 * rates) * view.steps[:, None]
    return np.asarray(np.exp(-((view.distance_from(0.5 + 0.4 * np.sin(angles)) / width) ** 2)))


@tactic(sees=CLOCK)
def drifting(view: View) -> Array:
    """Follow three Gaussians that wander over the square."""
    return _blob(view, 0, 0.3, 0.15) + _blob(view, 1, 0.3, 0.15) + _blob(view, 2, 0.3, 0.15)


@tactic(sees=CLOCK)
def clearing(view: View) -> Array:
    """Cover evenly, but for a gap that wanders."""
    return np.asarray(1.0 - 0.95 * _blob(view, 0, 0.2, 0.25))


@tactic(sees=OPPONENTS, grid=25)
def wide_ring(view: View) -> Array:
    """Make a wide ring around the opponents' mean position."""
    distance = view.distance_from(view.mean_position("opposing"))
    return np.asarray(np.exp(-(((distance - 0.35) / 0.1) ** 2)))


@tactic(sees=OPPONENTS, grid=25)
def crossing(view: View) -> Array:
    """Make a cross through the opponents' mean position."""
    place = view.mean_position("opposing")
    x, y = view.x - place[:, 0, None, None], view.y - place[:, 1, None, None]
    return np.asarray(np.exp(-((np.minimum(np.abs(x), np.abs(y)) / 0.06) ** 2)))


@tactic(sees=OPPONENTS, grid=25)
def ring_or_halo(view: View) -> Array:
    """Play `ring` and `halo` in turn, fifteen seconds each."""
    return _in_turn(view, ring, halo, period=15)


@tactic(sees=OPPONENTS, grid=25)
def lasso_or_noise(view: View) -> Array:
    """Play `lasso` and `noise` in turn, ten seconds each."""
    return _in_turn(view, lasso, noise, period=10)


@tactic(sees=OPPONENTS, grid=25)
def uniform_or_wavefront(view: View) -> Array:
    """Play `uniform` and `wavefront` in turn, twenty seconds each."""
    return _in_turn(view, uniform, wavefront, period=20)


def _in_turn(view: View, first: Tactic, second: Tactic, period: int) -> Array:
    is_second = (view.steps // period) % 2 == 1
    return np.where(is_second[:, None, None], second.play(view), first.play(view))


SUITE = (
    Trial(drifting),
    Trial(clearing),
    Trial(wide_ring),
    Trial(crossing),
    Trial(ring_or_halo),
    Trial(lasso_or_noise),
    Trial(uniform_or_wavefront),
    Trial(uniform, 5),
    Trial(uniform, 20),
    Trial(ring, 7),
    Trial(halo, 15),
)
"""What `swarm-pz evaluate --held-out` plays."""


class Generalisation(NamedTuple):
    """A policy's matches against opponents that it may know, and against those that it cannot."""

    known: list[MatchResult]
    held_out: list[MatchResult]

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain values: of every match, and the mean scores (a draw is half a win)."""
        known, held_out = _score(self.known), _score(self.held_out)
        return {
            "in_suite_score": known,
            "held_out_score": held_out,
            "generalisation": held_out - known,
            "in_suite": [match.summary() for match in self.known],
            "held_out": [match.summary() for match in self.held_out],
        }


def _score(matches: list[MatchResult]) -> float:
    return float(np.mean([match.score() for match in matches]))


def play_suites(
    policy: str,
    config: GameConfig,
    *,
    games: int,
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[int, int], None] | None = None,
    pool: Executor | None = None,
) -> Generalisation:
    """Play a policy against every script, and against the held-out suite.

    Parameters
    ----------
    policy : str
        Name or folder; it is loaded anew for every size of team.
    config : GameConfig
    games : int
        Games of each match, even.
    seed, threads : int
    progress : callable, optional
        Called with (games finished, games in all).
    pool : Executor, optional
        Plays, a match a task, as `open_pool` gives it; this process, if not given.

    Raises
    ------
    WorkerError
        If a worker died, or has another policy of that name.
    """
    pool = pool if pool is not None else SerialExecutor()
    digest, bundle = None, None
    if getattr(pool, "elsewhere", False):
        digest, folder = getattr(policies.load(policy, config), "digest", None), folder_of(policy)
        bundle = None if folder is None else PolicyBundle.of(folder)
    matches: dict[int, MatchResult] = {}

    def keep(task: tuple[Any, ...], match: MatchResult) -> None:
        matches[task[0]] = match
        if progress is not None:
            progress(len(matches) * games, len(_TRIALS) * games)

    tasks = [(number, policy, config, games, seed, threads, digest, bundle) for number in range(len(_TRIALS))]
    share(pool, play_trial, tasks, keep, name=lambda task: _TRIALS[task[0]].name)
    played = [matches[number] for number in range(len(_TRIALS))]
    return Generalisation(played[: len(SCRIPTS)], played[len(SCRIPTS) :])


_TRIALS = (*(Trial(script) for script in SCRIPTS), *SUITE)
"""What a policy may know, and what it cannot."""


def play_trial(
    number: int,
    policy: str,
    config: GameConfig,
    games: int,
    seed: int,
    threads: int,
    digest: str | None,
    bundle: PolicyBundle | None,
) -> MatchResult:
    """Play the match of a number, scripts first: a task of a pool."""
    trial = _TRIALS[number]
    size = trial.drones_per_team
    rules = config if size is None else config.replace(drones_per_team=size)
    with unpacked_policy(policy, rules, digest, bundle) as name:
        player, opponent = policies.load(name, rules), trial.opponent(rules)
        opponent.name = trial.name
        return play_match(player, opponent, games=games, seed=seed, config=rules, threads=threads)
