"""One game as curves, to see why a tactic works: sizes, captures, coverage and commands over time."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, TEAM_NAMES, GameConfig
from swarm_pz.errors import RenderError, require_extra
from swarm_pz.evaluation.rollout import Rollout, game_number
from swarm_pz.policy import Player
from swarm_pz.rendering.board import INK, SHADE_COLOURS, TEAM_COLOURS
from swarm_pz.simulator.ergodicity import ErgodicMetric

WINDOW_S = 5.0
"""Seconds of a team's latest past that are compared with its target."""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """What happened in one game, at the start and after every control period: T moments, red and blue.

    Attributes
    ----------
    names : (str, str)
        Policies of red and blue.
    seed, pair : int
    side : {"red", "blue"}
        Which game of which match: its seed, the pair, and whose drones the policy commands.
    result : str
        "red won", "blue won", "a draw" or "unfinished".
    config : GameConfig
    times : float64 array (T,)
        Seconds.
    sizes : int64 array (T, 2)
        Drones.
    captures, recaptures : int64 array (T, 2)
        Drones taken in the control period that ends there, and how many of these the team had itself lost
        within the last second.
    metric, latest_metric : float64 array (T, 2)
        Ergodic metric of the team's true past since the start, and of the last `WINDOW_S`, against its
        target in force; NaN where there is no past.
    entropy_bits : float64 array (T, 2)
        Of the target in force as a distribution over the command's cells.
    """

    names: tuple[str, str]
    seed: int
    pair: int
    side: str
    result: str
    config: GameConfig
    times: NDArray[np.float64]
    sizes: NDArray[np.int64]
    captures: NDArray[np.int64]
    recaptures: NDArray[np.int64]
    metric: NDArray[np.float64]
    latest_metric: NDArray[np.float64]
    entropy_bits: NDArray[np.float64]

    @property
    def effective_share(self) -> NDArray[np.float64]:
        """(T, 2) 2^entropy over the number of cells: the share of the square that a target is spread over."""
        return np.asarray(2.0**self.entropy_bits / self.config.command_cells**2)

    @property
    def title(self) -> str:
        """The result in a sentence."""
        (red, blue), seconds = self.sizes[-1], self.times[-1]
        players = [f"{name} ({team})" for name, team in zip(self.names, TEAM_NAMES, strict=True)]
        if self.result in ("red won", "blue won"):
            winner, loser = players if self.result == "red won" else players[::-1]
            return f"{winner} beat {loser} in {seconds:.1f} s"
        end = "drew" if self.result == "a draw" else "had not finished"
        return f"{players[0]} and {players[1]} {end} after {seconds:.1f} s, {red} drones to {blue}"

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain values, ready for JSON; null where there is no value."""
        series: dict[str, NDArray[Any]] = {
            "sizes": self.sizes,
            "captures": self.captures,
            "recaptures": self.recaptures,
            "ergodic_metric": self.metric,
            "latest_ergodic_metric": self.latest_metric,
            "command_entropy_bits": self.entropy_bits,
            "command_effective_share": self.effective_share,
        }
        return {
            "red": self.names[0],
            "blue": self.names[1],
            "seed": self.seed,
            "pair": self.pair,
            "side": self.side,
            "result": self.result,
            "config_hash": self.config.hash,
            "rules_hash": self.config.rules_hash,
            "window_s": WINDOW_S,
            "times_s": _plain(self.times),
            **{
                name: {team: _plain(values[:, place]) for place, team in enumerate(TEAM_NAMES)}
                for name, values in series.items()
            },
        }


def diagnose(
    policy: str | Player,
    opponent: str | Player,
    *,
    config: GameConfig | None = None,
    seed: int = 0,
    pair: int = 0,
    side: str = "red",
    seconds: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Diagnosis:
    """Play one game of a match and keep its curves.

    Parameters
    ----------
    policy, opponent : str or Policy
    config : GameConfig, optional
    seed : int
        Of the match.
    pair : int
    side : {"red", "blue"}
        Which game of the pair: whose drones the policy commands.
    seconds : float, optional
        Play until the step in which so many are over; all of the game if not given.
    progress : callable, optional
        Called with the seconds of game played so far.

    Raises
    ------
    RenderError
        If seconds are not above 0.
    PolicyError
        If a policy is unknown or answers nonsense.
    """
    if seconds is not None and (isinstance(seconds, bool) or not 0 < seconds < math.inf):
        raise RenderError(f"seconds must be a number above 0, got {seconds!r}")
    moments: list[dict[str, Any]] = []

    def note(game: Rollout) -> None:
        simulator = game.simulator
        moments.append({
            "times": float(simulator.time_s[0]),
            "sizes": simulator.sizes[0],
            "captures": simulator.games.captures[0].copy(),
            "recaptures": simulator.games.recaptures[0].copy(),
            "metric": [past.value()[0] for past in pasts],
            "latest_metric": [past.value()[0] for past in latest],
            "entropy_bits": [_entropy_bits(target) for target in simulator.targets[0]],
        })  # fmt: skip

    def look(game: Rollout) -> None:
        for past in (*pasts, *latest):
            past.observe()
        note(game)

    def report(game: Rollout) -> None:
        if progress is not None:
            progress(float(game.simulator.time_s[0]))

    with closing(Rollout(policy, opponent, [game_number(pair, side)], seed=seed, config=config)) as game:
        pasts = [ErgodicMetric(game.simulator, team) for team in range(2)]
        latest = [ErgodicMetric(game.simulator, team, round(WINDOW_S / CONTROL_PERIOD)) for team in range(2)]
        note(game)
        game.play(seconds, after_control_period=look, after_step=report)
    curves = {name: np.array([moment[name] for moment in moments]) for name in moments[0]}
    for name in ("captures", "recaptures"):
        curves[name] = np.diff(curves[name], axis=0, prepend=0)
    return Diagnosis(
        names=game.names(), seed=seed, pair=pair, side=side, result=game.result(), config=game.config, **curves
    )


def _entropy_bits(target: NDArray[np.float64]) -> float:
    """Return the entropy of a distribution (A, A)."""
    shares = target[target > 0.0]
    return float(-(shares * np.log2(shares)).sum())


def _plain(values: NDArray[Any]) -> list[Any]:
    """Return values as a list for JSON, which knows no NaN."""
    if np.issubdtype(values.dtype, np.integer):
        return list(values.tolist())
    return [round(value, 8) if math.isfinite(value) else None for value in values.tolist()]


def plot(diagnosis: Diagnosis, path: Path) -> None:
    """Draw the curves of a game, one below the other.

    Of the two ergodic metrics only the latest one is drawn: against a target that moves, the whole past
    tells how far the target has moved rather than how well the team follows it.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    figure = require_extra("matplotlib.figure", "cli").Figure(figsize=(9.0, 10.5), layout="constrained")
    integers = require_extra("matplotlib.ticker", "cli").MaxNLocator
    panels = figure.subplots(4, 1, sharex=True, height_ratios=[1.0, 0.8, 1.0, 0.8])
    sizes, captures, metric, command = panels
    for team in range(2):
        style = {"color": _hex(TEAM_COLOURS[team]), "linewidth": 1.8}
        label = f"{TEAM_NAMES[team]}: {diagnosis.names[team]}"
        sizes.step(diagnosis.times, diagnosis.sizes[:, team], where="post", label=label, **style)
        _plot_captures(captures, diagnosis, team)
        metric.plot(diagnosis.times, diagnosis.latest_metric[:, team], **style)
        # A moment's target is the one of the control period that ends there; at the start there was none.
        command.step(diagnosis.times[1:], diagnosis.effective_share[1:, team], where="pre", **style)
    sizes.set(ylabel="drones", ylim=(-0.5, diagnosis.config.num_drones + 0.5))
    captures.axhline(0.0, color=_hex(INK), linewidth=0.8)
    captures.set(ylabel="captures in 0.1 s")
    captures.yaxis.set_major_formatter(lambda value, _: f"{abs(value):.0f}")
    metric.set(yscale="log", ylabel="ergodic metric")
    command.set(ylabel="effective share of the square", ylim=(0.0, 1.05), xlabel="time in s")
    command.set_xlim(0.0, 1.01 * diagnosis.times[-1])
    for axes in (sizes, captures):
        axes.yaxis.set_major_locator(integers(integer=True, min_n_ticks=2))
    titles = (
        "Team sizes",
        "Captures: red's up, blue's down; rings: with drones lost within the last second",
        f"How far each team's last {WINDOW_S:g} s are from its target (0: covered exactly as asked)",
        "How widely each command is spread (1: uniform)",
    )
    for axes, title in zip(panels, titles, strict=True):
        axes.set_title(title, loc="left", fontsize=10)
        axes.grid(alpha=0.3)
    sizes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, borderpad=0.1)
    figure.suptitle(f"{diagnosis.title} (seed {diagnosis.seed}, pair {diagnosis.pair})", fontsize=13)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)


def _plot_captures(axes: Any, diagnosis: Diagnosis, team: int) -> None:
    """Draw a line for the captures of each control period, and a ring on those that hold recaptures."""
    heights = (1, -1)[team] * diagnosis.captures[:, team]
    some, again = heights != 0, diagnosis.recaptures[:, team] > 0
    axes.vlines(diagnosis.times[some], 0, heights[some], color=_hex(TEAM_COLOURS[team]), linewidth=1.6)
    ring = {"markerfacecolor": "white", "markeredgecolor": _hex(SHADE_COLOURS[team]), "markersize": 5}
    axes.plot(diagnosis.times[again], heights[again], "o", **ring)


def _hex(colour: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)
