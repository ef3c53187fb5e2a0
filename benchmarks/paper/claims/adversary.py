"""Games of naive players, persons and programs, against uniform coverage."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, Setting, asked, below, estimate, standing
from benchmarks.paper.players import PACE, WAYS, player
from swarm_pz.evaluation.rollout import game_number, play_games

PAIRS = 30
ADVERSARY = "uniform"
NAIVE = ("centre", "chase", "corners", "evade", "noise")
"""Tactics of a player who does not yet reason about the swarm as a whole, chosen before any game was played.

They gather in the middle, fly at the opponents, go to the corners, fly away from the opponents, and scribble. Left out
are tactics that surround (`halo`, `lasso`, `ring`), the wave, which the paper expects of players after many games
(`wavefront`), and two that no person would draw and that isolate effects: a ring that ignores the opponents
(`blind_ring`) and uniform coverage with a trace of noise (`restless`).
"""


def median_win_rate(wins: Any) -> Any:
    """Return the median over players of the share of games won, of wins (pairs, players, 2)."""
    return np.median(np.mean(wins, axis=(0, 2)))


def measure(setting: Setting) -> Finding:
    """Play every naive tactic as a person and as a program, both sides of each pair."""
    config, pairs = setting.config, setting.many(PAIRS)
    numbers = [game_number(pair, side) for pair in range(pairs) for side in ("red", "blue")]
    rows, medians = {}, {}
    for way in WAYS:
        played = {
            name: play_games(player(name, way, setting), ADVERSARY, numbers, seed=setting.seed, config=config)
            for name in NAIVE
        }
        wins = np.array([[game.outcome == "win" for game in played[name]] for name in NAIVE], np.float64)
        medians[way] = estimate(wins.T.reshape(pairs, 2, len(NAIVE)).transpose(0, 2, 1), median_win_rate)
        rows[way] = [standing(name, played[name]) for name in NAIVE]
    parts = [
        asked(f"median won by {len(NAIVE)} {way}s, below half", medians[way], below(0.5), ours=way != "person")
        for way in WAYS
    ]
    return Finding(
        parts=parts,
        method="bootstrap over pairs",
        configs={"rules": config},
        seeds=[setting.seed],
        series={str(way): of for way, of in rows.items()},
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw won, drawn and lost games of every tactic, of a person and of a program."""
    panels = figure.subplots(1, len(series), sharex=True, sharey=True)
    for axes, (way, rows) in zip(panels, series.items(), strict=True):
        style.bars(axes, rows)
        axes.set(title=f"{way}\n", xlabel=f"share of games against {ADVERSARY}")
        axes.label_outer()
    style.legend_below(figure, panels[0])


FIGURE = Figure(
    name="adversary",
    claim="A naive player may find uniform coverage a challenging adversary.",
    section="IV-B",
    quote="an opponent swarm specified by a uniform coverage command across the domain "
    "— with no changes over time — is a challenging adversary",
    note=f"A person paints a script's density every {PACE} s; a program sends it raw every second.",
    measure=measure,
    draw=draw,
    height=2.3,
    first="Under both presets the median of all scripts wins less than half.",
    first_held=False,
    revised="The paper speaks of naive players, so five naive tactics count, as a person draws them.",
)
