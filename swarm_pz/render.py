"""Pictures of the board: white ground, shaded where each team can capture, drones and their trails.

Told apart without colour, too: red drones are discs and its capture ground is hatched upwards, blue
ones are diamonds on ground hatched downwards. Row 0 of every grid is drawn at the bottom.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import (
    BLUE,
    CONTROL_PERIOD,
    GRID_CELLS,
    RED,
    TEAM_NAMES,
    TICKS_PER_CONTROL_PERIOD,
    GameConfig,
)
from swarm_pz.errors import ConfigError, nearest, require_extra
from swarm_pz.simulator import Simulator

METADATA: dict[str, Any] = {
    "name": "swarm_pz_capture_v0",
    "render_modes": ["human", "rgb_array", "rgb_array_list", "ansi"],
    "render_fps": round(1 / CONTROL_PERIOD),
    "is_parallelizable": True,
}
TEAM_COLOURS = ((214, 40, 57), (29, 98, 214))
SHADE_COLOURS = ((84, 8, 22), (8, 30, 84))
INK = (33, 37, 41)
ARENA = 600
"""Pixels a side of the arena in a picture."""
MARGIN, HEADER = 20, 56
LONGEST_LINE = 300
"""Ticks of a trail that are drawn at most: lines of a whole game would hide it."""
ENTRY_WIDTH, ENTRY_HEIGHT = ARENA // 2, 28
"""Pixels that an overlay's entry in the legend has."""
_SCALE = 2  # drawn twice as large and averaged, which smooths edges


class Overlay(Protocol):
    """Something to see on the ground, beneath trails and drones, with an entry in a legend below the arena."""

    def paint(self, arena: Any, simulator: Simulator, row: int) -> None:
        """Paint one game onto a square image (of Pillow) in which y = 1 is at the top."""

    def explain(self, picture: Any, x: int, y: int) -> None:
        """Draw the entry into a picture (of Pillow), within ENTRY_WIDTH x ENTRY_HEIGHT pixels from (x, y)."""


def draw(simulator: Simulator, row: int = 0, overlays: Sequence[Overlay] = ()) -> NDArray[np.uint8]:
    """Draw one game.

    Parameters
    ----------
    simulator : Simulator
    row : int
    overlays : sequence of Overlay, optional
        What to show on the ground, the lowest first, in place of the ground where teams capture.

    Returns
    -------
    uint8 array (height, width, 3)

    Raises
    ------
    MissingExtraError
        If Pillow is not installed.
    """
    image_module = require_extra("PIL.Image", "render")
    draw_module = require_extra("PIL.ImageDraw", "render")
    side = ARENA * _SCALE
    if overlays:
        arena = image_module.new("RGB", (side, side), "white")
        for overlay in overlays:
            overlay.paint(arena, simulator, row)
    else:
        arena = image_module.fromarray(_shading(simulator, row)).resize((side, side), image_module.Resampling.NEAREST)
    pen = draw_module.Draw(arena, "RGBA")
    for drone in range(simulator.config.num_drones):
        _draw_trail(pen, simulator, row, drone, side)
    for drone in range(simulator.config.num_drones):
        _draw_drone(pen, simulator.positions[row, drone], int(simulator.teams[row, drone]), side)
    arena = arena.reduce(_SCALE)
    legend = -(-len(overlays) // 2) * ENTRY_HEIGHT
    picture = image_module.new("RGB", (ARENA + 2 * MARGIN, ARENA + HEADER + MARGIN + legend), "white")
    picture.paste(arena, (MARGIN, HEADER))
    pen = draw_module.Draw(picture)
    pen.rectangle((MARGIN - 1, HEADER - 1, MARGIN + ARENA, HEADER + ARENA), outline=INK)
    _draw_header(pen, simulator, row)
    for number, overlay in enumerate(overlays):
        line, column = divmod(number, 2)
        overlay.explain(picture, MARGIN + column * ENTRY_WIDTH, HEADER + ARENA + 10 + line * ENTRY_HEIGHT)
    return np.asarray(picture)


def _shading(simulator: Simulator, row: int) -> NDArray[np.uint8]:
    """Paint the ground (ARENA, ARENA, 3): darker where a field is stronger, hatched where it captures."""
    image_module = require_extra("PIL.Image", "render")
    ground = np.full((ARENA, ARENA, 3), 255.0, np.float32)
    xs, ys = np.arange(ARENA)[None, :], np.arange(ARENA)[:, None]
    threshold = simulator.config.capture.threshold
    for team, colour in enumerate(SHADE_COLOURS):
        field = simulator.capture_field[row, team]
        if not field.any():
            continue
        relative = image_module.fromarray((field / field.max()).astype(np.float32)[::-1])
        smooth = np.asarray(relative.resize((ARENA, ARENA), image_module.Resampling.BICUBIC))
        faint = 0.35 * np.clip(smooth / threshold, 0.0, 1.0) ** 2
        hatch = ((xs + ys) if team == RED else (xs - ys)) % 7 < 4
        # The hatched ground is that of the rule; smoothing only rounds the corners of its cells.
        mask = image_module.fromarray(simulator.captures_here[row, team].astype(np.float32)[::-1])
        captures = np.asarray(mask.resize((ARENA, ARENA), image_module.Resampling.BICUBIC)) > 0.5
        alpha = np.where(captures, np.where(hatch, 0.95, 0.7), faint).astype(np.float32)[..., None]
        ground += alpha * (np.asarray(colour, np.float32) - ground)
    return ground.astype(np.uint8)


def _draw_trail(pen: Any, simulator: Simulator, row: int, drone: int, side: int) -> None:
    """Draw a drone's trail as a line that fades with age."""
    trail = simulator.games.trails[row, :, drone]
    tick, length = int(simulator.games.ticks[row]), len(trail)
    ages = np.arange(min(tick, length, LONGEST_LINE))[::-1]
    cells = trail[(tick - 1 - ages) % length].astype(np.int64)
    gaps = np.flatnonzero(cells < 0)  # what was forgotten, or left while the drone had failed
    cells = cells[gaps[-1] + 1 :] if len(gaps) else cells
    if len(cells) < 2:
        return
    places = np.stack([cells % GRID_CELLS, cells // GRID_CELLS], axis=1) + 0.5
    window = min(15, len(places))  # the trail knows cells, not points: averaging rounds its corners
    kernel = np.ones(window) / window
    path = np.stack([np.convolve(places[:, axis], kernel, "valid") for axis in range(2)], axis=1)
    path = np.concatenate([path, [simulator.positions[row, drone] * GRID_CELLS]])
    points = np.stack([path[:, 0], GRID_CELLS - path[:, 1]], axis=1) * side / GRID_CELLS
    colour = TEAM_COLOURS[int(simulator.teams[row, drone])]
    step = 5
    for start in range(0, len(points) - 1, step):
        strength = (start + step) / len(points)
        segment = [tuple(point) for point in points[start : start + step + 1]]
        pen.line(segment, fill=(*colour, round(150 * strength**1.5)), width=2 * _SCALE)


def _draw_drone(pen: Any, position: NDArray[np.float32], team: int, side: int) -> None:
    x, y = float(position[0]) * side, (1.0 - float(position[1])) * side
    for radius, fill in ((9 * _SCALE, (255, 255, 255)), (6.5 * _SCALE, TEAM_COLOURS[team])):
        if team == RED:
            pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=fill)
        else:
            reach = radius * 1.25
            pen.polygon([(x - reach, y), (x, y - reach), (x + reach, y), (x, y + reach)], fill=fill)


def _draw_header(pen: Any, simulator: Simulator, row: int) -> None:
    font = require_extra("PIL.ImageFont", "render").load_default(20)
    red, blue = (int(size) for size in simulator.sizes[row])
    pen.text((MARGIN, 8), f"red {red}", fill=TEAM_COLOURS[RED], font=font)
    pen.text((MARGIN + ARENA, 8), f"{blue} blue", fill=TEAM_COLOURS[BLUE], font=font, anchor="ra")
    pen.text((MARGIN + ARENA / 2, 8), f"{simulator.time_s[row]:.1f} s", fill=INK, font=font, anchor="ma")
    split = MARGIN + ARENA * red / max(red + blue, 1)
    pen.rectangle((MARGIN, 38, split, 46), fill=TEAM_COLOURS[RED])
    pen.rectangle((split, 38, MARGIN + ARENA, 46), fill=TEAM_COLOURS[BLUE])


def ansi(simulator: Simulator, row: int = 0) -> str:
    """Return one game as text, top row first.

    r and b are drones, digits several in one place; # and + are ground where red and blue capture,
    * where both do.
    """
    columns, lines = 50, 25
    canvas = np.full((lines, columns), ".", dtype="<U1")
    ground = simulator.captures_here[row].reshape(2, lines, GRID_CELLS // lines, columns).any(axis=2)
    canvas[ground[RED]] = "#"
    canvas[ground[BLUE]] = "+"
    canvas[ground[RED] & ground[BLUE]] = "*"
    drones: dict[tuple[int, int], list[int]] = {}
    for position, team in zip(simulator.positions[row], simulator.teams[row], strict=True):
        place = (min(int(position[1] * lines), lines - 1), min(int(position[0] * columns), columns - 1))
        drones.setdefault(place, []).append(int(team))
    for place, teams in drones.items():
        canvas[place] = TEAM_NAMES[teams[0]][0] if len(teams) == 1 else str(min(len(teams), 9))
    red, blue = simulator.sizes[row]
    header = f"red {red:<4d} {simulator.time_s[row]:>8.1f} s {blue:>4d} blue"
    return "\n".join([header, *("".join(line) for line in canvas[::-1])]) + "\n"


class Screen:
    """What an environment shows in its render mode: of one game of a simulator.

    Parameters
    ----------
    mode : str or None
        One of `METADATA["render_modes"]`.
    simulator : Simulator
    row : int

    Raises
    ------
    ConfigError
        If the mode is unknown.
    RenderError
        If `mode` is "human" and no window can be opened here.
    """

    def __init__(self, mode: str | None, simulator: Simulator, row: int = 0) -> None:
        modes = METADATA["render_modes"]
        if mode is not None and mode not in modes:
            raise ConfigError(f"there is no render mode {mode!r}; {nearest(str(mode), modes)}")
        self._mode = mode
        self._simulator = simulator
        self._row = row
        # A step's frames and the one before it: whoever never asks for them must not fill the memory.
        frames_per_step = simulator.config.step_ticks // TICKS_PER_CONTROL_PERIOD
        self._frames: deque[NDArray[np.uint8]] = deque(maxlen=frames_per_step + 1)
        self._window: Any = None
        self._open()

    def _open(self) -> None:
        if self._mode == "human":
            from swarm_pz.window import Window

            self._window = Window("swarm-pz", METADATA["render_fps"])

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the window, which no copy can have; it opens its own unless this one is closed."""
        return self.__dict__ | {"_window": self._window is not None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state | {"_window": None})
        if state["_window"]:
            self._open()

    @property
    def metadata(self) -> dict[str, Any]:
        """The environment's metadata, with the frame rate that this mode really gives."""
        config: GameConfig = self._simulator.config
        fps = METADATA["render_fps"] if self._mode in (None, "human", "rgb_array_list") else 1 / config.command_period
        return METADATA | {"render_fps": fps}

    @property
    def after_control_period(self) -> Any:
        """What a step should call after every control period: something only if frames are wanted."""
        return self._show if self._mode in ("human", "rgb_array_list") else None

    def begin(self) -> None:
        """Forget the last game and show the first frame of a new one."""
        self._frames.clear()
        if self._mode in ("human", "rgb_array_list"):
            self._show()

    def _show(self) -> None:
        frame = draw(self._simulator, self._row)
        if self._window is not None:
            self._window.show(frame)
        else:
            self._frames.append(frame)

    def render(self) -> Any:
        """Return a picture, the pictures of a step (not those already returned), or text; None for a window."""
        if self._mode == "rgb_array":
            return draw(self._simulator, self._row)
        if self._mode == "ansi":
            return ansi(self._simulator, self._row)
        if self._mode == "rgb_array_list":
            frames = list(self._frames)
            self._frames.clear()
            return frames
        if self._window is not None:
            self._window.refresh()
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None
