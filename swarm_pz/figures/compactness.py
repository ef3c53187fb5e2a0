"""Whether a team that bunches up loses more drones."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.batch_env import BatchEnv
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.figures import style
from swarm_pz.figures.finding import Figure, Finding, game_seeds
from swarm_pz.figures.intervals import bootstrap, rank_correlation, rounded
from swarm_pz.figures.playing import play

GAMES = 24
PLAYERS = ("centre", "chase", "halo", "noise", "ring", "uniform", "wavefront")
AHEAD = 5
"""Seconds in which losses are counted, and between two looks at a game."""
FEWEST = 5
"""Drones that a team must have for its spread to say something."""
BINS = 8


def spread_of(positions: NDArray[np.float32], members: NDArray[np.bool_]) -> float:
    """Return the root mean square distance of some drones (N, 2) from their mean position."""
    own = positions[members].astype(np.float64)
    return float(np.sqrt(((own - own.mean(axis=0)) ** 2).sum(axis=1).mean()))


class Watcher:
    """Collects, of every game and both teams, spreads and the share of drones lost soon after."""

    def __init__(self, games: int) -> None:
        self.samples: list[list[tuple[float, float]]] = [[] for _ in range(games)]
        self._before: dict[tuple[int, int], tuple[float, int, int]] = {}
        self._steps = 0

    def __call__(self, batch: BatchEnv, rows: NDArray[np.int64]) -> None:
        """Look at the running games, every few seconds and at their ends."""
        looks = self._steps % AHEAD == 0
        self._steps += 1
        simulator = batch.simulator
        for row, team in itertools.product(rows.tolist(), (RED, BLUE)):
            ended = not batch.running[row]
            if not looks and not ended:
                continue
            lost = int(simulator.games.captures[row, 1 - team])
            before = self._before.pop((row, team), None)
            if before is not None:
                spread, size, lost_before = before
                self.samples[row].append((spread, (lost - lost_before) / size))
            members = simulator.teams[row] == team
            if not ended and members.sum() >= FEWEST:
                self._before[row, team] = (spread_of(simulator.positions[row], members), int(members.sum()), lost)


def binned(games: list[NDArray[np.float64]]) -> dict[str, Any]:
    """Return mean losses in bins of spread that hold equally many samples, with intervals over games."""
    spreads = np.concatenate([game[:, 0] for game in games])
    edges = np.quantile(spreads, np.linspace(0, 1, BINS + 1))
    edges[-1] += 1e-9
    totals = np.zeros((len(games), BINS, 2))
    for number, game in enumerate(games):
        places = np.clip(np.searchsorted(edges, game[:, 0], side="right") - 1, 0, BINS - 1)
        np.add.at(totals[number], places, np.stack([game[:, 1], np.ones(len(game))], axis=1))

    def means(drawn: NDArray[np.float64]) -> NDArray[np.float64]:
        lost, count = drawn.sum(axis=0).T
        return np.asarray(lost / np.maximum(count, 1))

    mean, low, high = bootstrap(totals, means)
    middle = [float(np.median(spreads[(spreads >= a) & (spreads < b)])) for a, b in itertools.pairwise(edges)]
    return {"spread": rounded(middle), "mean": rounded(mean), "low": rounded(low), "high": rounded(high)}


def measure(seed: int) -> Finding:
    """Play everybody against everybody, and look every few seconds."""
    config, games = GameConfig(), []
    seeds = game_seeds(seed, GAMES)
    for red, blue in itertools.combinations(PLAYERS, 2):
        watcher = Watcher(GAMES)
        play(red, blue, seeds, config, watcher)
        games += [np.array(samples) for samples in watcher.samples if samples]
    correlation, interval = rank_correlation(games)
    bins = binned(games)
    supported = interval[1] < 0
    count = sum(map(len, games))
    compact, loose = bins["mean"][0], bins["mean"][-1]
    seen = (
        f"In {len(games)} games of {len(PLAYERS)} scripts, everybody against everybody, {count:,} looks at a team of at least "
        f"{FEWEST}: the most compact eighth loses {100 * compact:.0f} % of its drones within {AHEAD} s, the most spread eighth "
        f"{100 * loose:.0f} %; the rank correlation of losses with spread is {correlation:+.2f}. "
    )
    seen += (
        "A correlation over games of different tactics, not an experiment: spread comes with the tactic."
        if supported
        else "So bunching is not what costs drones in this field: who is compact also owns a strong field where it stands, and "
        "what costs drones is to pass through ground that others surround."
    )
    return Finding(
        statistic={"rank_correlation": correlation, "lost_by_most_compact": compact, "lost_by_most_spread": loose},
        interval={
            "rank_correlation": interval,
            "lost_by_most_compact": (bins["low"][0], bins["high"][0]),
            "lost_by_most_spread": (bins["low"][-1], bins["high"][-1]),
        },
        method="bootstrap over games",
        supported=supported,
        seen=seen,
        configs={"paper": config},
        seeds=seeds,
        series={**bins, "looks": count, "games": len(games)},
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw losses against spread."""
    axes = figure.subplots()
    spread = np.array(series["spread"])
    values = [100 * np.array(series[key]) for key in ("mean", "low", "high")]
    style.whisker(axes, spread, *values, fmt="o-", color=style.SERIES[2], label="mean and 95 % interval over games")
    uniform = np.sqrt(1 / 6)
    style.mark(axes, uniform, "spread of an even cover", upright=True)
    axes.set(
        xlabel="spread of the team now: rms distance from its mean position (map widths)",
        ylabel=f"drones lost in the next {AHEAD} s (% of the team)",
        xlim=(0, max(0.5, spread[-1] + 0.03)),
        ylim=(0, None),
    )
    axes.annotate("compact", (0.01, 0.02), xycoords="axes fraction", color=style.GREY)
    axes.annotate("spread out", (0.99, 0.02), xycoords="axes fraction", color=style.GREY, ha="right")
    axes.set_title(f"{series['looks']:,} looks in {series['games']} games, in eight bins of equally many\n")
    style.legend_below(figure)


FIGURE = Figure(
    name="compactness",
    title="Losses against compactness",
    claim="Bunching up is a risk: a compact team loses more drones.",
    paper="The paper warns that drones which bunch up are captured together.",
    rule="The rank correlation of spread with the share of drones lost in the next 5 s is negative, with its whole interval.",
    measure=measure,
    draw=draw,
    size=(7.5, 4.6),
    seconds=35,
)
