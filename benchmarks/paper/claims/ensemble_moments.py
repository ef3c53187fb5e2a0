"""Four moments of a game that is won by a tactic of two commands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from swarm_pz.config import BLUE, CONTROL_PERIOD, RED, GameConfig
from swarm_pz.evaluation.rollout import Game, Rollout, game_number
from swarm_pz.policy import Policy

TRAIL = 50
"""Control periods of past that are drawn."""


class Recorder:
    """Keeps one game, a row each control period."""

    def __init__(self) -> None:
        self.positions: list[NDArray[np.float32]] = []
        self.teams: list[NDArray[np.int8]] = []
        self.grounds: list[NDArray[np.bool_]] = []
        self.commands: list[NDArray[np.float64]] = []

    def __call__(self, rollout: Rollout) -> None:
        """Keep the present state."""
        simulator = rollout.simulator
        self.positions.append(simulator.positions[0].copy())
        self.teams.append(simulator.teams[0].copy())
        self.grounds.append(simulator.captures_here[0])
        self.commands.append(simulator.targets[0, RED] / simulator.targets[0, RED].max())


def moments(blue_sizes: Sequence[int]) -> list[int]:
    """Return four places of a won game: near the start, opponents halved, amid the last one's stand, the end."""
    sizes, end = np.asarray(blue_sizes), len(blue_sizes) - 1
    halved = int(np.flatnonzero(sizes <= sizes[0] // 2)[0])
    stand = int(np.flatnonzero(sizes > 1)[-1]) + 1
    return [min(2 * round(1 / CONTROL_PERIOD), halved), halved, (stand + end) // 2, end]


def last_stand(blue_sizes: Sequence[int]) -> int:
    """Return how many steps one drone alone was left, in one go, before the game was won."""
    several = np.flatnonzero(np.asarray(blue_sizes) > 1)
    return len(blue_sizes) - 2 - int(several[-1])


def frames(policy: Policy, opponent: str, game: Game, seed: int, config: GameConfig) -> list[dict[str, Any]]:
    """Play a won game again and return its four moments."""
    recorder = Recorder()
    rollout = Rollout(policy, opponent, [game_number(game.pair)], seed=seed, config=config)
    rollout.play(after_control_period=recorder)
    return [_frame(recorder, place) for place in moments([int(teams.sum()) for teams in recorder.teams])]


def _frame(recorder: Recorder, place: int) -> dict[str, Any]:
    past = np.stack(recorder.positions[max(0, place - TRAIL) : place + 1])
    grounds = [np.argwhere(recorder.grounds[place][team])[:, ::-1].tolist() for team in (RED, BLUE)]
    return {
        "seconds": round(CONTROL_PERIOD * (place + 1), 1),
        "trails": np.round(past, 3).tolist(),
        "teams": recorder.teams[place].tolist(),
        "captured_cells": grounds,
        "command": np.round(recorder.commands[place], 3).tolist(),
    }


def draw(panels: Sequence[Any], shown: Sequence[dict[str, Any]]) -> list[Any]:
    """Draw the moments, and return the legend's entries."""
    what = ("one place in the centre", "half of blue is captured", "one blue drone is left: track it", "won")
    for axes, frame, text in zip(panels, shown, what, strict=True):
        trails, teams = np.array(frame["trails"]), np.array(frame["teams"])
        style.arena(axes, f"{frame['seconds']:.1f} s: {text}\nred {(teams == RED).sum()}, blue {(teams == BLUE).sum()}")
        for team in (RED, BLUE):
            style.captured_ground(axes, frame["captured_cells"][team], team)
        for drone, team in enumerate(teams):
            axes.plot(*trails[:, drone].T, color=style.TEAMS[team], alpha=0.35, linewidth=0.8)
        style.drones(axes, trails[-1], teams)
        cells = (np.arange(len(frame["command"])) + 0.5) / len(frame["command"])
        axes.contour(cells, cells, frame["command"], levels=[0.5], colors=[style.DARK], linestyles="--", linewidths=1.3)
        axes.label_outer()
    return [
        style.swatch("red (the tactic)", style.TEAMS[RED], marker="o"),
        style.swatch("blue (uniform)", style.TEAMS[BLUE], marker="D"),
        style.swatch("last 5 s", style.GREY, line=1),
        style.swatch("red's command, half of its peak", style.DARK, line=1.3, dash="--"),
        style.swatch("hatched: ground where a team captures", style.GROUND[RED], marker="s"),
    ]
