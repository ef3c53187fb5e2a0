"""Draw the pictures that explain the game: one with a legend, a trail and its occupancy, the capture field, a capture.

python -m benchmarks.rules_pictures
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from swarm_pz.analysis.video import film_game
from swarm_pz.config import BLUE, GRID_CELLS, RED, TICKS_PER_SECOND, CaptureConfig, GameConfig
from swarm_pz.rendering.painter import ARENA, HEADER, MARGIN, draw
from swarm_pz.simulator import Simulator

CENTRES = (np.arange(10) + 0.5) / 10 - 0.5


def ring(radius: float) -> NDArray[np.float64]:
    """Return a command (10, 10) that asks for a ring around the centre."""
    return np.exp(-(((np.hypot(CENTRES, CENTRES[:, None]) - radius) / 0.06) ** 2))


def board(simulator: Simulator) -> NDArray[np.uint8]:
    """Draw the arena without its header and margins."""
    return draw(simulator)[HEADER : HEADER + ARENA, MARGIN : MARGIN + ARENA]


def panels(count: int, width: float) -> tuple[Figure, Any]:
    """Make a figure of square panels side by side."""
    figure = Figure(figsize=(width, width / count + 0.35), layout="constrained")
    return figure, figure.subplots(1, count)


def show(axes: Any, picture: NDArray[np.uint8], title: str) -> None:
    """Show a part of a board."""
    axes.imshow(picture)
    axes.set_title(title, fontsize=10)
    axes.set(xticks=[], yticks=[])


def cut(picture: NDArray[np.uint8], left: float, bottom: float, side: float) -> NDArray[np.uint8]:
    """Cut a square, in map widths, out of a board."""
    top = round((1 - bottom - side) * ARENA)
    pixels, column = round(side * ARENA), round(left * ARENA)
    return picture[top : top + pixels, column : column + pixels]


def draw_trail(path: Path) -> None:
    """Draw one drone's trail, the ticks that it counts in each cell, and the field that it makes."""
    config = GameConfig(drones_per_team=(1, 0), capture=CaptureConfig(enabled=False))
    simulator = Simulator(config)
    simulator.reset([0], scenario={"positions": [[0.12, 0.2]], "velocities": [[0.12, 0.1]]})
    simulator.command(RED, [ring(0.25)])
    simulator.advance(5 * TICKS_PER_SECOND)
    cells = np.argwhere(simulator.occupancy[0, RED])
    first = np.maximum(cells.min(axis=0) - 3, 0)
    side = int(max(cells.max(axis=0) + 4 - first))
    window = (slice(first[0], first[0] + side), slice(first[1], first[1] + side))
    figure, axes = panels(3, 11)
    part = cut(board(simulator), first[1] / GRID_CELLS, first[0] / GRID_CELLS, side / GRID_CELLS)
    show(axes[0], part, "a drone and its trail of 5 s")
    occupancy = simulator.occupancy[0, RED][window]
    for place, values, title in (
        (axes[1], occupancy, "occupancy: ticks in each cell"),
        (axes[2], simulator.capture_field[0, RED][window], "capture field: mean of the ring around"),
    ):
        place.imshow(np.where(values > 0, values, np.nan), origin="lower", cmap="Reds", vmin=0, vmax=values.max() * 1.4)
        place.set_title(title, fontsize=10)
        place.set(xticks=np.arange(side + 1) - 0.5, yticks=np.arange(side + 1) - 0.5, xticklabels=[], yticklabels=[])
        place.grid(color="#dddddd", linewidth=0.4)
        place.tick_params(length=0)
    for row, column in np.argwhere(occupancy):
        axes[1].text(column, row, occupancy[row, column], ha="center", va="center", fontsize=6)
    figure.savefig(path, dpi=110)


def draw_field(path: Path) -> None:
    """Draw a red ring, its capture field with the line above which it captures, and where its peak comes from."""
    config = GameConfig(drones_per_team=(10, 0), capture=CaptureConfig(enabled=False))
    simulator = Simulator(config)
    angles = np.arange(10) * 2 * np.pi / 10
    outward = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    scenario = {"positions": 0.5 + 0.2 * outward, "velocities": 0.2 * np.stack([-outward[:, 1], outward[:, 0]], axis=1)}
    simulator.reset([1], scenario=scenario)
    simulator.command(RED, [ring(0.2)])
    simulator.advance(6 * TICKS_PER_SECOND)
    occupancy, field = simulator.occupancy[0, RED], simulator.capture_field[0, RED]
    figure, axes = panels(3, 11)
    show(axes[0], board(simulator), "ten drones fly in a ring")
    axes[1].imshow(field, origin="lower", cmap="Reds", extent=(0, 1, 0, 1))
    centres = (np.arange(GRID_CELLS) + 0.5) / GRID_CELLS
    axes[1].contour(centres, centres, field / field.max(), [config.capture.threshold], colors=["black"])
    axes[1].set_title("capture field, and 3/4 of its maximum", fontsize=10)
    axes[1].set(xticks=[], yticks=[])
    _draw_peak(axes[2], occupancy, field)
    figure.savefig(path, dpi=110)


def _draw_peak(axes: Any, occupancy: NDArray[np.int64], field: NDArray[np.float64]) -> None:
    """Draw the 5x5 sub-grid around the field's maximum, with its occupancy."""
    row, column = np.unravel_index(int(field.argmax()), field.shape)
    part = occupancy[row - 2 : row + 3, column - 2 : column + 3]
    outer = np.ones((5, 5))
    outer[1:-1, 1:-1] = np.nan
    axes.imshow(outer, origin="lower", cmap="Reds", vmin=0, vmax=4)
    for y, x in np.ndindex(5, 5):
        axes.text(x, y, part[y, x], ha="center", va="center", fontsize=11)
    axes.add_patch(Rectangle((1.5, 1.5), 1, 1, fill=False, edgecolor="black", linewidth=2))
    total = int(np.nansum(part * outer))
    axes.set_title(f"around the maximum: {total} ticks / 16 cells = {total / 16:.2f}", fontsize=10)
    axes.set(xticks=np.arange(6) - 0.5, yticks=np.arange(6) - 0.5, xticklabels=[], yticklabels=[])
    axes.grid(color="#999999", linewidth=0.6)
    axes.tick_params(length=0)


def draw_capture(path: Path) -> None:
    """Draw the ticks before and of a capture in the middle of a ring, and a second later."""
    simulator = Simulator(GameConfig())
    simulator.reset([3])
    simulator.command(RED, [ring(0.24)])
    simulator.command(BLUE, [np.exp(-(CENTRES**2 + CENTRES[:, None] ** 2) / 0.01)])
    before = board(simulator)
    while not simulator.games.captures[0, RED]:
        before = board(simulator)
        simulator.advance(1)
    captured = simulator.positions[0, np.argmax(simulator.games.capture_ticks[0])].astype(float)
    side = 0.5
    left, bottom = np.clip(captured - side / 2, 0.0, 1.0 - side)
    figure, axes = panels(3, 11)
    now = board(simulator)
    simulator.advance(TICKS_PER_SECOND)
    for place, picture, title in zip(
        axes,
        (before, now, board(simulator)),
        ("a blue drone enters striped ground", "in that tick it becomes red", "one second later"),
        strict=True,
    ):
        show(place, cut(picture, left, bottom, side), title)
    for place in axes[:2]:
        x, y = (captured[0] - left) * ARENA, (side - (captured[1] - bottom)) * ARENA
        place.add_patch(Circle((x, y), 22, fill=False, edgecolor="black", linewidth=1.5))
    figure.savefig(path, dpi=110)


def main() -> None:
    """Write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/images"))
    out = parser.parse_args().out
    film_game("halo", "uniform", out / "game.png", seed=1, seconds=12)
    draw_trail(out / "rule_trail.png")
    draw_field(out / "rule_field.png")
    draw_capture(out / "rule_capture.png")


if __name__ == "__main__":
    main()
