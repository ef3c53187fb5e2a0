"""The numbers of the ladder of systems, as plain values, from the games that were played."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.systems_ladder.contest import ADVERSARY, Contest, player_name, system_name
from swarm_pz.config.registry import system_of
from swarm_pz.evaluation.intervals import bootstrap, wilson
from swarm_pz.evaluation.ledger import PlayedGame

Array = NDArray[np.float64]


def standings(contest: Contest) -> list[dict[str, Any]]:
    """Return how each entrant did against the adversary, who wins more often first, and of equals who wins sooner.

    A pair of games that came out the same counts as one. Lengths of games are restricted to the time limit, which
    draws take; the time to a win counts lost and drawn games as not won up to the limit.
    """
    others = [entrant for entrant in contest.players if entrant != ADVERSARY]
    return [_standing(contest, entrant) for entrant in sorted(others, key=contest.order)]


def _standing(contest: Contest, entrant: str) -> dict[str, Any]:
    games = [alike[0] for alike in contest.counting(entrant, ADVERSARY)]
    limit, system, count = contest.config.game.time_limit, system_name(entrant), len(games)
    outcomes = [game.outcome_of(entrant) for game in games]
    wins, draws, losses = (outcomes.count(outcome) for outcome in ("win", "draw", "loss"))
    played = [game for game in games if not game.forfeit]
    rates = [60.0 * game.sent[game.one != entrant] / max(game.seconds, 1e-9) for game in played]
    return {
        "entrant": entrant,
        "system": system,
        "player": player_name(entrant),
        "takes": system_of(system).takes,
        "kind": contest.kind(entrant),
        "games": count,
        "wins": wins,
        "draws": draws,
        "losses": losses,
        "forfeits": sum(bool(game.forfeit) and game.outcome_of(entrant) == "loss" for game in games),
        "win_rate": wins / count,
        "win_rate_ci95": list(wilson(wins, count)),
        "length": _over_pairs(played, [limit if game.outcome == "draw" else game.seconds for game in played]),
        "time_to_win": _over_pairs(games, [_time(game, entrant, limit) for game in games]),
        "commands_a_minute": _over_pairs(played, rates),
        "won_after_s": sorted(game.seconds for game in games if game.outcome_of(entrant) == "win"),
    }


def _over_pairs(games: Sequence[PlayedGame], values: Sequence[float]) -> dict[str, Any] | None:
    """Return the mean of values, one a game, and its interval from a bootstrap over pairs of games."""
    if not games:
        return None
    pairs = _by_pair(games, values)
    sums = np.array([[sum(pair), len(pair)] for pair in pairs.values()])
    return _mean(sums, lambda drawn: drawn[:, 0].sum() / drawn[:, 1].sum())


def _by_pair(games: Sequence[PlayedGame], values: Sequence[float]) -> dict[int, list[float]]:
    pairs: dict[int, list[float]] = {}
    for game, value in zip(games, values, strict=True):
        pairs.setdefault(game.number // 2, []).append(value)
    return pairs


def _mean(values: Array, statistic: Callable[[Any], Any] | None = None) -> dict[str, Any]:
    mean, *ends = map(float, bootstrap(values, statistic))
    return {"mean": mean, "ci95": ends}


def compare(contest: Contest, one: str, other: str) -> dict[str, Any]:
    """Return by how much more often, and sooner, the first of two wins against the adversary, on the same starts.

    Both are means of differences and their intervals from a bootstrap over pairs of games; `sooner` is in seconds of
    the restricted mean time to a win.
    """
    limit = contest.config.game.time_limit
    wins = _paired(contest, (one, other), lambda game, who: float(game.outcome_of(who) == "win"))
    times = _paired(contest, (one, other), lambda game, who: _time(game, who, limit))
    more, sooner = _mean(wins[:, 0] - wins[:, 1]), _mean(times[:, 1] - times[:, 0])
    return {"one": one, "other": other, "more_often": more, "sooner": sooner}


def _time(game: PlayedGame, entrant: str, limit: float) -> float:
    return game.seconds if game.outcome_of(entrant) == "win" else limit


def _paired(contest: Contest, entrants: tuple[str, str], value: Callable[[PlayedGame, str], float]) -> Array:
    """Return the mean over each pair of games of a value of two entrants (pairs, 2)."""
    columns = []
    for entrant in entrants:
        games = list(contest.between(entrant, ADVERSARY))
        pairs = _by_pair(games, [value(game, entrant) for game in games])
        columns.append([float(np.mean(pairs[pair])) for pair in sorted(pairs)])
    return np.array(columns).T


def payoffs(contest: Contest, order: Sequence[str]) -> list[list[float | None]]:
    """Return each one's (row) share of the points against each other (column); None on the diagonal."""
    points, games = contest.results().payoffs()
    shares = points / np.where(games > 0, games, np.nan)
    places = [contest.players.index(entrant) for entrant in order]
    return [
        [None if i == j or not np.isfinite(shares[i, j]) else round(float(shares[i, j]), 4) for j in places]
        for i in places
    ]
