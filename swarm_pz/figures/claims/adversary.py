"""How hard uniform coverage is to beat, for every script."""

from __future__ import annotations

from typing import Any

import numpy as np

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.intervals import bootstrap
from swarm_pz.evaluation.match import play_match
from swarm_pz.figures import style
from swarm_pz.figures.figure import Figure, Finding
from swarm_pz.policy import registered

GAMES = 60
SCRIPTS, ADVERSARY = "swarm_pz.policies.scripted", "uniform"
RESENT = "restless"
VARIANTS = ("paper", "released")


def scripts() -> list[str]:
    """Return the names of all scripts but uniform coverage itself."""
    return sorted(name for name, point in registered().items() if point.module == SCRIPTS and name != ADVERSARY)


def median_win_rate(wins: Any) -> Any:
    """Return the median over players of the share of games won, of wins (pairs, players, 2)."""
    return np.median(np.mean(wins, axis=(0, 2)))


def measure(seed: int) -> Finding:
    """Play every script against uniform coverage, both sides, under the two sets of rules."""
    statistic, interval, series = {}, {}, {}
    configs = {name: GameConfig.preset(name) for name in VARIANTS}
    for variant, config in configs.items():
        matches = [play_match(name, ADVERSARY, games=GAMES, seed=seed, config=config) for name in scripts()]
        wins = np.array([[game.outcome == "win" for game in match.games] for match in matches], np.float64)
        value, low, high = bootstrap(wins.T.reshape(GAMES // 2, 2, -1).transpose(0, 2, 1), median_win_rate)
        name = f"median_win_rate_{variant}"
        statistic[name], interval[name] = float(value), (float(low), float(high))
        keys = ("policy", "games", "wins", "draws", "losses", "win_rate", "win_rate_ci95")
        series[variant] = [{key: match.summary()[key] for key in keys} for match in matches]
    supported = all(high < 0.5 for _, high in interval.values())
    return Finding(
        statistic=statistic,
        interval=interval,
        method=f"bootstrap over {GAMES // 2} pairs of games, sides swapped; in the picture Wilson's for each player",
        supported=supported,
        seen=_describe(series, statistic),
        configs=configs,
        seeds=[seed],
        series=series,
    )


def _describe(series: dict[str, Any], statistic: dict[str, float]) -> str:
    sentences, winners = [], {}
    for variant, rows in series.items():
        winners[variant] = [row["policy"] for row in rows if row["win_rate_ci95"][0] > 0.5]
        below = [row["policy"] for row in rows if row["win_rate_ci95"][1] < 0.5]
        sentences.append(
            f"Under the rules `{variant}` the median script wins {100 * statistic[f'median_win_rate_{variant}']:.0f} "
            f"% of its games; {len(below)} of {len(rows)} win clearly less than half, and "
            + (
                f"{', '.join(f'`{name}`' for name in winners[variant])} clearly more."
                if winners[variant]
                else "none more."
            )
        )
    if RESENT in winners["released"] and RESENT not in winners["paper"]:
        sentences.append(
            f"`{RESENT}`, which is uniform coverage sent anew with a trace of noise, wins under `released`, because "
            "there every new command empties what drones remember. So the claim holds for the rules that this "
            "benchmark plays by, and not for the published ones."
        )
    return " ".join(sentences)


_PARTS = (("wins", "won", style.SERIES[0]), ("draws", "drawn", style.PALE), ("losses", "lost", style.SERIES[1]))


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw won, drawn and lost games of every script, best first, with the win rate's interval."""
    panels = figure.subplots(1, len(series), squeeze=False)[0]
    for axes, (variant, rows) in zip(panels, series.items(), strict=True):
        rows = sorted(rows, key=lambda row: (row["win_rate"], -row["losses"] / row["games"]))
        places = np.arange(len(rows))
        left = np.zeros(len(rows))
        for key, label, colour in _PARTS:
            share = np.array([row[key] / row["games"] for row in rows])
            axes.barh(places, share, left=left, color=colour, height=0.7, label=label)
            left += share
        rates = np.array([row["win_rate"] for row in rows])
        low, high = np.array([row["win_rate_ci95"] for row in rows]).T
        style.whisker(axes, places, rates, low, high, sideways=True, fmt="none", ecolor=style.DARK, label="won, 95 %")
        axes.set_yticks(places, [row["policy"] for row in rows])
        axes.set(xlim=(0, 1), xlabel=f"share of games against {ADVERSARY}", title=f"rules: {variant}\n")
        axes.grid(visible=False)
        style.mark(axes, 0.5, "half", upright=True)
    handles, _ = panels[0].get_legend_handles_labels()
    style.legend_below(figure, handles)


FIGURE = Figure(
    name="adversary",
    title="Every script against uniform coverage",
    claim="Uniform coverage is a hard adversary for naive tactics.",
    section="IV-B",
    quote="an opponent swarm specified by a uniform coverage command across the domain "
    "— with no changes over time — is a challenging adversary",
    paper="The paper's adversary covers the square uniformly and never changes its command.",
    rule="Under every set of rules, the median script's win rate is below one half, with its whole interval.",
    measure=measure,
    draw=draw,
    size=(10.5, 4.8),
    seconds=90,
)
