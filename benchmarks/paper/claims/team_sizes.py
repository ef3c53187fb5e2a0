"""How fast drones change sides."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.paper import style
from benchmarks.paper.course import Captures, lead_taken, rates_of_middle_and_end, turns_of_lead
from benchmarks.paper.figure import Figure, Finding, games_as_red
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.evaluation.intervals import bootstrap, mean_with_interval, median_with_interval
from swarm_pz.evaluation.rollout import Game, play_games

GAMES, SHOWN = 60, 20
RED_PLAYER, BLUE_PLAYER = "ring", "uniform"
LEAST_RATE = 0.2
PAPER_SECONDS = 185.0
"""From about 15 s to just before 200 s in the paper's Fig. 7."""
CALM, LATE = "captures become rarer near the end", "the lead is settled late"


def measure(seed: int) -> Finding:
    """Play; count captures, and ask when games were settled."""
    config, captures = GameConfig(), Captures(GAMES)
    games = play_games(
        RED_PLAYER, BLUE_PLAYER, games_as_red(GAMES), seed=seed, config=config, after_step=captures
    )  # fmt: skip
    rate, rate_ends = mean_with_interval([game.captures / game.seconds for game in games])
    turns, turns_ends = mean_with_interval([turns_of_lead(game.sizes, config.num_drones) for game in games])
    seconds, seconds_ends = mean_with_interval([game.seconds for game in games])
    won = [place for place, game in enumerate(games) if game.outcome != "draw"]
    statistic = {"captures_a_second": rate, "turns_of_the_lead_a_game": turns, "mean_seconds": seconds}
    interval = {
        "captures_a_second": rate_ends, "turns_of_the_lead_a_game": turns_ends, "mean_seconds": seconds_ends
    }  # fmt: skip
    parts = {"sizes change rapidly": rate_ends[0] >= LEAST_RATE, CALM: False, LATE: False}
    if won:
        ratio, *ends = bootstrap([rates_of_middle_and_end(captures.totals[place]) for place in won], _ratio)
        lead, lead_ends = median_with_interval([lead_taken(games[place].sizes, config.num_drones) for place in won])
        statistic |= {"captures_at_the_end_over_middle": float(ratio), "lead_taken_after_share_of_game": lead}
        interval |= {
            "captures_at_the_end_over_middle": (float(ends[0]), float(ends[1])),
            "lead_taken_after_share_of_game": lead_ends,
        }
        parts |= {CALM: float(ends[1]) < 1.0, LATE: lead_ends[0] > 0.5}
    return Finding(
        statistic=statistic,
        interval=interval,
        method=f"bootstrap over {GAMES} games, of which {len(won)} were won; order statistics for the median",
        supported=all(parts.values()),
        seen=_describe(statistic, interval),
        configs={"paper": config},
        seeds=[seed],
        series=_shown(games[:SHOWN]),
        parts=parts,
    )


def _ratio(rates: Any) -> Any:
    middle, last = np.mean(rates, axis=0)
    return last / max(middle, 1e-9)


def _shown(games: list[Game]) -> dict[str, Any]:
    return {
        "seconds": [round(game.seconds, 2) for game in games],
        "red_sizes": [game.sizes for game in games],
        "outcomes": [game.outcome for game in games],
        "bold": int(np.argsort([game.seconds for game in games], kind="stable")[len(games) // 2]),
    }


def _describe(statistic: dict[str, float], interval: dict[str, tuple[float, float]]) -> str:
    low, high = interval["mean_seconds"]
    place = (
        "as long as" if low <= PAPER_SECONDS <= high else ("shorter than" if high < PAPER_SECONDS else "longer than")
    )
    text = (
        f"In {GAMES} games of `{RED_PLAYER}` against `{BLUE_PLAYER}` a drone changes sides every "
        f"{1 / statistic['captures_a_second']:.1f} s, and the lead turns {statistic['turns_of_the_lead_a_game']:.1f} "
        f"times a game. A game takes {statistic['mean_seconds']:.0f} s on average ({low:.0f} to {high:.0f}; draws "
        f"count with the limit), {place} the {PAPER_SECONDS:g} s of the paper's one game."
    )
    if "lead_taken_after_share_of_game" in statistic:
        rarer = interval["captures_at_the_end_over_middle"][1] < 1.0
        late = interval["lead_taken_after_share_of_game"][0] > 0.5
        text += (
            f" In won games captures are {statistic['captures_at_the_end_over_middle']:.2f} times as frequent in the "
            f"last fifth as in the middle: they {'' if rarer else 'do not '}surely become rarer. In the median the "
            f"winner leads for good after {100 * statistic['lead_taken_after_share_of_game']:.0f} % of the game, "
            f"{'' if late else 'not '}surely late."
        )
    return text


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
    title=f"Team sizes over {SHOWN} games of {RED_PLAYER} against {BLUE_PLAYER}",
    claim="Team sizes change rapidly, until captures settle near the end of the game.",
    section="IV-B",
    quote="Near the end of the game, the frequency of agent captures stabilizes",
    paper="The paper's Fig. 7 shows the sizes over one game between two people, from about 15 s to just before 200 s.",
    rule=f"At least {LEAST_RATE:g} drones a second change sides (one every 5 s); in games that are won captures are "
    "rarer in the last fifth than in the three fifths in the middle; and the median winner leads for good only after "
    "half of the game; all three with their whole intervals. Of the lengths no more is asked than how they compare.",
    measure=measure,
    draw=draw,
    size=(8.5, 4.8),
    seconds=2,
)
