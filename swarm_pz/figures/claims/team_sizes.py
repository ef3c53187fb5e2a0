"""How fast drones change sides."""

from __future__ import annotations

from typing import Any

import numpy as np

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.evaluation.intervals import mean_with_interval
from swarm_pz.evaluation.rollout import play_games
from swarm_pz.figures import style
from swarm_pz.figures.figure import Figure, Finding, games_as_red

GAMES = 20
RED_PLAYER, BLUE_PLAYER = "ring", "uniform"
LEAST_RATE = 0.2


def turns_of_lead(sizes: list[int], total: int) -> int:
    """Count how often the larger team becomes the smaller one; equal sizes in between do not count."""
    lead = np.sign(2 * np.asarray(sizes) - total)
    lead = lead[lead != 0]
    return int((lead[1:] != lead[:-1]).sum())


def measure(seed: int) -> Finding:
    """Play and count captures."""
    config = GameConfig()
    games = play_games(RED_PLAYER, BLUE_PLAYER, games_as_red(GAMES), seed=seed, config=config)
    rate, interval = mean_with_interval([game.captures / game.seconds for game in games])
    turns, turns_interval = mean_with_interval([turns_of_lead(game.sizes, config.num_drones) for game in games])
    results = [game.outcome for game in games]
    return Finding(
        statistic={"captures_a_second": rate, "turns_of_the_lead_a_game": turns},
        interval={"captures_a_second": interval, "turns_of_the_lead_a_game": turns_interval},
        method=f"bootstrap over {GAMES} games",
        supported=interval[0] >= LEAST_RATE,
        seen=f"In {GAMES} games of `{RED_PLAYER}` against `{BLUE_PLAYER}` a drone changes sides every {1 / rate:.1f} "
        f"s, and the lead turns {turns:.1f} times a game. `{RED_PLAYER}` wins {results.count('win')}, loses "
        f"{results.count('loss')} and draws {results.count('draw')}. The bold line is the game of median length.",
        configs={"paper": config},
        seeds=[seed],
        series={
            "seconds": [round(game.seconds, 2) for game in games],
            "red_sizes": [game.sizes for game in games],
            "outcomes": results,
            "bold": int(np.argsort([game.seconds for game in games], kind="stable")[GAMES // 2]),
        },
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw red's size over time in every game."""
    axes = figure.subplots()
    colours = {"win": style.TEAMS[RED], "loss": style.TEAMS[BLUE], "draw": style.GREY}
    marks = {"win": "o", "loss": "D", "draw": "s"}
    for number, sizes in enumerate(series["red_sizes"]):
        outcome, bold = series["outcomes"][number], number == series["bold"]
        times = [*range(len(sizes) - 1), series["seconds"][number]]
        colour = colours[outcome]
        axes.step(
            times,
            sizes,
            where="post",
            color=colour,
            alpha=1 if bold else 0.3,
            linewidth=2.2 if bold else 0.8,
            zorder=2 + bold,
        )
        axes.plot(times[-1], sizes[-1], marks[outcome], color=colour, zorder=4, clip_on=False)
    times, bold = series["seconds"], series["bold"]
    axes.annotate(
        f"game of median length: {times[bold]:.0f} s",
        (times[bold], series["red_sizes"][bold][-1]),
        (14, 22 if series["red_sizes"][bold][-1] == 0 else -26),
        textcoords="offset points",
        arrowprops={"arrowstyle": "-", "color": style.DARK},
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8},
        zorder=5,
    )
    total = 2 * series["red_sizes"][0][0]
    axes.axhline(total / 2, color=style.GREY, linewidth=0.9)
    axes.set(xlabel="time (s)", ylim=(-0.3, total + 0.3), xlim=(0, None))
    axes.set_ylabel(f"drones of red, of {total} (equal teams: {total / 2:g})")
    axes.set_yticks(range(0, total + 1, 5))
    names = {
        "win": f"won by red ({RED_PLAYER})",
        "loss": f"won by blue ({BLUE_PLAYER})",
        "draw": "draw at the time limit",
    }
    style.legend_below(
        figure,
        [
            style.swatch(
                f"{text}: {series['outcomes'].count(outcome)}", colours[outcome], marker=marks[outcome], line=1
            )
            for outcome, text in names.items()
        ],
    )


FIGURE = Figure(
    name="team_sizes",
    title=f"Team sizes over {GAMES} games of {RED_PLAYER} against {BLUE_PLAYER}",
    claim="Team sizes fluctuate rapidly: the game is one of high cadence.",
    section="IV-B",
    quote="team sizes change rapidly over short periods of time",
    paper="The paper says that its capture rules make team sizes fluctuate rapidly, which is what makes the game's "
    "cadence high.",
    rule=f"At least {LEAST_RATE:g} drones a second change sides (one every 5 s): the lower end of the interval of the "
    "mean.",
    measure=measure,
    draw=draw,
    size=(8.5, 4.8),
    seconds=2,
)
