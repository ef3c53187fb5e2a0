"""Whether a wave across the square captures many drones, and loses many."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, Interval, estimates, games_as_red
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.evaluation.intervals import bootstrap
from swarm_pz.evaluation.rollout import Rollout

GAMES = 40
ATTACK, OPPONENT = "wavefront", "uniform"
OTHERS = ("centre", "chase", "corners", "evade", "halo", "lasso", "noise", "ring")
"""Tactics that a wave is compared with: all scripts but two that no person would draw and uniform coverage itself."""


def rates(games: Any) -> Any:
    """Return drones taken and lost a minute (..., 2) of games (starts, ..., 3): taken, lost and minutes."""
    sums = np.sum(games, axis=0)
    return sums[..., :2] / sums[..., 2:]


def gaps(games: Any) -> Any:
    """Return by how much the first player's two rates (2,) are above the median of the others'."""
    found = rates(games)
    return found[0] - np.median(found[1:], axis=0)


def counts(name: str, seed: int, config: GameConfig) -> Any:
    """Play games against uniform coverage; return drones taken and lost, and minutes (GAMES, 3)."""
    rollout = Rollout(name, OPPONENT, games_as_red(GAMES), seed=seed, config=config)
    rollout.play()
    captures = rollout.simulator.games.captures
    return np.stack([captures[:, RED], captures[:, BLUE], rollout.simulator.time_s / 60], axis=1)


def measure(seed: int) -> Finding:
    """Play the wave and all others against uniform coverage, from the same starts."""
    config, players = GameConfig(), (ATTACK, *OTHERS)
    games = np.stack([counts(name, seed, config) for name in players], axis=1)
    found, low, high = bootstrap(games, rates)
    above = estimates(["taken_a_minute_above_the_median", "lost_a_minute_above_the_median"], games, gaps)
    taken, lost = above.values()
    return Finding(
        numbers={
            "taken_a_minute": (float(found[0, 0]), (float(low[0, 0]), float(high[0, 0]))),
            "lost_a_minute": (float(found[0, 1]), (float(low[0, 1]), float(high[0, 1]))),
            **above,
        },
        method=f"bootstrap over {GAMES} starts, the same for all players",
        holds={"captures many": taken[1][0] > 0, "at high risk": lost[1][0] > 0},
        seen=f"Against `{OPPONENT}` the wave takes {found[0, 0]:.0f} drones a minute and loses {found[0, 1]:.0f}; that "
        f"is {taken[0]:+.0f} and {lost[0]:+.0f} beside the median of {len(OTHERS)} other tactics: {_surely(taken)} are "
        f"taken than is usual, and {_surely(lost)} lost.",
        configs={"paper": config},
        seeds=[seed],
        series={"players": players, "rates": found.tolist(), "low": low.tolist(), "high": high.tolist()},
    )


def _surely(number: tuple[float, Interval]) -> str:
    low, high = number[1]
    return "surely more" if low > 0 else "surely fewer" if high < 0 else "not surely more"


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw drones taken against drones lost a minute, of every player."""
    axes = figure.subplots()
    found, low, high = (np.array(series[name]) for name in ("rates", "low", "high"))
    most = 1.05 * max(high.max(), 1.0)
    axes.plot([0, most], [0, most], ":", color=style.GREY, linewidth=0.9)
    look = {"ha": "center", "va": "top", "rotation": 45, "rotation_mode": "anchor", "transform_rotates_text": True}
    axes.text(0.42 * most, 0.41 * most, "as many taken as lost", color=style.GREY, fontsize=8, **look)
    for place, name in enumerate(series["players"]):
        is_wave, (taken, lost) = name == ATTACK, found[place]
        colour, marker, weight = (style.SERIES[1], "D", "bold") if is_wave else (style.SERIES[0], "o", "normal")
        up, across = np.stack([found[place] - low[place], high[place] - found[place]], axis=1)[..., None]
        axes.errorbar(lost, taken, xerr=across, yerr=up, fmt=marker, color=colour, capsize=2)
        *aside, side = (-6, 6, "right") if name == "halo" else (6, -12 if name == "ring" else 6, "left")
        words = {"color": colour, "weight": weight, "fontsize": 8, "ha": side, "textcoords": "offset points"}
        axes.annotate(name, (lost, taken), aside, **words)
    axes.set(xlim=(0, most), ylim=(0, most))
    axes.set(xlabel="drones lost a minute (95 %)", ylabel=f"drones taken a minute from {OPPONENT} (95 %)")


FIGURE = Figure(
    name="wavefront",
    title="A wave beside other tactics",
    claim="A wave that crashes into one side captures many drones quickly, at high risk of losing one's own.",
    section="IV-B",
    quote="may quickly capture many opposing agents at high risk to the player losing their own agents",
    paper="The paper names it as a tactic that players may come to.",
    rule=f"Against uniform coverage both the drones that `{ATTACK}` takes a minute and those that it loses are above "
    f"the median of {len(OTHERS)} other scripts, with the whole intervals of the differences.",
    measure=measure,
    draw=draw,
    size=(7.5, 6.0),
    seconds=9,
)
