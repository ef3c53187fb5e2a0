"""Whether a team whose drones are close together can be captured all at once."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.coverage import gaussian
from benchmarks.paper.figure import Figure, Finding, estimate, games_as_red
from benchmarks.paper.players import Fixed
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.evaluation.rollout import Rollout

Array = NDArray[np.float64]

GAMES = 50
SIGMAS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, None)
"""Standard deviations of the discs that blue holds, in map widths; None: the whole square alike."""
COMPACT, SPREAD = 0.15, 0.25
"""Up to here a team counts as close together, and from here on as spread."""
AIMERS = ("chase", "ring")
"""How red aims at it: a disc on blue's mean position, and a ring around it."""
AT_ONCE = 5.0
"""Seconds from the first loss to the last that count as at once."""
WATCHED = 60.0
"""Seconds after which a game is left."""
LEAST = 0.1


class Losses:
    """Watches every control period when blue first lost a drone, when it had lost all, and how it stood before.

    `first` and `last` are seconds (E,), infinite for never; `spread` (E,) is the root mean square distance of blue's
    drones from their mean just before the first loss, NaN without one.
    """

    def __init__(self, rollout: Rollout) -> None:
        games = len(rollout.rows)
        self.first, self.last = np.full((2, games), np.inf)
        self.spread = np.full(games, np.nan)
        self._before = rollout.simulator.teams == BLUE
        self._places = rollout.simulator.positions.copy()

    def __call__(self, rollout: Rollout) -> None:
        """Look at all games."""
        simulator = rollout.simulator
        members = simulator.teams == BLUE
        lost = (self._before & ~members).any(axis=1) & np.isinf(self.first)
        for row in np.flatnonzero(lost):
            own = self._places[row, self._before[row]].astype(np.float64)
            self.spread[row] = np.sqrt(((own - own.mean(axis=0)) ** 2).sum(axis=1).mean())
        self.first[lost] = simulator.time_s[lost]
        over = ~members.any(axis=1) & np.isinf(self.last)
        self.last[over] = simulator.time_s[over]
        self._before, self._places = members, simulator.positions.copy()

    def whole_within(self, seconds: float) -> NDArray[np.bool_]:
        """Return which games (E,) blue lost whole, so soon after its first loss."""
        return np.asarray(np.isfinite(self.last) & (self.last <= self.first + seconds + 1e-6))


def disc(sigma: float | None, cells: int) -> Array:
    """Return blue's command (A, A)."""
    density = np.ones((cells, cells)) if sigma is None else gaussian(0.5, 0.5, sigma, cells)
    return np.asarray(density / density.max())


def place_blue(rollout: Rollout, density: Array, seed: int) -> None:
    """Start blue's drones where they will stay, drawn from their target; red's start as ever."""
    cells, first = len(density), rollout.config.team_sizes[RED]
    for row in rollout.rows.tolist():
        generator = np.random.default_rng((seed, row))
        places = rollout.simulator.positions[row].astype(np.float64)
        drawn = generator.choice(cells**2, len(places) - first, p=(density / density.sum()).ravel())
        rows, columns = np.divmod(drawn, cells)
        places[first:] = (np.stack([columns, rows], axis=1) + generator.random((len(rows), 2))) / cells
        rollout.batch.reset([int(generator.integers(2**32))], [row], {"positions": places})


def better_share(at_once: Array) -> Any:
    """Return the share of games lost at once under the better way to aim, of games (starts, discs, aimers)."""
    return np.mean(at_once, axis=(0, 1)).max(axis=-1)


def measure(seed: int) -> Finding:
    """Let blue hold each disc while red aims at it in each way, from the same starts."""
    config = GameConfig()
    lost, spread = np.zeros((2, GAMES, len(SIGMAS), len(AIMERS)))
    for (place, sigma), (way, aimer) in itertools.product(enumerate(SIGMAS), enumerate(AIMERS)):
        command = disc(sigma, config.command_cells)
        rollout = Rollout(aimer, Fixed(command), games_as_red(GAMES), seed=seed, config=config)
        place_blue(rollout, command, seed)
        losses = Losses(rollout)
        rollout.play(WATCHED, after_control_period=losses)
        lost[:, place, way], spread[:, place, way] = losses.whole_within(AT_ONCE), losses.spread
    compact = lost[:, [sigma is not None and sigma <= COMPACT for sigma in SIGMAS]]
    loose = lost[:, [sigma is None or sigma >= SPREAD for sigma in SIGMAS]]
    cut = compact.shape[1]
    numbers = {
        "all_at_once_compact": estimate(compact, better_share),
        "all_at_once_spread": estimate(loose, better_share),
        "difference": estimate(
            np.concatenate([compact, loose], axis=1),
            lambda drawn: better_share(drawn[:, :cut]) - better_share(drawn[:, cut:]),
        ),
    }
    holds = numbers["all_at_once_compact"][1][0] > LEAST and numbers["difference"][1][0] > 0
    rows: list[dict[str, Any]] = [
        {
            "sigma": sigma,
            "held": [float(np.nanmedian(one)) if np.isfinite(one).any() else None for one in spread[:, place].T],
            "lost": (counts := [int(count) for count in lost[:, place].sum(axis=0)]),
            "interval": [wilson(count, GAMES) for count in counts],
        }
        for place, sigma in enumerate(SIGMAS)
    ]
    each = ", ".join(f"{max(row['lost'])} of {GAMES} at {row['sigma']:g}" for row in rows if row["sigma"] is not None)
    tight, even = (100 * numbers[f"all_at_once_{kind}"][0] for kind in ("compact", "spread"))
    return Finding(
        numbers={**numbers},
        method=f"bootstrap over {GAMES} starts, the same for all; in the picture Wilson's for each disc",
        holds=holds,
        seen="Blue holds a disc in the centre, and red aims at it by a disc (`chase`) or a ring (`ring`), of which the "
        f"better counts. All of blue is lost within {AT_ONCE:g} s of its first loss in {each} map widths, and in "
        f"{max(rows[-1]['lost'])} where blue covers the whole square. Close teams (up to "
        f"{COMPACT:g}) lose {tight:.0f} % of their games this way, spread ones (from {SPREAD:g} on) {even:.1f} %: "
        + ("bunching up risks the game." if holds else "close drones are not surely lost at once."),
        configs={"paper": config},
        seeds=[seed],
        series={"rows": rows, "games": GAMES},
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw against the disc's width how often all of blue is lost at once, for both ways to aim."""
    axes, rows, games = figure.subplots(), series["rows"], series["games"]
    places = np.arange(len(rows))
    for way, (aimer, dash, marker) in enumerate(zip(AIMERS, style.DASHES, "oD", strict=False)):
        share = np.array([row["lost"][way] / games for row in rows])
        low, high = np.array([row["interval"][way] for row in rows]).T
        look: dict[str, Any] = {"color": style.SERIES[2 * way], "label": f"red plays {aimer} (95 %)"}
        style.whisker(axes, places + 0.05 * (2 * way - 1), share, low, high, fmt=marker + dash, **look)
    axes.set_xticks(places, ["whole\nsquare" if row["sigma"] is None else f"{row['sigma']:g}" for row in rows])
    axes.set(ylim=(0, 0.02 + max(row["interval"][way][1] for row in rows for way in (0, 1))))
    axes.set(xlabel="standard deviation of the disc that blue holds (map widths)")
    axes.set_ylabel(f"share of {games} games with all of blue\nlost within {AT_ONCE:g} s of its first loss")
    style.legend_below(figure)


FIGURE = Figure(
    name="bunching_up",
    title="All at once: how close together blue's drones are",
    claim="A team whose drones are close together can be captured all at once, and so lose the game.",
    section="IV-B",
    quote="simultaneously capture all the agents on the player's team and win the game",
    paper="The paper warns players of commands that bring all of their drones close to one another.",
    rule=f"Red aims in the better of two ways. Of games against discs with a standard deviation up to {COMPACT:g} "
    f"surely more than {100 * LEAST:.0f} % are lost whole within {AT_ONCE:g} s of the first loss, and surely more than "
    f"against discs from {SPREAD:g} on and the whole square.",
    measure=measure,
    draw=draw,
    size=(8.5, 4.8),
    seconds=8,
    revised="blue flew in from the corners at first, and was caught before it stood in its disc (0.30 map widths "
    "around its mean in place of 0.07), so now it starts there. As it was, 12 % (7 to 17) of the games of teams close "
    "together and none of spread ones were lost whole: surely more, but not surely more than 10 %.",
)
