"""Cells captured by drones that stand still: one, two, a ring, and rings that walls complete."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.figure import Figure, Finding, Setting, exactly
from swarm_pz.config import BLUE, GRID_CELLS, RED, GameConfig
from swarm_pz.simulator import Simulator

Cell = tuple[int, int]

WINDOW = 14
"""Cells a side that are shown."""


def ring_around(centre: Cell) -> list[Cell]:
    """Return the cells (column, row) inside the square that are two away from a cell."""
    reach = range(-2, 3)
    around = [(centre[0] + x, centre[1] + y) for x in reach for y in reach if max(abs(x), abs(y)) == 2]
    return [cell for cell in around if min(cell) >= 0 and max(cell) < GRID_CELLS]


ALONE, BETWEEN, RING, WALLS = (
    "one drone",
    "two drones",
    "a ring of 16",
    "rings of 16, of 9 and a wall, of 5 and two walls",
)
CENTRES = ((9, 9), (9, 0), (0, 0))
"""Middles of the rings of the last scene: on open ground, at a wall, and in a corner."""
SCENES: dict[str, tuple[list[Cell], list[Cell]]] = {
    ALONE: ([(7, 7)], ring_around((7, 7))),
    BETWEEN: ([(5, 7), (9, 7)], [(7, row) for row in range(5, 10)]),
    RING: (ring_around((7, 7)), [(7, 7)]),
    WALLS: (
        sorted({cell for centre in CENTRES for cell in ring_around(centre)}),
        list(CENTRES),
    ),
}
"""Places of red's drones, and the cells in which they should capture by the paper's rule."""


def still(config: GameConfig) -> GameConfig:
    """Return rules under which no drone moves, so that a trail is one cell."""
    controller = config.controller.replace(max_acceleration=1e-9)
    return config.replace(controller=controller, time_limit=10.0)


def probe(drones: list[Cell], rules: GameConfig) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Put a blue drone into each cell in turn, one game a cell, and let one tick pass.

    Returns red's capture field (G, G), as a share of its maximum, and whether the drone in each cell was captured.
    """
    simulator = Simulator(rules.replace(drones_per_team=(len(drones), 1)), num_games=GRID_CELLS**2)
    rows, columns = np.divmod(np.arange(GRID_CELLS**2), GRID_CELLS)
    simulator.games.velocities[:] = 0.0
    simulator.games.positions[:, :-1] = (np.array(drones) + 0.5) / GRID_CELLS
    simulator.games.positions[:, -1] = (np.stack([columns, rows], axis=1) + 0.5) / GRID_CELLS
    simulator.advance(1)
    captured = (simulator.teams[:, -1] == RED).reshape(GRID_CELLS, GRID_CELLS)
    # Where the drone was not captured the field is that of red's drones alone.
    field = simulator.capture_field[np.flatnonzero(simulator.teams[:, -1] == BLUE)[-1], RED]
    return field / field.max(), captured


def over_beneath(field: NDArray[np.float64], place: Cell, drones: list[Cell]) -> float:
    """Return the field at a place, divided by the mean field beneath drones."""
    beneath = np.mean([field[row, column] for column, row in drones])
    return float(field[place[1], place[0]] / max(beneath, 1e-9))


def measure(setting: Setting) -> Finding:
    """Probe every cell of every scene; nothing here is random."""
    rules, series, wrong = still(setting.config), {}, 0
    fields = {}
    for name, (drones, expected) in SCENES.items():
        field, captured = fields[name] = probe(drones, rules)
        wanted = np.zeros_like(captured)
        wanted[tuple(np.array(expected)[:, ::-1].T)] = True
        wrong += int((captured != wanted).sum())
        shown = slice(0, WINDOW)
        series[name] = {
            "drones": [list(cell) for cell in drones],
            "field": np.round(field[shown, shown], 4).tolist(),
            "captured": [[int(column), int(row)] for row, column in np.argwhere(captured)],
        }
    surrounded, between = ((7, 7), (7, 7))
    ring = over_beneath(fields[RING][0], surrounded, ring_around(surrounded))
    walls = min(over_beneath(fields[WALLS][0], centre, ring_around(centre)) for centre in CENTRES[1:])
    (net, net_captures), own = fields[BETWEEN], fields[ALONE][0]
    least = float(net[between[1], between[0]])
    on_top = float(own[7, 7] / own.max())
    parts = [
        exactly("a surrounded place over the ground beneath the drones, more than 1", ring, ring > 1),
        exactly("the same with one wall or two, the lesser", walls, walls > 1),
        exactly("two drones capture between them; field over its maximum", least, net_captures[7, 7]),
        exactly("on top of a drone, field over its maximum, below 1", on_top, on_top < 1),
    ]
    if setting.preset == "paper":
        differ = wrong / (len(SCENES) * GRID_CELLS**2)
        parts.append(exactly("cells that differ from the rule, none", differ, wrong == 0, ours=True))
    return Finding(parts=parts, method="exact", configs={"rules": rules}, seeds=[], series=series)


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the field, the drones and the outlined captured cells of each scene."""
    panels, red = figure.subplots(1, len(series)), style.TEAMS[RED]
    look = {"origin": "lower", "cmap": "Greys", "vmin": 0, "vmax": 1, "extent": (0, WINDOW, 0, WINDOW), "zorder": 0}
    for axes, (name, scene) in zip(panels, series.items(), strict=True):
        image = axes.imshow(scene["field"], **look)
        for column, row in scene["captured"]:
            corner = (column + 0.06, row + 0.06)
            axes.add_patch(style.patch("Rectangle", corner, 0.88, 0.88, fill=False, edgecolor=red, linewidth=0.7))
        places = np.array(scene["drones"]) + 0.5
        style.drones(axes, places, np.full(len(places), RED), size=7)
        short = "rings at walls" if name == WALLS else name
        inside = sum(max(cell) < WINDOW for cell in scene["captured"])
        axes.set(title=f"{short}: {inside} cells", xlim=(0, WINDOW), ylim=(0, WINDOW))
        axes.set(xticks=range(0, WINDOW + 1, 7), yticks=range(0, WINDOW + 1, 7))
        axes.set_xlabel("cells of 1/50 map width")
        axes.grid(visible=False)
        axes.label_outer()
        for side in axes.spines.values():
            side.set_visible(False)
        for wall in (axes.axvline, axes.axhline):
            wall(0, color=style.DARK, linewidth=3)
    bar = figure.colorbar(image, ax=panels, shrink=0.8, label="field / its maximum")
    bar.ax.axhline(0.75, color=red)
    entries = [
        style.swatch("drone of red", red, marker="o"),
        style.swatch("captures here: above 0.75", red, marker="s", hollow=True),
        style.swatch("wall", style.DARK, line=3),
    ]
    style.legend_below(figure, entries, 3)


FIGURE = Figure(
    name="capture_geometry",
    claim="A drone is captured where opposing drones surround it; walls help to surround.",
    section="II-C",
    quote="surrounded by a swarm, or that are surrounded by a swarm and one or more of the four boundaries",
    first="In every cell of every scene a drone is captured exactly if the paper's rule says so.",
    first_held=True,
    revised="That is the rule of the preset `paper` alone. The paper's sentences can be asked under both.",
    note="Drones stand still. At a wall 9 drones surround a place, in a corner 5, on open ground 16.",
    measure=measure,
    draw=draw,
    height=2.4,
)
