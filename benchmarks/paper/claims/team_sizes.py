"""How fast drones change sides."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, Interval, estimate, games_as_red
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.evaluation.intervals import median_with_interval
from swarm_pz.evaluation.rollout import Game, Rollout, play_games

GAMES, SHOWN = 60, 20
RED_PLAYER, BLUE_PLAYER = "ring", "uniform"
LEAST_RATE = 0.2
PAPER_SECONDS = 185.0
"""From about 15 s to just before 200 s in the paper's Fig. 7."""
CALM, LATE = "captures become rarer near the end", "the lead is settled late"


class Captures:
    """Keeps how many drones have changed sides so far, after every step."""

    def __init__(self, games: int) -> None:
        self.totals: list[list[int]] = [[0] for _ in range(games)]

    def __call__(self, rollout: Rollout) -> None:
        """Look at the games that were running."""
        captures = rollout.simulator.games.captures.sum(axis=1)
        for row in rollout.rows.tolist():
            self.totals[row].append(int(captures[row]))


def rates_of_middle_and_end(totals: list[int]) -> tuple[float, float]:
    """Return captures a step in the three fifths in the middle of a game, and in its last fifth."""
    steps = len(totals) - 1
    first, last = round(steps / 5), round(4 * steps / 5)
    middle, end = ((totals[b] - totals[a]) / max(b - a, 1) for a, b in ((first, last), (last, steps)))
    return middle, end


def lead_taken(sizes: list[int], total: int) -> float:
    """Return the share of a won game after which the winner led for good."""
    lead = np.sign(2 * np.asarray(sizes) - total)
    others = np.flatnonzero(lead != lead[-1])
    return float((others[-1] + 1) / (len(lead) - 1)) if len(others) else 0.0


def turns_of_lead(sizes: list[int], total: int) -> int:
    """Count how often the larger team becomes the smaller one; equal sizes in between do not count."""
    lead = np.sign(2 * np.asarray(sizes) - total)
    lead = lead[lead != 0]
    return int((lead[1:] != lead[:-1]).sum())


def measure(seed: int) -> Finding:
    """Play; count captures, and ask when games were settled."""
    config, captures = GameConfig(), Captures(GAMES)
    games = play_games(RED_PLAYER, BLUE_PLAYER, games_as_red(GAMES), seed=seed, config=config, after_step=captures)
    numbers: dict[str, tuple[float, Interval]] = {
        "captures_a_second": estimate([game.captures / game.seconds for game in games]),
        "turns_of_the_lead_a_game": estimate([turns_of_lead(game.sizes, config.num_drones) for game in games]),
        "mean_seconds": estimate([game.seconds for game in games]),
    }
    won = [place for place, game in enumerate(games) if game.outcome != "draw"]
    parts = {"sizes change rapidly": numbers["captures_a_second"][1][0] >= LEAST_RATE, CALM: False, LATE: False}
    if won:
        calm = estimate([rates_of_middle_and_end(captures.totals[place]) for place in won], _ratio)
        late = median_with_interval([lead_taken(games[place].sizes, config.num_drones) for place in won])
        numbers |= {"captures_at_the_end_over_middle": calm, "lead_taken_after_share_of_game": late}
        parts |= {CALM: calm[1][1] < 1.0, LATE: late[1][0] > 0.5}
    return Finding(
        numbers={**numbers},
        method=f"bootstrap over {GAMES} games, of which {len(won)} were won; order statistics for the median",
        holds=parts,
        seen=_describe(numbers, parts),
        configs={"paper": config},
        seeds=[seed],
        series=_shown(games[:SHOWN]),
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


def _describe(numbers: dict[str, tuple[float, Interval]], parts: dict[str, bool]) -> str:
    statistic = {name: value for name, (value, _) in numbers.items()}
    low, high = numbers["mean_seconds"][1]
    place = "as long as" if low <= PAPER_SECONDS <= high else "shorter than" if high < PAPER_SECONDS else "longer than"
    text = (
        f"In {GAMES} games of `{RED_PLAYER}` against `{BLUE_PLAYER}` a drone changes sides every "
        f"{1 / statistic['captures_a_second']:.1f} s, and the lead turns {statistic['turns_of_the_lead_a_game']:.1f} "
        f"times a game. A game takes {statistic['mean_seconds']:.0f} s on average ({low:.0f} to {high:.0f}; draws "
        f"count with the limit), {place} the {PAPER_SECONDS:g} s of the paper's one game."
    )
    if "lead_taken_after_share_of_game" in statistic:
        text += (
            f" In won games captures are {statistic['captures_at_the_end_over_middle']:.2f} times as frequent in the "
            f"last fifth as in the middle: they {'' if parts[CALM] else 'do not '}surely become rarer. In the median "
            f"the winner leads for good after {100 * statistic['lead_taken_after_share_of_game']:.0f} % of the game, "
            f"{'' if parts[LATE] else 'not '}surely late."
        )
    return text


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw red's size over time in every game."""
    axes, sizes, outcomes, bold = figure.subplots(), series["red_sizes"], series["outcomes"], series["bold"]
    looks = {
        "win": (style.TEAMS[RED], "o", f"won by red ({RED_PLAYER})"),
        "loss": (style.TEAMS[BLUE], "D", f"won by blue ({BLUE_PLAYER})"),
        "draw": (style.GREY, "s", "draw at the time limit"),
    }
    for number, (own, outcome, seconds) in enumerate(zip(sizes, outcomes, series["seconds"], strict=True)):
        times, (colour, marker, _) = [*range(len(own) - 1), seconds], looks[outcome]
        look = {"alpha": 1, "linewidth": 2.2} if number == bold else {"alpha": 0.3, "linewidth": 0.8}
        axes.step(times, own, where="post", color=colour, zorder=2 + (number == bold), **look)
        axes.plot(times[-1], own[-1], marker, color=colour, zorder=4, clip_on=False)
    end = series["seconds"][bold], sizes[bold][-1]
    axes.annotate(
        f"game of median length: {end[0]:.0f} s", end, (14, 22 if end[1] == 0 else -26), textcoords="offset points",
        arrowprops={"arrowstyle": "-", "color": style.DARK}, zorder=5,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8},
    )  # fmt: skip
    total = 2 * sizes[0][0]
    axes.axhline(total / 2, color=style.GREY, linewidth=0.9)
    axes.set(xlabel="time (s)", ylim=(-0.3, total + 0.3), xlim=(0, None))
    axes.set_ylabel(f"drones of red, of {total} (equal teams: {total / 2:g})")
    axes.set_yticks(range(0, total + 1, 5))
    style.legend_below(figure, [
        style.swatch(f"{text}: {outcomes.count(outcome)}", colour, marker=marker, line=1)
        for outcome, (colour, marker, text) in looks.items()
    ])  # fmt: skip


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
