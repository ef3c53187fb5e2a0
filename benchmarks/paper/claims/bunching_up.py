"""Whether a team whose drones are close together can be captured all at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.coverage import gaussian
from benchmarks.paper.figure import Figure, Finding, games_as_red
from benchmarks.paper.losses import Losses
from benchmarks.paper.players import Fixed
from swarm_pz.config import RED, GameConfig
from swarm_pz.evaluation.intervals import bootstrap, wilson
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


def is_compact(sigma: float | None) -> bool:
    """Say whether a disc counts as one of a team close together."""
    return sigma is not None and sigma <= COMPACT


def is_spread(sigma: float | None) -> bool:
    """Say whether a disc counts as one of a team that is spread."""
    return sigma is None or sigma >= SPREAD


def measure(seed: int) -> Finding:
    """Let blue hold each disc while red aims at it in each way, from the same starts."""
    config = GameConfig()
    lost, spread = np.zeros((GAMES, len(SIGMAS), len(AIMERS))), np.zeros((GAMES, len(SIGMAS), len(AIMERS)))
    for place, sigma in enumerate(SIGMAS):
        holder = Fixed(disc(sigma, config.command_cells))
        for way, aimer in enumerate(AIMERS):
            rollout = Rollout(aimer, holder, games_as_red(GAMES), seed=seed, config=config)
            place_blue(rollout, disc(sigma, config.command_cells), seed)
            losses = Losses(rollout)
            rollout.play(WATCHED, after_control_period=losses)
            lost[:, place, way], spread[:, place, way] = losses.whole_within(AT_ONCE), losses.spread
    compact, loose = (lost[:, [*map(kind, SIGMAS)]] for kind in (is_compact, is_spread))
    value, low, high = map(float, bootstrap(compact, better_share))
    other, other_low, other_high = map(float, bootstrap(loose, better_share))
    both = np.concatenate([compact, loose], axis=1)
    cut = compact.shape[1]
    gap, gap_low, gap_high = map(
        float, bootstrap(both, lambda drawn: better_share(drawn[:, :cut]) - better_share(drawn[:, cut:]))
    )
    supported = low > LEAST and gap_low > 0
    rows = [
        {
            "sigma": sigma,
            "held": [float(np.nanmedian(one)) if np.isfinite(one).any() else None for one in spread[:, place].T],
            "lost": [int(count) for count in lost[:, place].sum(axis=0)],
            "interval": [wilson(int(count), GAMES) for count in lost[:, place].sum(axis=0)],
        }
        for place, sigma in enumerate(SIGMAS)
    ]
    return Finding(
        statistic={"all_at_once_compact": value, "all_at_once_spread": other, "difference": gap},
        interval={
            "all_at_once_compact": (low, high),
            "all_at_once_spread": (other_low, other_high),
            "difference": (gap_low, gap_high),
        },
        method=f"bootstrap over {GAMES} starts, the same for all; in the picture Wilson's for each disc",
        supported=supported,
        seen=_describe(rows, value, other, supported),
        configs={"paper": config},
        seeds=[seed],
        series={"rows": rows, "games": GAMES},
    )


def _describe(rows: list[dict[str, Any]], compact: float, spread: float, supported: bool) -> str:
    even = rows[-1]
    each = ", ".join(f"{max(row['lost'])} of {GAMES} at {row['sigma']:g}" for row in rows if row["sigma"] is not None)
    return (
        "Blue holds a disc in the centre, and red aims at it by a disc (`chase`) or a ring (`ring`), of which the "
        "better counts. All of blue is lost within "
        f"{AT_ONCE:g} s of its first loss in {each} map widths, and in {max(even['lost'])} where blue covers the whole "
        f"square. Teams that are close together (up to {COMPACT:g}) lose {100 * compact:.0f} % of their games so, "
        f"spread ones (from {SPREAD:g} on) {100 * spread:.1f} %: "
        + ("to bunch up is to risk the game at once." if supported else "close drones are not surely lost at once.")
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
