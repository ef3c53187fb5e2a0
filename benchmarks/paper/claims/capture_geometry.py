"""What drones that stand still capture: one, two, a ring, and rings that walls complete."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding
from swarm_pz.config import BLUE, GRID_CELLS, RED, ControllerConfig, GameConfig
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.simulator import Simulator

Cell = tuple[int, int]

# Nobody moves, so that a trail is one cell.
RULES = GameConfig(controller=ControllerConfig(max_acceleration=1e-9))
WINDOW = 14
"""Cells a side that are shown."""


def ring_around(centre: Cell) -> list[Cell]:
    """Return the cells (column, row) inside the square that are two away from a cell."""
    reach = range(-2, 3)
    around = [(centre[0] + x, centre[1] + y) for x in reach for y in reach if max(abs(x), abs(y)) == 2]
    return [cell for cell in around if min(cell) >= 0 and max(cell) < GRID_CELLS]


CENTRES = ((9, 9), (9, 0), (0, 0))
"""What the rings of the last scene surround: open ground, ground at a wall, and a corner."""
SCENES: dict[str, tuple[list[Cell], list[Cell]]] = {
    "one drone": ([(7, 7)], ring_around((7, 7))),
    "two drones": ([(5, 7), (9, 7)], [(7, row) for row in range(5, 10)]),
    "a ring of 16": (ring_around((7, 7)), [(7, 7)]),
    "rings of 16, of 9 and a wall, of 5 and two walls": (
        sorted({cell for centre in CENTRES for cell in ring_around(centre)}),
        list(CENTRES),
    ),
}
"""Where red's drones stand, and the cells in which they should capture."""


def probe(drones: list[Cell]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Put a blue drone into each cell in turn, one game a cell, and let one tick pass.

    Returns red's capture field (G, G), as a share of its maximum, and whether the drone in each cell was captured.
    """
    simulator = Simulator(RULES.replace(drones_per_team=(len(drones), 1)), num_games=GRID_CELLS**2)
    rows, columns = np.divmod(np.arange(GRID_CELLS**2), GRID_CELLS)
    simulator.games.positions[:, :-1] = (np.array(drones) + 0.5) / GRID_CELLS
    simulator.games.positions[:, -1] = (np.stack([columns, rows], axis=1) + 0.5) / GRID_CELLS
    simulator.advance(1)
    captured = (simulator.teams[:, -1] == RED).reshape(GRID_CELLS, GRID_CELLS)
    # Where the drone was not captured the field is that of red's drones alone.
    field = simulator.capture_field[np.flatnonzero(simulator.teams[:, -1] == BLUE)[-1], RED]
    return field / field.max(), captured


def measure(_: int) -> Finding:
    """Probe every cell of every scene; nothing here is random."""
    series, wrong = {}, 0
    for name, (drones, expected) in SCENES.items():
        field, captured = probe(drones)
        wanted = np.zeros_like(captured)
        wanted[tuple(np.array(expected)[:, ::-1].T)] = True
        wrong += int((captured != wanted).sum())
        shown = slice(0, WINDOW)
        series[name] = {
            "drones": [list(cell) for cell in drones],
            "field": np.round(field[shown, shown], 4).tolist(),
            "captured": [[int(column), int(row)] for row, column in np.argwhere(captured)],
        }
    probes = len(SCENES) * GRID_CELLS**2
    return Finding(
        numbers={"cells_that_differ": (wrong / probes, wilson(wrong, probes))},
        method=f"Wilson, {probes} games, one for each cell of each scene",
        holds=wrong == 0,
        seen=f"Of {probes:,} games, each with an opposing drone in another cell, {wrong} differ from what the rule "
        "says. One drone captures on the ring around it and not where it is; two capture what lies between them; a "
        "ring captures its middle; and 9 drones at a wall or 5 in a corner do what takes 16 on open ground.",
        configs={"paper": RULES},
        seeds=[],
        series=series,
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the field of each scene, its drones, and outline what it captures."""
    panels, red = figure.subplots(1, len(series), sharey=True), style.TEAMS[RED]
    look = {"origin": "lower", "cmap": "Greys", "vmin": 0, "vmax": 1, "extent": (0, WINDOW, 0, WINDOW), "zorder": 0}
    for axes, (name, scene) in zip(panels, series.items(), strict=True):
        image = axes.imshow(scene["field"], **look)
        for column, row in scene["captured"]:
            corner = (column + 0.06, row + 0.06)
            axes.add_patch(style.patch("Rectangle", corner, 0.88, 0.88, fill=False, edgecolor=red))
        places = np.array(scene["drones"]) + 0.5
        style.drones(axes, places, np.full(len(places), RED), size=26)
        wrapped = name.replace(", ", ",\n")
        axes.set(title=f"{wrapped}\ncaptures in {len(scene['captured'])} cells", xlim=(0, WINDOW), ylim=(0, WINDOW))
        axes.set_xlabel("x (cells of 1/50 map width)")
        axes.set(xticks=range(0, WINDOW + 1, 2), yticks=range(0, WINDOW + 1, 2))
        axes.grid(visible=False)
        for side in axes.spines.values():
            side.set_visible(False)
        for wall in (axes.axvline, axes.axhline):
            wall(0, color=style.DARK, linewidth=4)
    panels[0].set_ylabel("y (cells of 1/50 map width)")
    bar = figure.colorbar(image, ax=panels, shrink=0.8, label="red's capture field / its maximum")
    bar.ax.axhline(0.75, color=red)
    entries = [
        style.swatch("drone of red", red, marker="o"),
        style.swatch("an opposing drone here is captured: field above 0.75", red, marker="s", hollow=True),
        style.swatch("wall", style.DARK, line=4),
    ]
    style.legend_below(figure, entries)


FIGURE = Figure(
    name="capture_geometry",
    title="What standing drones capture",
    claim="A drone is captured where opposing drones surround it; walls help to surround.",
    section="II-C",
    quote="surrounded by a swarm, or that are surrounded by a swarm and one or more of the four boundaries",
    paper="The paper's rules average a swarm's occupancy over the outer cells of the 5x5 cells around each cell; its "
    "pictures show Go-like structures, a circle of drones capturing what passes through.",
    rule="In every cell of every scene a drone is captured exactly if the hand-made expectation says so.",
    measure=measure,
    draw=draw,
    size=(11.5, 4.2),
    seconds=3,
)
