"""Pictures of the board, as the page shows it: ground where each team captures, drones and their trails.

Shapes differ, not only colours: red drones are discs on striped ground, blue ones diamonds on dotted ground. A shadow
shows a drone's altitude. Row 0 of every grid is drawn at the bottom.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, CONTROL_PERIOD, GRID_CELLS, RED, TEAM_NAMES, TICKS_PER_CONTROL_PERIOD
from swarm_pz.errors import ConfigError, nearest, require_extra
from swarm_pz.rendering.board import (
    ASKED,
    INK,
    TEAM_COLOURS,
    Canvas,
    blank,
    mask_of,
    outline,
    paint_captures,
    paint_fields,
    paint_ground,
    planes_of,
    shorten,
)
from swarm_pz.rendering.drones import paint_drones, paint_trails, put_drone
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import reconstruct

METADATA: dict[str, Any] = {
    "name": "swarm_pz_capture_v0",
    "render_modes": ["human", "rgb_array", "rgb_array_list", "ansi"],
    "render_fps": round(1 / CONTROL_PERIOD),
    "is_parallelizable": True,
}


class Layout(NamedTuple):
    """Pixels of the arena's side (even), of the space beside, above and below it, and of text in header and legend."""

    arena: int
    margin: int
    header: int
    footer: int
    text: float
    small: float


PICTURE = Layout(arena=600, margin=20, header=56, footer=20, text=20, small=13.5)
FILM = Layout(arena=480, margin=16, header=44, footer=16, text=17, small=12)
ARENA, MARGIN, HEADER = PICTURE.arena, PICTURE.margin, PICTURE.header
ENTRY_WIDTH, ENTRY_HEIGHT = ARENA // 2, 28
"""Pixels of an overlay's entry in the legend."""
_LINE = 22
"""Pixels of a team's line in the legend of signs."""


class Overlay(Protocol):
    """A layer on the ground, beneath trails and drones, with an entry in a legend below the arena."""

    def paint(self, arena: Canvas, simulator: Simulator, row: int, side: int) -> None:
        """Paint one game onto an arena of `side` pixels a side, with y = 1 at the top."""

    def explain(self, picture: Any, x: int, y: int) -> None:
        """Draw the entry into a picture (of Pillow), within ENTRY_WIDTH x ENTRY_HEIGHT pixels from (x, y)."""


class Painter:
    """Draws moments of games, one after the other, with the `names` of red's and blue's players.

    `targets` outlines both targets instead of shading the fields, and adds a legend below. `overlays`, the lowest
    first, replace targets and captures on the ground. Raises MissingExtraError if Pillow is not installed.
    """

    def __init__(
        self,
        names: tuple[str, str] | None = None,
        *,
        targets: bool = False,
        overlays: Sequence[Overlay] = (),
        layout: Layout = PICTURE,
    ) -> None:
        self._targets, self._overlays, self._layout = targets and not overlays, tuple(overlays), layout
        self._corner = (layout.margin, layout.header)
        self._names = names
        self._frame = self._draw_frame()
        self._ground, self._shown = blank(layout.arena, layout.arena), b""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of its pictures."""
        return self._frame.size

    def draw(self, simulator: Simulator, row: int = 0, winner: str | None = None) -> NDArray[np.uint8]:
        """Return one game as uint8 (height, width, 3), with a strip that names the winner: "red", "blue" or "draw"."""
        picture, side = self._frame.copy(), self._layout.arena
        arena = self._ground_of(simulator, row).copy()
        for overlay in self._overlays:
            overlay.paint(arena, simulator, row, side)
        if not self._overlays:
            if not self._targets:  # both together are unreadable
                paint_fields(arena, simulator, row, side)
            paint_captures(arena, simulator, row, side)
        paint_trails(arena, simulator, row, side)
        paint_drones(arena, simulator, row, side)
        if winner is not None:
            self._announce(arena, winner)
        picture.put(arena, self._corner)
        self._write_header(picture, simulator, row)
        return picture.array()

    def _announce(self, arena: Canvas, winner: str) -> None:
        """Lay a white strip with the winner across the arena."""
        side, size = self._layout.arena, 1.5 * self._layout.text
        middle, reach = side // 2, round(size)
        text, colour = "draw", INK
        if winner != "draw":
            team = TEAM_NAMES.index(winner)
            name = winner if self._names is None else self._names[team]
            text, colour = f"{winner} wins" if name == winner else f"{winner} wins: {name}", TEAM_COLOURS[team]
        arena.fill(INK, (0, middle - reach - 1, side, middle + reach + 1))
        arena.fill((255, 255, 255), (0, middle - reach, side, middle + reach))
        arena.write(shorten(text, size, side - 2 * reach), (middle, middle), size, colour, "mm")

    def _ground_of(self, simulator: Simulator, row: int) -> Canvas:
        """Return the ground with the outlines of both targets, redrawn when one changes."""
        if self._targets and self._shown != (shown := simulator.games.coefficients[row].tobytes()):
            side = self._layout.arena
            self._ground, self._shown = blank(side, side), shown
            for team in (RED, BLUE):
                density = reconstruct(simulator.target_coefficients[row, team], side, smooth=True)
                self._ground.lay(ASKED, mask_of(outline(team, density), side))
        return self._ground

    def _draw_frame(self) -> Canvas:
        """Draw what never changes: the arena's edge and the legend."""
        layout = self._layout
        left, top, side = layout.margin, layout.header, layout.arena
        entries = -(-len(self._overlays) // 2) * ENTRY_HEIGHT
        size = (side + 2 * left, top + side + layout.footer + entries + 2 * _LINE * self._targets)
        drawn = require_extra("PIL.Image", "render").new("RGB", size, "white")
        for number, overlay in enumerate(self._overlays):
            line, column = divmod(number, 2)
            overlay.explain(drawn, left + column * ENTRY_WIDTH, top + side + 10 + line * ENTRY_HEIGHT)
        picture = planes_of(drawn)
        picture.fill(INK, (left - 1, top - 1, left + side + 1, top + side + 1))
        if self._targets:
            for team in (RED, BLUE):
                self._explain(picture, team, left, top + side + 8 + _LINE * team + _LINE // 2)
        return picture

    def _explain(self, picture: Canvas, team: int, left: int, middle: int) -> None:
        """Explain a team's signs in a line below the arena."""
        layout, name, colour = self._layout, TEAM_NAMES[team], TEAM_COLOURS[team]
        image, corner = require_extra("PIL.Image", "render").fromarray, middle - 6
        fading = np.zeros((12, 22), np.uint8)
        fading[5:7] = np.linspace(40, 150, 22)
        rows, columns = np.indices((14, 24))
        sample = outline(team, np.maximum(1.0 - np.hypot((rows - 6.5) / 13, (columns - 11.5) / 22), 0.0))
        swatch = np.pad(np.full((12, 20), 255, np.uint8), 1)
        lefts = [left + number * layout.arena // 4 for number in range(4)]
        put_drone(picture, team, lefts[0] + 12, middle, layout.arena)
        picture.lay(colour, image(fading), (lefts[1], corner))
        picture.lay(ASKED, image(np.round(255 * sample).astype(np.uint8)), (lefts[2], corner - 1))
        paint_ground(picture, team, image(swatch), (lefts[3], corner - 1))
        for x, text in zip(lefts, (f"{name} drone", "its trail", f"{name}'s target", f"{name} captures"), strict=True):
            picture.write(text, (x + 28, middle), layout.small, INK)

    def _write_header(self, picture: Canvas, simulator: Simulator, row: int) -> None:
        layout, size = self._layout, self._layout.text
        red, blue = (int(count) for count in simulator.sizes[row])
        left, right = layout.margin, layout.margin + layout.arena
        bar = layout.header - 18, layout.header - 10
        split = left + round(layout.arena * red / max(red + blue, 1))
        picture.fill(TEAM_COLOURS[RED], (left, bar[0], split, bar[1]))
        picture.fill(TEAM_COLOURS[BLUE], (split, bar[0], right, bar[1]))
        middle = (bar[0] - 2) // 2
        picture.write(f"{simulator.time_s[row]:.1f} s", ((left + right) // 2, middle), size, INK, "mm")
        for team, count, x, inwards in ((RED, red, left, 1), (BLUE, blue, right, -1)):
            anchor, colour = ("lm", "rm")[team], TEAM_COLOURS[team]
            put_drone(picture, team, x + inwards * size * 0.4, middle, layout.arena)
            name = TEAM_NAMES[team] if self._names is None else self._names[team]
            name = shorten(name, size, layout.arena / 2 - 6 * size)
            text = f"{name} {count}" if team == RED else f"{count} {name}"
            picture.write(text, (x + inwards * round(size), middle), size, colour, anchor)


def draw(simulator: Simulator, row: int = 0, overlays: Sequence[Overlay] = ()) -> NDArray[np.uint8]:
    """Draw one game, uint8 (height, width, 3), as `Painter` does."""
    return Painter(overlays=overlays).draw(simulator, row)


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
    """One game of a simulator in the render mode of an environment, which is in `METADATA["render_modes"]` or None.

    Raises ConfigError if the mode is unknown, and RenderError if "human" finds no display.
    """

    def __init__(self, mode: str | None, simulator: Simulator, row: int = 0) -> None:
        modes = METADATA["render_modes"]
        if mode is not None and mode not in modes:
            raise ConfigError(f"there is no render mode {mode!r}; {nearest(str(mode), modes)}")
        self._mode, self._simulator, self._row = mode, simulator, row
        # A step's frames and the one before it, so that frames nobody fetches do not fill the memory.
        frames_per_step = simulator.config.step_ticks // TICKS_PER_CONTROL_PERIOD
        self._frames: deque[NDArray[np.uint8]] = deque(maxlen=frames_per_step + 1)
        self._window: Any = None
        self._open()

    def _open(self) -> None:
        if self._mode == "human":
            from swarm_pz.rendering.window import Window

            self._window = Window("swarm-pz", METADATA["render_fps"])

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the window: a copy opens its own unless this one is closed."""
        return self.__dict__ | {"_window": self._window is not None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state | {"_window": None})
        if state["_window"]:
            self._open()

    @property
    def metadata(self) -> dict[str, Any]:
        """The environment's metadata, with the actual frame rate of this mode."""
        is_fast = self._mode in (None, "human", "rgb_array_list")
        return METADATA | ({} if is_fast else {"render_fps": 1 / self._simulator.config.command_period})

    @property
    def after_control_period(self) -> Any:
        """Function that a step calls after every control period; None if no frames are wanted."""
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
        if self._mode in ("rgb_array", "ansi"):
            return (draw if self._mode == "rgb_array" else ansi)(self._simulator, self._row)
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
