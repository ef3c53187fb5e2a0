"""The numbers of the ladder of systems, as plain values, from the games that were played."""

from __future__ import annotations

from collections.abc import Sequence
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
    limit = contest.config.game.time_limit
    outcomes = [game.outcome_of(entrant) for game in games]
    counts = {outcome: outcomes.count(outcome) for outcome in ("win", "draw", "loss")}
    played = [game for game in games if not game.forfeit]
    place = {game.key: game.one != entrant for game in games}
    rates = [60.0 * game.sent[place[game.key]] / max(game.seconds, 1e-9) for game in played]
    wins = [game.seconds if game.outcome_of(entrant) == "win" else None for game in games]
    name = player_name(entrant)
    return {
        "entrant": entrant,
        "system": system_name(entrant),
        "player": name,
        "takes": system_of(system_name(entrant)).takes,
        "kind": contest.kind(entrant),
        "games": len(games),
        "wins": counts["win"],
        "draws": counts["draw"],
        "losses": counts["loss"],
        "forfeits": sum(bool(game.forfeit) and game.outcome_of(entrant) == "loss" for game in games),
        "win_rate": counts["win"] / len(games),
        "win_rate_ci95": list(wilson(counts["win"], len(games))),
        "length": _over_pairs(played, [_length(game, limit) for game in played]),
        "time_to_win": _over_pairs(games, [limit if won is None else won for won in wins]),
        "commands_a_minute": _over_pairs(played, rates),
        "won_after_s": sorted(won for won in wins if won is not None),
    }


def _length(game: PlayedGame, limit: float) -> float:
    return limit if game.outcome == "draw" else game.seconds


def _over_pairs(games: Sequence[PlayedGame], values: Sequence[float]) -> dict[str, Any] | None:
    """Return the mean of values, one a game, and its interval from a bootstrap over pairs of games."""
    if not games:
        return None
    pairs: dict[int, list[float]] = {}
    for game, value in zip(games, values, strict=True):
        pairs.setdefault(game.number // 2, []).append(value)
    sums = np.array([[sum(pair), len(pair)] for pair in pairs.values()])
    mean, low, high = bootstrap(sums, lambda drawn: drawn[:, 0].sum() / drawn[:, 1].sum())
    return {"mean": float(mean), "ci95": [float(low), float(high)]}


def compare(contest: Contest, one: str, other: str) -> dict[str, Any]:
    """Return by how much more often the first of two wins against the adversary, on the same starts.

    Returns
    -------
    dict
        `more_often` and `sooner` (seconds of the restricted mean time to a win), each a mean of differences and its
        interval from a bootstrap over pairs of games.
    """
    wins, times = (
        _paired(contest, (one, other), lambda game, who: float(game.outcome_of(who) == "win")),
        _paired(contest, (one, other), lambda game, who: _time(game, who, contest.config.game.time_limit)),
    )
    often, often_low, often_high = bootstrap(wins[:, 0] - wins[:, 1])
    soon, soon_low, soon_high = bootstrap(times[:, 1] - times[:, 0])
    return {
        "one": one,
        "other": other,
        "more_often": {"mean": float(often), "ci95": [float(often_low), float(often_high)]},
        "sooner": {"mean": float(soon), "ci95": [float(soon_low), float(soon_high)]},
    }


def _time(game: PlayedGame, entrant: str, limit: float) -> float:
    return game.seconds if game.outcome_of(entrant) == "win" else limit


def _paired(contest: Contest, entrants: tuple[str, str], value: Any) -> Array:
    """Return the mean over each pair of games of a value of two entrants (pairs, 2)."""
    columns = []
    for entrant in entrants:
        by_pair: dict[int, list[float]] = {}
        for game in contest.between(entrant, ADVERSARY):
            by_pair.setdefault(game.number // 2, []).append(value(game, entrant))
        columns.append([float(np.mean(by_pair[pair])) for pair in sorted(by_pair)])
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
