"""The ladder of a tournament as plain values and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.evaluation.provenance import provenance
from swarm_pz.evaluation.ratings import intransitivity, nash_average, rate
from swarm_pz.evaluation.tournament import Tournament
from swarm_pz.rendering.plots import drawing, matrix

_ANCHOR = "uniform"


def make_ladder(tournament: Tournament) -> dict[str, Any]:
    """Return the figures of a tournament, best player first; `payoffs` are shares of points, row against column."""
    results = tournament.results()
    anchor = _ANCHOR if _ANCHOR in tournament.players else None
    ratings = rate(results, anchor)
    points, games = results.payoffs()
    shares = points / np.where(games > 0, games, np.nan)
    mixture, skills = nash_average(shares)
    order = np.argsort(-ratings.values, kind="stable")
    entries = []
    for i in order:
        name = tournament.players[i]
        others = [other for other in tournament.players if other != name]
        won, drawn, lost = np.concatenate([tournament.tally(name, other) for other in others]).sum(axis=0).tolist()
        own = [alike[0] for other in others for alike in tournament.counting(name, other)]
        played = [game for game in own if not game.forfeit]
        entries.append(
            {
                "player": name,
                "kind": tournament.sorts[name],
                "rating": round(float(ratings.values[i]), 1),
                "rating_ci95": [round(float(ratings.low[i]), 1), round(float(ratings.high[i]), 1)],
                "mixture_share": round(float(mixture[i]), 4),
                "points_against_mixture": round(0.5 + float(skills[i]), 4),
                "games": _count(won + drawn + lost),
                "wins": _count(won),
                "draws": _count(drawn),
                "losses": _count(lost),
                "forfeits": sum(bool(game.forfeit) and game.outcome_of(name) == "loss" for game in own),
                "median_seconds": float(np.median([game.seconds for game in played])) if played else None,
                "thinking_ms": round(float(np.median([game.thinking_ms[game.one != name] for game in played])), 2)
                if played
                else None,
            }
        )
    field = intransitivity(results)
    return {
        "seed": tournament.config.seed,
        "games_per_pairing": tournament.config.games,
        "budget_ms": tournament.config.budget_ms,
        "config_hash": tournament.config.game.hash,
        **provenance(tournament.config.game, tournament.command),
        "anchor": anchor,
        "players": entries,
        "payoffs": [[None if i == j else round(float(shares[i, j]), 4) for j in order] for i in order],
        "intransitivity": {
            "cyclic_share": round(field.cyclic_share, 4),
            "cyclic_share_of_a_ladder": round(field.expected, 4),
            "cycles": field.cycles,
            "decided_triples": field.triples,
            "strongest_cycle": list(field.strongest),
        },
    }


def _count(games: float) -> int | float:
    """Return a number of games, as an int if it is whole."""
    return int(games) if games == int(games) else games


def figure(value: float | None, digits: int) -> str:
    """Return a number for a table, or a dash for None."""
    return "-" if value is None else f"{value:.{digits}f}"


def plot(ladder: dict[str, Any], path: Path) -> None:
    """Draw ratings with intervals beside the payoff matrix."""
    names = [entry["player"] + ("*" if entry["kind"] == "planned" else "") for entry in ladder["players"]]
    count = len(names)
    with drawing(path, (0.34 * count + 5.0, 0.26 * count + 2.2)) as figure:
        left, right = figure.subplots(1, 2, width_ratios=[2.0, 0.34 * count + 0.8])
        places = np.arange(count)
        values = np.array([entry["rating"] for entry in ladder["players"]])
        low, high = np.array([entry["rating_ci95"] for entry in ladder["players"]]).T
        reach = [np.maximum(values - low, 0), np.maximum(high - values, 0)]
        left.errorbar(values, places, xerr=reach, fmt="o", markersize=4)
        left.set_yticks(places, names)
        left.set_ylim(count - 0.5, -0.5)
        left.set_title("rating, 95 % interval")
        shares = np.array([[np.nan if value is None else value for value in row] for row in ladder["payoffs"]])
        privileged = "; * sees the simulator" if any(name.endswith("*") for name in names) else ""
        matrix(right, names, shares, f"% of the points that the row takes from the column{privileged}")
        right.tick_params(labelleft=False)
