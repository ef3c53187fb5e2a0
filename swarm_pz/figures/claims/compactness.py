"""Whether a team that bunches up loses more drones."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.evaluation.intervals import bootstrap, rank_correlation, rounded
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.figures import style
from swarm_pz.figures.figure import Figure, Finding, games_as_red

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
        self._before: dict[tuple[int, int], tuple[float, NDArray[np.bool_], int]] = {}
        self._steps = 0

    def __call__(self, rollout: Rollout) -> None:
        """Look at the running games, every few seconds and at their ends."""
        looks = self._steps % AHEAD == 0
        self._steps += 1
        games = rollout.simulator.games
        for row, team in itertools.product(rollout.rows.tolist(), (RED, BLUE)):
            ended = not rollout.batch.running[row]
            if not looks and not ended:
                continue
            before = self._before.pop((row, team), None)
            if before is not None:
                spread, members, tick = before
                self.samples[row].append((spread, float((games.capture_ticks[row, members] > tick).mean())))
            members = games.teams[row] == team
            if not ended and members.sum() >= FEWEST:
                self._before[row, team] = (spread_of(games.positions[row], members), members, int(games.ticks[row]))


def binned(games: list[NDArray[np.float64]]) -> dict[str, Any]:
    """Return what teams lose in bins of spread that hold equally many looks, with intervals over games.

    Returns
    -------
    dict
        ``spread``, the median in each bin; ``lost``, the mean share of drones, and ``half``, the share of
        looks after which at least half of the team is lost, each with ``mean``, ``low`` and ``high``.
    """
    spreads = np.concatenate([game[:, 0] for game in games])
    edges = np.quantile(spreads, np.linspace(0, 1, BINS + 1))
    edges[-1] += 1e-9
    totals = np.zeros((len(games), BINS, 3))
    for number, game in enumerate(games):
        places = np.clip(np.searchsorted(edges, game[:, 0], side="right") - 1, 0, BINS - 1)
        np.add.at(totals[number], places, np.stack([game[:, 1], game[:, 1] >= 0.5, np.ones(len(game))], axis=1))

    def means(drawn: NDArray[np.float64]) -> NDArray[np.float64]:
        *sums, count = drawn.sum(axis=0).T
        return np.asarray(sums / np.maximum(count, 1))

    middle = [float(np.median(spreads[(spreads >= a) & (spreads < b)])) for a, b in itertools.pairwise(edges)]
    found = [rounded(part) for part in bootstrap(totals, means)]
    parts = {
        name: dict(zip(("mean", "low", "high"), (part[place] for part in found), strict=True))
        for place, name in enumerate(("lost", "half"))
    }
    return {"spread": rounded(middle), **parts}


def measure(seed: int) -> Finding:
    """Play everybody against everybody, and look every few seconds."""
    config, games = GameConfig(), []
    for red, blue in itertools.combinations(PLAYERS, 2):
        watcher = Watcher(GAMES)
        rollout = Rollout(red, blue, games_as_red(GAMES), seed=seed, config=config)
        watcher(rollout)
        rollout.play(after_step=watcher)
        games += [np.array(samples) for samples in watcher.samples if samples]
    correlation, interval = rank_correlation(games)
    bins = binned(games)
    supported = interval[1] < 0
    count = sum(map(len, games))
    return Finding(
        statistic={"rank_correlation": correlation} | {name: bins[key]["mean"][place] for name, key, place in _ENDS},
        interval={"rank_correlation": interval}
        | {name: (bins[key]["low"][place], bins[key]["high"][place]) for name, key, place in _ENDS},
        method="bootstrap over games",
        supported=supported,
        seen=_describe(bins, correlation, len(games), count, supported),
        configs={"paper": config},
        seeds=[seed],
        series={**bins, "looks": count, "games": len(games)},
    )


_ENDS = (
    ("lost_by_most_compact", "lost", 0),
    ("lost_by_most_spread", "lost", -1),
    ("half_lost_by_most_compact", "half", 0),
    ("half_lost_by_most_spread", "half", -1),
)


def _describe(bins: dict[str, Any], correlation: float, games: int, looks: int, supported: bool) -> str:
    compact, loose, compact_half, loose_half = (100 * bins[key]["mean"][place] for _, key, place in _ENDS)
    return (
        f"In {games} games of {len(PLAYERS)} scripts, everybody against everybody, {looks:,} looks at a team of at "
        f"least {FEWEST}: within {AHEAD} s the most compact eighth loses {compact:.0f} % of its drones and the most "
        f"spread eighth {loose:.0f} %; after {compact_half:.0f} % and {loose_half:.0f} % of these looks at least half "
        f"of the team is gone. The rank correlation of losses with spread is {correlation:+.2f}"
        + (
            ": the more compact, the more is lost. "
            if supported
            else ", so it is not so that the more compact a team is, the more it loses. "
        )
        + (
            "What does hold is that it loses half of its drones at once more often. "
            if bins["half"]["low"][0] > bins["half"]["high"][-1] and not supported
            else ""
        )
        + "This is a field of tactics, not an experiment: spread comes with the tactic."
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw against spread what is lost, and how often half of the team is."""
    panels = figure.subplots(1, 2)
    texts = (
        ("lost", f"drones captured in the next {AHEAD} s (% of the team)", "mean loss"),
        ("half", f"looks with half of the team lost in {AHEAD} s (%)", "how often it is a disaster"),
    )
    spread = np.array(series["spread"])
    for axes, (name, label, title) in zip(panels, texts, strict=True):
        values = [100 * np.array(series[name][key]) for key in ("mean", "low", "high")]
        style.whisker(axes, spread, *values, fmt="o-", color=style.SERIES[2], label="mean of a bin, 95 % over games")
        axes.set(ylabel=label, title=f"{title}\n", xlim=(0, max(0.5, spread[-1] + 0.03)), ylim=(0, None))
        axes.set_xlabel("spread now: rms distance from the team's mean position (map widths)")
        style.mark(axes, np.sqrt(1 / 6), "an even cover", upright=True)
        axes.annotate("compact", (0.01, 0.02), xycoords="axes fraction", color=style.GREY)
        axes.annotate("spread out", (0.99, 0.02), xycoords="axes fraction", color=style.GREY, ha="right")
    note = f"mean of an eighth of {series['looks']:,} looks at teams in {series['games']} games, 95 % over games"
    style.legend_below(figure, [style.swatch(note, style.SERIES[2], marker="o", line=1.5)])


FIGURE = Figure(
    name="compactness",
    title="Losses against compactness",
    claim="Bunching up is a risk: a compact team loses more drones.",
    section="IV-B",
    quote="simultaneously capture all the agents on the player's team and win the game",
    paper="The paper warns that drones which bunch up are captured together.",
    rule="The rank correlation of spread with the share of drones lost in the next 5 s is negative, with its whole "
    "interval.",
    measure=measure,
    draw=draw,
    size=(11.0, 4.4),
    seconds=18,
)
