"""Drones captured and lost by a wave across the square."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, Setting, above, asked, estimates, seen, share
from benchmarks.paper.players import WAYS, Captures, Way, most_within, player
from swarm_pz.config import BLUE, RED
from swarm_pz.evaluation.intervals import bootstrap
from swarm_pz.evaluation.rollout import Rollout

GAMES = 40
ATTACK, OPPONENT = "wavefront", "uniform"
OTHERS = ("centre", "chase", "corners", "evade", "halo", "lasso", "noise", "ring")
"""Tactics to compare with the wave: all scripts except uniform coverage and two that no person would draw."""
MANY, QUICKLY = 5, 10
"""Number of drones that counts as many, half of a team, and seconds that count as quick: our bounds."""


def rates(games: Any) -> Any:
    """Return drones taken and lost per minute (..., 2) of games (starts, ..., 3): taken, lost and minutes."""
    sums = np.sum(games, axis=0)
    return sums[..., :2] / sums[..., 2:]


def gaps(games: Any) -> Any:
    """Return the first player's two rates (2,) minus the median of the other players'."""
    by_player = rates(games)
    return by_player[0] - np.median(by_player[1:], axis=0)


def counts(name: str, way: Way, setting: Setting) -> tuple[Any, Any]:
    """Play against uniform coverage.

    Returns drones taken and lost, and minutes (games, 3), and the most that were taken and lost quickly (games, 2).
    """
    numbers = setting.games(GAMES)
    tactic = player(name, way, setting, repels=name == ATTACK)
    rollout, captures = (
        Rollout(tactic, OPPONENT, numbers, seed=setting.seed, config=setting.config),
        Captures(len(numbers)),
    )
    rollout.play(after_step=captures)
    taken = rollout.simulator.games.captures
    most = np.stack([most_within(totals, QUICKLY) for totals in captures.totals])
    return np.stack([taken[:, RED], taken[:, BLUE], rollout.simulator.time_s / 60], axis=1), most


def measure(setting: Setting) -> Finding:
    """Play the wave as a person, who draws it, and all tactics as programs, from the same starts."""
    _, drawn = counts(ATTACK, WAYS[0], setting)
    played = {name: counts(name, WAYS[1], setting) for name in (ATTACK, *OTHERS)}
    games = np.stack([totals for totals, _ in played.values()], axis=1)
    rate, low, high = bootstrap(games, rates)
    beside = estimates(
        [f"raw: drones {what} a minute over the median tactic's, more" for what in ("taken", "lost")], games, gaps
    )
    parts = []
    for way, most in (("", drawn), ("raw: ", played[ATTACK][1])):
        taken, lost = (most >= MANY).T
        parts += [
            seen(f"{way}games in which {MANY} are taken within {QUICKLY} s", taken, ours=bool(way)),
            asked(
                f"{way}games in which {MANY} are lost within {QUICKLY} s, more than half",
                share(lost),
                above(0.5),
                ours=bool(way),
            ),
        ]
    return Finding(
        parts=parts + [asked(text, number, above(0.0), ours=True) for text, number in beside.items()],
        method=f"Wilson over {len(games)} games; bootstrap over starts, the same for all players, for rates",
        configs={"rules": setting.config},
        seeds=[setting.seed],
        series={"players": list(played), "rates": rate.tolist(), "low": low.tolist(), "high": high.tolist()},
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw taken against lost drones of every tactic."""
    axes = figure.subplots()
    rate, low, high = (np.array(series[name]) for name in ("rates", "low", "high"))
    most = 1.05 * max(high.max(), 1.0)
    axes.plot([0, most], [0, most], ":", color=style.GREY, linewidth=0.8, label="as many taken as lost")
    markers = dict(zip(series["players"], "DosvP^X<>", strict=True))
    for place, name in enumerate(series["players"]):
        colour = style.SERIES[1] if name == ATTACK else style.SERIES[0]
        up, across = np.stack([rate[place] - low[place], high[place] - rate[place]], axis=1)[..., None]
        look = {"fmt": markers[name], "color": colour, "capsize": 1.5, "elinewidth": 0.7, "label": name}
        axes.errorbar(rate[place][1], rate[place][0], xerr=across, yerr=up, **look)
    for scale in (axes.set_xscale, axes.set_yscale):
        scale("symlog", linthresh=10)
    axes.set(xlim=(0, most), ylim=(0, most))
    ticks = [tick for tick in (0, 5, 10, 20, 50, 100, 200, 500, 1000, 2000) if tick <= most]
    axes.set_xticks(ticks, ticks)
    axes.set_yticks(ticks, ticks)
    axes.minorticks_off()
    axes.set(xlabel="drones lost a minute (95 %)", ylabel="drones taken a minute (95 %)")
    style.legend_below(figure, axes, 5)


FIGURE = Figure(
    name="wavefront",
    claim="A wave that crashes into one side may capture many drones quickly, at high risk of losing one's own.",
    section="IV-B",
    quote="may quickly capture many opposing agents at high risk to the player losing their own agents",
    note="Attract is painted on the wave, and Repel elsewhere.",
    measure=measure,
    draw=draw,
    height=3.6,
    first="A wave takes and loses more drones a minute than the median of eight other scripts.",
    first_held=False,
    revised="The paper compares with no other tactic. It says that a wave may take many drones, and that the risk is "
    "high: that has to happen in more than half of the games.",
)
