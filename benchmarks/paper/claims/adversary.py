"""How hard uniform coverage is to beat for a naive player, each second and at a person's cadence."""

from __future__ import annotations

import itertools
from typing import Any, cast

import numpy as np

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, Number, estimate, standing
from benchmarks.paper.players import Held
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.rollout import Game, game_number, play_games
from swarm_pz.policy import Policy, load

PAIRS = 30
ADVERSARY = "uniform"
NAIVE = ("centre", "chase", "corners", "evade", "noise")
"""What somebody does who does not reason about the swarm as a whole yet, named before any game was played.

Gather in the middle; fly at the opponents; go to the corners; fly away from the opponents; scribble. Left out are those
that know that surrounding captures (`halo`, `lasso`, `ring`), the wave, which the paper expects of players after many
games (`wavefront`), and two that no person would draw, made to tell effects apart: a ring that does not look
(`blind_ring`) and uniform coverage with a trace of noise (`restless`).
"""
VARIANTS = ("paper", "released")
CADENCES = (1, 3)
"""Seconds between two commands: a program's, and about a person's."""


def median_win_rate(wins: Any) -> Any:
    """Return the median over players of the share of games won, of wins (pairs, players, 2)."""
    return np.median(np.mean(wins, axis=(0, 2)))


def play(name: str, seconds: int, seed: int, config: GameConfig) -> list[Game]:
    """Play a script that gives a command every so many seconds against uniform coverage, both sides of each pair."""
    player = cast("Policy", load(name, config))  # scripts are
    numbers = [game_number(pair, side) for pair in range(PAIRS) for side in ("red", "blue")]
    return play_games(Held(player, seconds), ADVERSARY, numbers, seed=seed, config=config)


def measure(seed: int) -> Finding:
    """Play every naive tactic at both cadences under both sets of rules."""
    numbers: dict[str, Number] = {}
    series, parts, said = {}, {}, []
    configs = {name: GameConfig.preset(name) for name in VARIANTS}
    for (variant, config), seconds in itertools.product(configs.items(), CADENCES):
        played = {name: play(name, seconds, seed, config) for name in NAIVE}
        wins = np.array([[game.outcome == "win" for game in played[name]] for name in NAIVE], np.float64)
        by_pair = wins.T.reshape(PAIRS, 2, len(NAIVE)).transpose(0, 2, 1)
        value, (low, high) = estimate(by_pair, median_win_rate)
        numbers[f"median_win_rate_{variant}_every_{seconds}_s"] = value, (low, high)
        part = f"`{variant}`, a command every {f'{seconds} s' if seconds > 1 else 'second'}"
        parts[part] = high < 0.5
        series[part] = [standing(name, played[name]) for name in NAIVE]
        verdict = "a challenge" if high < 0.5 else "none" if low > 0.5 else "not surely one"
        above = [f"`{row['policy']}`" for row in series[part] if row["win_ci95"][0] > 0.5]
        more = f"; {', '.join(above)} win{'s' * (len(above) == 1)} clearly more than half" if above else ""
        said.append(f"Rules {part}: {100 * value:.0f} %, so uniform coverage is {verdict}{more}.")
    return Finding(
        numbers=numbers,
        method=f"bootstrap over {PAIRS} pairs of games, sides swapped; in the picture Wilson's for each player",
        holds=parts,
        seen=f"The median share that {len(NAIVE)} naive tactics win, of {2 * PAIRS} games each. {' '.join(said)}",
        configs=configs,
        seeds=[seed],
        series=series,
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw won, drawn and lost games of every tactic, by rules and cadence."""
    panels = figure.subplots(len(VARIANTS), len(CADENCES), squeeze=False).ravel()
    for axes, (part, rows) in zip(panels, series.items(), strict=True):
        style.bars(axes, rows)
        axes.set(xlabel=f"share of games against {ADVERSARY}", title="rules: " + part.replace("`", "") + "\n")
        axes.label_outer()
    style.legend_below(figure, panels[0])


FIGURE = Figure(
    name="adversary",
    title="Naive tactics against uniform coverage",
    claim="A naive player may find uniform coverage a challenging adversary.",
    section="IV-B",
    quote="an opponent swarm specified by a uniform coverage command across the domain "
    "— with no changes over time — is a challenging adversary",
    paper="The paper says so of people who have not yet learned to reason about a swarm as a whole.",
    rule="Under each set of rules, and with a command every second as well as every 3 s, the median win rate of "
    f"{len(NAIVE)} naive tactics named beforehand ({', '.join(NAIVE)}) is below one half, with its whole interval.",
    measure=measure,
    draw=draw,
    size=(10.5, 6.2),
    seconds=80,
)
