"""A tactic of two commands: surround the centre, then the last opposing drone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, CONTROL_PERIOD, RED, GameConfig, ObservationConfig
from swarm_pz.evaluation.intervals import mean_with_interval, wilson
from swarm_pz.evaluation.rollout import Rollout, game_number, play_games
from swarm_pz.figures import style
from swarm_pz.figures.figure import Figure, Finding, games_as_red
from swarm_pz.simulator.spawn import Seed

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
        # Whole numbers, whose sums do not depend on their order, nor so on how many games are played.
        odd = 2.0 * np.arange(positions.shape[-1]) + 1.0
        weight = 2.0 * len(odd) * np.maximum(positions.sum(axis=(1, 2)), 1.0)
        places = np.stack([positions.sum(axis=axis) @ odd for axis in (1, 2)], axis=1) / weight[:, None]
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


def measure(seed: int) -> Finding:
    """Play the tactic, and the same without its second command, on the same seeds."""
    config, numbers = GameConfig(), games_as_red(GAMES)
    games = play_games(Ensemble(config), OPPONENT, numbers, seed=seed, config=config)
    centre = play_games(Ensemble(config, last=0), OPPONENT, numbers, seed=seed, config=config)
    wins, centre_wins = (np.array([game.outcome == "win" for game in each], np.float64) for each in (games, centre))
    gain, gain_interval = mean_with_interval(wins - centre_wins)
    rate, interval = float(wins.mean()), wilson(int(wins.sum()), GAMES)
    won = [game for game in games if game.outcome == "win"]
    shown = max(won, key=lambda game: last_stand([config.num_drones - size for size in game.sizes]))
    recorder = Recorder()
    numbers = [game_number(shown.pair)]
    Rollout(Ensemble(config), OPPONENT, numbers, seed=seed, config=config).play(after_control_period=recorder)
    places = moments([int(teams.sum()) for teams in recorder.teams])
    return Finding(
        statistic={"win_rate": rate, "win_rate_gained_by_tracking": gain},
        interval={"win_rate": interval, "win_rate_gained_by_tracking": gain_interval},
        method=f"Wilson over {GAMES} games; bootstrap over pairs of games from the same start",
        supported=interval[0] > 0.5,
        seen=f"Against `{OPPONENT}` the tactic wins {len(won)} of {GAMES} games, "
        + ("clearly more" if interval[0] > 0.5 else "not clearly more")
        + " than half; shown is the won game in which the last opposing drone held out for the longest. Without its "
        f"second command it wins {int(centre_wins.sum())}: holding the centre wins these games, and to track the last "
        f"drone changes the win rate by {100 * gain:+.0f} points ({100 * gain_interval[0]:+.0f} to "
        f"{100 * gain_interval[1]:+.0f}).",
        configs={"paper": config},
        seeds=[seed],
        series={"pair": shown.pair, "frames": [_frame(recorder, place) for place in places]},
    )


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


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the four moments."""
    what = ("surround the centre", "half of blue is captured", "one blue drone is left: track it", "won")
    for axes, frame, text in zip(figure.subplots(1, 4), series["frames"], what, strict=True):
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
    style.legend_below(
        figure,
        [
            style.swatch("drone of red (ensemble)", style.TEAMS[RED], marker="o"),
            style.swatch("drone of blue (uniform)", style.TEAMS[BLUE], marker="D"),
            style.swatch("last 5 s", style.GREY, line=1),
            style.swatch("red's command, half of its peak", style.DARK, line=1.3, dash="--"),
            style.swatch("hatched: ground where a team captures", style.GROUND[RED], marker="s"),
        ],
        columns=5,
    )


FIGURE = Figure(
    name="ensemble_tactic",
    title="Surround the centre, then the last drone: a game that is won",
    claim="A swarm is played as an ensemble: two commands, a circle around the centre and then one around the last "
    "opposing drone, win the game.",
    section="IV-A",
    quote="The red player then specifies their swarm to track the remaining blue agent as it "
    "circles along the left side of the environment.",
    paper="The paper shows a game whose player circles the centre and then tracks the last opposing drone.",
    rule="The lower end of the win rate's interval against uniform coverage is above 0.5.",
    measure=measure,
    draw=draw,
    size=(13.0, 4.3),
    seconds=8,
)
