"""The ladder of a tournament as plain values and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.errors import require_extra
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.evaluation.ratings import intransitivity, nash_average, rate
from swarm_pz.evaluation.tournament import Tournament

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
    """Return a number of games, with a half only where there is one."""
    return int(games) if games == int(games) else games


def figure(value: float | None, digits: int) -> str:
    """Return a number for a table, or a dash for None."""
    return "-" if value is None else f"{value:.{digits}f}"


def plot(ladder: dict[str, Any], path: Path) -> None:
    """Draw ratings with intervals beside the payoff matrix."""
    figure_class = require_extra("matplotlib.figure", "cli").Figure
    names = [entry["player"] + ("*" if entry["kind"] == "planned" else "") for entry in ladder["players"]]
    count = len(names)
    size = 0.42 * count + 2.0
    figure = figure_class(figsize=(1.55 * size + 2.0, size), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1, 2.2])
    places = np.arange(count)
    values = np.array([entry["rating"] for entry in ladder["players"]])
    low, high = np.array([entry["rating_ci95"] for entry in ladder["players"]]).T
    left.errorbar(
        values, places, xerr=[np.maximum(values - low, 0), np.maximum(high - values, 0)], fmt="o", color="tab:blue"
    )
    left.set_yticks(places, names)
    left.set_ylim(count - 0.5, -0.5)
    left.grid(axis="x", alpha=0.3)
    left.set_xlabel("rating, 95 % interval")
    shares = 100 * np.array([[np.nan if value is None else value for value in row] for row in ladder["payoffs"]])
    image = right.imshow(shares, cmap="RdBu", vmin=0, vmax=100, aspect="auto")
    right.set_xticks(places, names, rotation=60, ha="right")
    right.set_yticks(places, [""] * count)
    for (i, j), value in np.ndenumerate(shares):
        if np.isfinite(value):
            color = "white" if abs(value - 50) > 30 else "black"
            right.text(j, i, f"{value:.0f}", ha="center", va="center", fontsize=7, color=color)
    right.set_title(
        "% of the points that the row takes from the column"
        + ("\n(* sees the simulator)" if any(name.endswith("*") for name in names) else ""),
        fontsize=10,
    )
    figure.colorbar(image, shrink=0.6)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)
