"""The numbers of the ladder of systems, as plain values, from the games that were played."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.systems_ladder.contest import ADVERSARY, Contest, player_name, system_name
from swarm_pz.config.registry import system_of
from swarm_pz.errors import require_extra
from swarm_pz.evaluation.intervals import bootstrap, wilson
from swarm_pz.evaluation.ledger import PlayedGame
from swarm_pz.evaluation.ratings import nash_average

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
        "kind": contest.sorts[entrant],
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


def _time(game: PlayedGame, entrant: str, limit: float) -> float:
    return game.seconds if game.outcome_of(entrant) == "win" else limit


def wins(contest: Contest, order: Sequence[str]) -> Array:
    """Return the share of its games (n, n) that each one (row) wins against each (column), a draw being no win.

    On the diagonal, where both sides are the same one, it is half of what is decided.
    """
    shares = np.zeros((len(order), len(order)))
    for (i, one), (j, other) in itertools.product(enumerate(order), enumerate(order)):
        won, drawn, lost = contest.tally(one, other).sum(axis=0)
        shares[i, j] = (won if i != j else (won + lost) / 2) / (won + drawn + lost)
    return shares


def solve(shares: Array) -> dict[str, Any]:
    """Return what the game is worth in which both sides choose an entrant, from the share of games each wins (n, n).

    A draw is worth nothing to either, so wins alone are no zero-sum game. Wins less losses are one, of value 0:
    `mixture` (n,) is its equilibrium, and `wins` the share of the games that this wins against itself. `guaranteed` is
    the largest share of wins that a mixture has whatever the other side chooses, and `safest` (n,) that mixture.
    """
    mixture, _ = nash_average(shares)
    count = len(shares)
    # The last unknown is the level below which no opponent brings the mixture's wins.
    found = require_extra("scipy.optimize", "cli").linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=np.column_stack([-shares.T, np.ones(count)]),
        b_ub=np.zeros(count),
        A_eq=np.append(np.ones(count), 0.0)[None],
        b_eq=[1.0],
        bounds=[(0.0, None)] * count + [(None, None)],
    )
    return {
        "mixture": mixture.round(4).tolist(),
        "wins": float(mixture @ shares @ mixture),
        "guaranteed": max(0.0, float(-found.fun)),
        "safest": np.asarray(found.x[:count]).round(4).tolist(),
    }
