"""Effects of a least airspeed on teams that rest, for three accelerations, as a table and a picture.

At speed v and acceleration a, a drone turns with radius v² / a. Rows in the table are not played again, so a stopped
sweep continues. docs/parking.md explains the criteria.

python -m benchmarks.least_airspeed --games 20 --preset-games 100
"""

from __future__ import annotations

import argparse
import csv
import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.csv_table import write_csv
from benchmarks.parking import Side, play
from swarm_pz.config import ControllerConfig, DynamicsConfig, GameConfig
from swarm_pz.rendering.plots import GREY, drawing

DOCS = Path(__file__).parents[1] / "docs"
PRESET = (GameConfig.preset("fixed_wing").dynamics.min_speed, GameConfig().controller.max_acceleration)
SPEEDS = (0.0, 0.15, 0.2, 0.3, 0.4, 0.5)
ACCELERATIONS = (0.5, 1.0, 2.0)
UNIFORM, VETERAN = Side(player="uniform"), Side(player="veteran")
ORDER = (Side(player="noise"), UNIFORM, Side(player="ring"), Side(player="halo"), VETERAN)
"""Players in order: each should take more points from `uniform` than those before; the first two may be even."""
RESTING = (
    Side(player="hold", system="formation"),
    Side(player="hold", system="potential_field"),
    Side(player="uniform", system="coverage"),
)
PAIRINGS = [(one, UNIFORM) for one in (*ORDER, *RESTING)] + [(VETERAN, one) for one in RESTING]


class Row(NamedTuple):
    """A row of the table: a setting, a pairing, and the results of its first side."""

    speed: float
    acceleration: float
    first: str
    second: str
    games: int
    won: int
    drawn: int
    lost: int
    seconds: int

    @property
    def wins(self) -> float:
        """The percentage of games that the first won."""
        return 100.0 * self.won / (self.won + self.drawn + self.lost)

    @property
    def points(self) -> float:
        """The first's percentage of the points, a draw being half a win."""
        return self.wins + 50.0 * self.drawn / (self.won + self.drawn + self.lost)


HEAD = ("least airspeed", "acceleration", *Row._fields[2:-1], "median length, s")
Table = dict[tuple[Any, ...], Row]
"""Rows by setting and pairing."""


def read(path: Path) -> Table:
    """Return the rows of the table; none if there is no file."""
    if not path.exists():
        return {}
    with path.open(newline="") as file:
        rows = list(csv.reader(file))[1:]
    table = [Row(float(row[0]), float(row[1]), row[2], row[3], *map(int, row[4:])) for row in rows]
    return {row[:4]: row for row in table}


def sweep(table: Table, path: Path, games: int, preset_games: int) -> None:
    """Play the rows that the table lacks, the preset's first, and write the table after each."""
    settings = sorted(itertools.product(SPEEDS, ACCELERATIONS), key=lambda at: (at != PRESET, at[1] != PRESET[1], at))
    for (speed, acceleration), (first, second) in itertools.product(settings, PAIRINGS):
        key = (speed, acceleration, first.name, second.name)
        count = preset_games if (speed, acceleration) == PRESET else games
        if key in table and table[key].games >= count:
            continue
        played = play(
            first,
            second,
            count,
            dynamics=DynamicsConfig(min_speed=speed),
            controller=ControllerConfig(max_acceleration=acceleration),
        )
        won, drawn, lost = (sum(game.outcome == outcome for game in played) for outcome in ("win", "draw", "loss"))
        table[key] = Row(*key, count, won, drawn, lost, round(float(np.median([game.seconds for game in played]))))
        print(*table[key], sep=", ", flush=True)
        write_csv(path, [HEAD, *(table[key] for key in sorted(table))])


def print_criteria(table: Table) -> None:
    """Print whether teams that rest gain little, whether a learned player beats them, and the order of the others."""
    print(
        "speed, acceleration: most wins of a resting team; its shortest median, halo's; veteran's fewest points; order"
    )
    for at in itertools.product(SPEEDS, ACCELERATIONS):
        if any((*at, first.name, second.name) not in table for first, second in PAIRINGS):
            continue
        against = {one.name: table[*at, one.name, UNIFORM.name] for one in (*ORDER, *RESTING)}
        wins = max(against[one.name].wins for one in RESTING)
        soonest, halo = min(against[one.name].seconds for one in RESTING), against["halo"].seconds
        fewest = min(table[*at, VETERAN.name, one.name].points for one in RESTING)
        points = [against[one.name].points for one in ORDER]
        rises = points[0] <= points[1] and all(low < high for low, high in itertools.pairwise(points[1:]))
        marks = " rises" * rises + "; all hold" * (rises and wins <= 90 and soonest >= halo and fewest >= 80)
        print(
            f"{at[0]:4g}, {at[1]:3g}: {wins:3.0f} %; {soonest} s, {halo} s; {fewest:3.0f} %; "
            + " ".join(f"{one:.0f}" for one in points)
            + marks
        )


def draw(table: Table, path: Path) -> None:
    """Draw the criteria over the least airspeed at the preset's acceleration, against `uniform` except in one panel."""

    def lines(axes: Any, pairs: list[tuple[Side, Side]], value: str, title: str) -> None:
        for (first, second), marker in zip(pairs, "svDPX", strict=False):
            at = [(speed, PRESET[1], first.name, second.name) for speed in SPEEDS]
            rows = [table[key] for key in at if key in table]  # a sweep may have been stopped
            shown = second if second in RESTING else first
            label = shown.name.replace(", flown by ", "\n")
            heights = [getattr(row, value) for row in rows]
            axes.plot([row.speed for row in rows], heights, marker=marker, markersize=4, label=label, clip_on=False)
        axes.axvline(PRESET[0], color=GREY, linewidth=0.8, linestyle=":", zorder=0)
        axes.set(title=title, ylim=(0, 300 if value == "seconds" else 100))

    against_uniform = [(one, UNIFORM) for one in RESTING]
    with drawing(path, (8.0, 6.6)) as figure:
        (wins, seconds), (learned, order) = panels = figure.subplots(2, 2, sharex=True)
        lines(wins, against_uniform, "wins", "resting teams: games won, %")
        halo = (Side(player="halo"), UNIFORM)
        lines(seconds, [*against_uniform, halo], "seconds", "their games: median length, s")
        lines(learned, [(VETERAN, one) for one in RESTING], "points", "veteran: points against them, %")
        lines(order, [(one, UNIFORM) for one in ORDER], "points", "players: points, %")
        wins.axhspan(90, 100, color="0.92", zorder=0)
        learned.axhspan(0, 80, color="0.92", zorder=0)
        for axes in panels[-1]:
            axes.set_xlabel("least airspeed")
        for axes in (seconds, order):
            axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), handlelength=3)


def main() -> None:
    """Play, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=20, help="of every pairing in every setting")
    parser.add_argument("--preset-games", type=int, default=100, help="with the preset's airspeed and acceleration")
    parser.add_argument("--table", type=Path, default=DOCS / "tables" / "least_airspeed.csv")
    parser.add_argument("--picture", type=Path, default=DOCS / "images" / "least_airspeed.png")
    options = parser.parse_args()
    table = read(options.table)
    sweep(table, options.table, options.games, options.preset_games)
    print_criteria(table)
    draw(table, options.picture)


if __name__ == "__main__":
    main()
