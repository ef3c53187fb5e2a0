"""Whether a team that is far behind can still win."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, games_as_red
from swarm_pz.config import RED, GameConfig
from swarm_pz.errors import MissingExtraError
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.evaluation.rollout import play_games
from swarm_pz.policy import load

GAMES = 100
PLAYERS = ("ring", "hunter", "champion")
"""From the weakest to the strongest; learned ones need the extra "train"."""
HANDICAPS = ((1, 19), (3, 17))
OPPONENT = "uniform"
LEAST = 0.05


def installed(names: tuple[str, ...], config: GameConfig) -> list[str]:
    """Return those players whose dependencies are there."""
    there = []
    for name in names:
        with contextlib.suppress(MissingExtraError):
            load(name, config)
            there.append(name)
    return there


def longest_behind(histories: list[list[int]], results: list[str], total: int) -> int | None:
    """Return the won game that was behind for the longest, None if none is won."""
    won = [number for number, result in enumerate(results) if result == "win"]
    return max(won, key=lambda number: sum(2 * size < total for size in histories[number]), default=None)


def measure(seed: int) -> Finding:
    """Play from behind."""
    players = installed(PLAYERS, GameConfig())
    strongest = players[-1]
    configs = {f"{own} against {other}": GameConfig(drones_per_team=(own, other)) for own, other in HANDICAPS}
    rows: list[dict[str, Any]] = []
    shown, numbers = {}, {}
    for handicap, config in configs.items():
        for player in players:
            games = play_games(player, OPPONENT, games_as_red(GAMES), seed=seed, config=config)
            results, histories = [game.outcome for game in games], [game.sizes for game in games]
            wins, draws = results.count("win"), results.count("draw")
            row = {"handicap": handicap, "player": player, "wins": wins, "draws": draws, "games": GAMES}
            rows.append(row | {"win_interval": wilson(wins, GAMES)})
            if player == strongest:
                numbers["win_rate_from_" + handicap.replace(" ", "_")] = wins / GAMES, wilson(wins, GAMES)
                number = longest_behind(histories, results, config.num_drones)
                shown[handicap] = None if number is None else histories[number]
    holds = all(low > LEAST for _, (low, _) in numbers.values())
    seen = " ".join(
        f"From {handicap}, "
        + ", ".join(
            f"`{row['player']}` wins {row['wins']} and draws {row['draws']}"
            for row in rows
            if row["handicap"] == handicap
        )
        + f" of {GAMES} games against `{OPPONENT}`."
        for handicap in configs
    )
    if not holds:
        seen += " A team this far behind wins too rarely to call it a chance."
    return Finding(
        numbers={**numbers},
        method=f"Wilson over {GAMES} games",
        holds=holds,
        seen=seen,
        configs=configs,
        seeds=[seed],
        series={"rows": rows, "strongest": strongest, "games": shown, "drones": sum(HANDICAPS[0])},
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the shares won and drawn, and a comeback from each handicap."""
    left, right = figure.subplots(1, 2, width_ratios=[1, 1.3])
    rows = series["rows"]
    labels = [f"{row['player']}\n{row['handicap']}" for row in rows]
    places = np.arange(len(rows))
    won, drawn = (np.array([row[key] / row["games"] for row in rows]) for key in ("wins", "draws"))
    low, high = np.array([row["win_interval"] for row in rows]).T
    left.barh(places, won, color=style.TEAMS[RED], height=0.6, label="won")
    left.barh(places, drawn, left=won, color=style.PALE, height=0.6, label="drawn")
    style.whisker(left, places, won, low, high, sideways=True, fmt="none", ecolor=style.DARK, label="won, 95 %")
    for place, share in zip(places, won, strict=True):
        left.text(1.01, place, f"{100 * share:.0f} %", va="center")
    left.set_yticks(places, labels, fontsize=8)
    left.set(xlim=(0, 1), ylim=(len(rows) - 0.4, -0.6), xlabel=f"share of games against {OPPONENT}")
    left.set_title("won from behind")
    left.grid(visible=False)
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3)
    drones, strongest = series["drones"], series["strongest"]
    for (handicap, sizes), colour, dash in zip(series["games"].items(), style.SERIES, style.DASHES, strict=False):
        if sizes:
            look = {"where": "post", "color": colour, "linewidth": 1.8, "label": f"from {handicap}"}
            right.step(range(len(sizes)), sizes, dash, **look)
    style.mark(right, drones / 2, "equal teams")
    right.set(xlabel="time (s)", ylabel=f"drones of {strongest}, of {drones}", ylim=(0, drones + 0.5))
    right.set_title(f"{strongest}'s won games that were behind for the longest")
    right.set_yticks(range(0, drones + 1, 5))
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)


FIGURE = Figure(
    name="comebacks",
    title="From 1 against 19 and 3 against 17",
    claim="A game is not over before the last drone is captured: a team that is far behind can still win.",
    section="IV-B",
    quote="One agent, controlled strategically, can be sufficient to build up team size again.",
    paper="The paper's team sizes fluctuate so rapidly that players must reckon with both teams' sizes at every "
    "moment.",
    rule=f"From both handicaps {PLAYERS[-1]}, the strongest of these, wins more than {100 * LEAST:.0f} % of its "
    "games, with the whole interval.",
    measure=measure,
    draw=draw,
    size=(11.0, 4.8),
    seconds=18,
)
