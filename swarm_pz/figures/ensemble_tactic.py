"""A tactic of two commands: surround the centre, then the last opposing drone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.batch_env import BatchEnv
from swarm_pz.config import BLUE, CONTROL_PERIOD, RED, GameConfig, ObservationConfig
from swarm_pz.figures import style
from swarm_pz.figures.finding import Figure, Finding, game_seeds
from swarm_pz.figures.intervals import mean_with_interval, wilson
from swarm_pz.figures.playing import outcomes, play
from swarm_pz.scenario import Seed

GAMES = 100
OPPONENT = "uniform"
TRAIL = 50
"""Control periods of past that are drawn."""


class Ensemble:
    """Make a broad ring around the centre; once few opposing drones are left, a ring around them.

    Parameters
    ----------
    config : GameConfig
    last : int
        Opposing drones from which on they are tracked; 0 never leaves the centre.
    """

    name = "ensemble"
    observation = ObservationConfig(grid=25, channels=("opposing_positions", "own_share"))

    def __init__(self, config: GameConfig, last: int = 1) -> None:
        self._most = 1.0 - (last + 0.5) / config.num_drones
        self._centres = (np.arange(config.command_cells) + 0.5) / config.command_cells

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin games; nothing is remembered."""

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Answer n observations with densities (n, A, A)."""
        positions, share = observations[:, 0].astype(np.float64), observations[:, 1, 0, 0] / 255
        centres = (np.arange(positions.shape[-1]) + 0.5) / positions.shape[-1]
        weight = np.maximum(positions.sum(axis=(1, 2)), 1.0)
        places = np.stack([positions.sum(axis=axis) @ centres for axis in (1, 2)], axis=1) / weight[:, None]
        tracks = share > self._most
        aim = np.where(tracks[:, None], places, 0.5)
        offset = self._centres[None, :] - aim[:, :, None]
        distance = np.hypot(offset[:, 0, None, :], offset[:, 1, :, None])
        radius, width = np.where(tracks, 0.2, 0.25), np.where(tracks, 0.08, 0.15)
        return np.asarray(np.exp(-(((distance - radius[:, None, None]) / width[:, None, None]) ** 2)))


class Recorder:
    """Keeps one game, a row each control period."""

    def __init__(self) -> None:
        self.positions: list[NDArray[np.float32]] = []
        self.teams: list[NDArray[np.int8]] = []
        self.grounds: list[NDArray[np.bool_]] = []

    def __call__(self, batch: BatchEnv) -> None:
        """Keep the present state."""
        self.positions.append(batch.simulator.positions[0].copy())
        self.teams.append(batch.simulator.teams[0].copy())
        self.grounds.append(batch.simulator.captures_here[0])


def moments(blue_sizes: Sequence[int]) -> list[int]:
    """Return four places of a won game: soon after the start, opponents halved, one left for good, the end."""
    sizes = np.asarray(blue_sizes)
    several = np.flatnonzero(sizes > 1)
    halved = int(np.flatnonzero(sizes <= sizes[0] // 2)[0])
    return [min(2 * round(1 / CONTROL_PERIOD), halved), halved, int(several[-1]) + 1, len(sizes) - 1]


def typical_win(results: Sequence[str], seconds: NDArray[np.float64]) -> int:
    """Return the number of the won game of median length."""
    won = [row for row, result in enumerate(results) if result == "win"]
    return sorted(won, key=lambda row: float(seconds[row]))[len(won) // 2]


def measure(seed: int) -> Finding:
    """Play the tactic, and the same without its second command, on the same seeds."""
    config, seeds = GameConfig(), game_seeds(seed, GAMES)
    batch, alone = (play(Ensemble(config, last), OPPONENT, seeds, config) for last in (1, 0))
    results = outcomes(batch)
    wins = np.array([result == "win" for result in results], np.float64)
    gain, gain_interval = mean_with_interval(wins - np.array([result == "win" for result in outcomes(alone)]))
    rate, interval = float(wins.mean()), wilson(int(wins.sum()), GAMES)
    row = typical_win(results, batch.simulator.time_s)
    recorder = Recorder()
    play(Ensemble(config), OPPONENT, seeds[row : row + 1], config, animate=recorder)
    places = moments([int(teams.sum()) for teams in recorder.teams])
    verdict = "more than half" if interval[0] > 0.5 else "not clearly more than half"
    return Finding(
        statistic={"win_rate": rate, "win_rate_gained_by_tracking": gain},
        interval={"win_rate": interval, "win_rate_gained_by_tracking": gain_interval},
        method=f"Wilson over {GAMES} games; bootstrap over pairs of games from the same start",
        supported=interval[0] > 0.5,
        seen=f"Against `{OPPONENT}` the tactic wins {wins.sum():.0f} of {GAMES} games, {verdict}; shown is the won game of "
        f"median length. To hold the centre and never leave it wins {100 * gain:+.0f} points less "
        f"({100 * gain_interval[0]:+.0f} to {100 * gain_interval[1]:+.0f}): the centre wins these games, "
        + ("and tracking the last drone helps." if gain_interval[0] > 0 else "tracking the last drone does not help."),
        configs={"paper": config},
        seeds=seeds,
        series={"game": seeds[row], "frames": [_frame(recorder, place) for place in places]},
    )


def _frame(recorder: Recorder, place: int) -> dict[str, Any]:
    past = np.stack(recorder.positions[max(0, place - TRAIL) : place + 1])
    grounds = [np.argwhere(recorder.grounds[place][team])[:, ::-1].tolist() for team in (RED, BLUE)]
    return {
        "seconds": round(CONTROL_PERIOD * (place + 1), 1),
        "trails": np.round(past, 3).tolist(),
        "teams": recorder.teams[place].tolist(),
        "captured_cells": grounds,
    }


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the four moments."""
    what = ("surround the centre", "half of blue is captured", "one blue drone is left: track it", "won")
    for axes, frame, text in zip(figure.subplots(1, 4), series["frames"], what, strict=True):
        trails, teams = np.array(frame["trails"]), np.array(frame["teams"])
        style.arena(axes, f"{frame['seconds']:.1f} s: {text}\nred {(teams == RED).sum()}, blue {(teams == BLUE).sum()}")
        for team in (RED, BLUE):
            style.captured_ground(axes, np.array(frame["captured_cells"][team]), team)
        for drone, team in enumerate(teams):
            axes.plot(*trails[:, drone].T, color=style.TEAMS[team], alpha=0.35, linewidth=0.8)
        style.drones(axes, trails[-1], teams)
        axes.label_outer()
    style.legend_below(
        figure,
        [
            style.swatch("drone of red (ensemble)", style.TEAMS[RED], marker="o"),
            style.swatch("drone of blue (uniform)", style.TEAMS[BLUE], marker="D"),
            style.swatch("last 5 s", style.GREY, line=1),
            style.swatch("hatched: ground where a team captures", style.GROUND[RED], marker="s"),
        ],
    )


FIGURE = Figure(
    name="ensemble_tactic",
    title="Surround the centre, then the last drone: a game that is won",
    claim="A swarm is played as an ensemble: two commands, a circle around the centre and then one around the last opposing "
    "drone, win the game.",
    paper="The paper shows a game whose player circles the centre and then tracks the last opposing drone.",
    rule="The lower end of the win rate's interval against uniform coverage is above 0.5.",
    measure=measure,
    draw=draw,
    size=(13.0, 4.3),
    seconds=16,
)
