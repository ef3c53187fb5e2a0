"""Games won by teams that are far behind."""

from __future__ import annotations

import contextlib
from typing import Any

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, Setting, seen, standing
from benchmarks.paper.players import PACE, WAYS, player
from swarm_pz.errors import MissingExtraError
from swarm_pz.evaluation.rollout import play_games
from swarm_pz.policy import load

GAMES = 60
PLAYERS = ("ring", "hunter", "champion")
"""From the weakest to the strongest; learned ones need the extra "train"."""
HANDICAPS = ((1, 19), (3, 17))
OPPONENT = "uniform"


def installed(names: tuple[str, ...], setting: Setting) -> list[str]:
    """Return the players whose dependencies are installed."""
    there = []
    for name in names:
        with contextlib.suppress(MissingExtraError):
            load(name, setting.config)
            there.append(name)
    return there


def longest_behind(histories: list[list[int]], results: list[str], total: int) -> int | None:
    """Return the number of the won game that was behind for the longest; None if none is won."""
    won = [number for number, result in enumerate(results) if result == "win"]
    return max(won, key=lambda number: sum(2 * size < total for size in histories[number]), default=None)


def measure(setting: Setting) -> Finding:
    """Play from behind, as a person and as a program."""
    numbers = setting.games(GAMES)
    configs = {
        f"{own} against {other}": setting.config.replace(drones_per_team=(own, other)) for own, other in HANDICAPS
    }
    rows: list[dict[str, Any]] = []
    shown, parts = {}, []
    for handicap, config in configs.items():
        for way in WAYS:
            best: dict[str, Any] | None = None
            for name in installed(PLAYERS, setting):
                games = play_games(player(name, way, setting), OPPONENT, numbers, seed=setting.seed, config=config)
                row = standing(f"{name}, {way}", games) | {"handicap": handicap}
                rows.append(row)
                if best is None or row["win"] > best["win"]:
                    best = row
                    histories, results = [game.sizes for game in games], [game.outcome for game in games]
            if best is None:
                continue
            ours = way != "person"
            won = [result == "win" for result in results]
            parts.append(seen(f"from {handicap} the best {way} wins", won, ours=ours))
            if not ours:
                number = longest_behind(histories, results, config.num_drones)
                shown[handicap] = None if number is None else histories[number]
    return Finding(
        parts=parts,
        method=f"Wilson over {len(numbers)} games",
        configs=configs,
        seeds=[setting.seed],
        series={"rows": rows, "games": shown, "drones": sum(HANDICAPS[0])},
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the results from each handicap, and a comeback from each."""
    panels = figure.subplots(1, len(HANDICAPS) + 1)
    for axes, handicap in zip(panels, series["games"], strict=False):
        style.bars(axes, [row for row in series["rows"] if row["handicap"] == handicap])
        axes.set(title=f"{handicap}\n", xlabel=f"share of games against {OPPONENT}")
    panels[1].tick_params(labelleft=False)
    right, drones = panels[-1], series["drones"]
    for (handicap, sizes), colour, dash in zip(series["games"].items(), style.SERIES[2:], style.DASHES, strict=False):
        if sizes:
            right.step(range(len(sizes)), sizes, dash, where="post", color=colour, label=f"from {handicap}")
    style.mark(right, drones / 2, "equal teams")
    right.set(xlabel="time (s)", ylabel=f"drones, of {drones}", ylim=(0, drones + 0.5), yticks=range(0, drones + 1, 5))
    right.set_title("longest behind, and won")
    style.legend_below(figure, None, 6)


FIGURE = Figure(
    name="comebacks",
    claim="A game is not over before the last drone is captured: a team that is far behind can still win.",
    section="IV-B",
    quote="One agent, controlled strategically, can be sufficient to build up team size again.",
    note=f"`{PLAYERS[-1]}` and `{PLAYERS[1]}` were trained under the rules `paper`. A person paints their densities "
    f"every {PACE} s.",
    measure=measure,
    draw=draw,
    height=2.6,
    first="From both handicaps `champion` wins more than 5 % of its games.",
    first_held=True,
    revised="The paper says that it is possible, for a person who draws.",
)
