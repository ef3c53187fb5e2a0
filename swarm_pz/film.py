"""Films: a game as pictures, written as an animated GIF or an MP4; and stills, as PNG."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, GameConfig
from swarm_pz.errors import RenderError, require_extra
from swarm_pz.exhibition import Exhibition
from swarm_pz.policy import Player
from swarm_pz.render import Overlay, draw

FORMATS = (".gif", ".mp4")
STILL = ".png"
FILM_RATE = 20
"""Pictures a second of film, about."""


def film_game(
    red: str | Player,
    blue: str | Player,
    path: Path,
    *,
    config: GameConfig | None = None,
    seed: int = 0,
    seconds: float | None = None,
    speed: float = 2.0,
    overlays: Sequence[Overlay] = (),
    progress: Callable[[float], None] | None = None,
) -> str:
    """Play one game and write it as a film, or the board at one moment as a picture.

    Parameters
    ----------
    red, blue : str or Policy
    path : Path
        Where to; its suffix chooses the format: .gif or .mp4, or .png for a picture.
    config : GameConfig, optional
    seed : int
    seconds : float, optional
        Show this much of the game at most; all of it if not given. The moment of a picture.
    speed : float
        Seconds of game a second of film.
    overlays : sequence of Overlay, optional
        What to show on the ground; see `swarm_pz.overlays`.
    progress : callable, optional
        Called with the seconds of game shown so far.

    Returns
    -------
    str
        How the game stood at the last picture, in words.

    Raises
    ------
    RenderError
        If the suffix names no format that can be written, or seconds or speed are not above 0.
    """
    if path.suffix not in (*FORMATS, STILL):
        raise RenderError(
            f"the file's name must end in {' or '.join(FORMATS)} for a film, or in {STILL} for a picture, "
            f"got {str(path)!r}"
        )
    for name, value in (("seconds", seconds), ("speed", speed)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise RenderError(f"{name} must be a number above 0, got {value!r}")
    game = Exhibition(red, blue, config=config, seed=seed)

    def report() -> None:
        if progress is not None:
            progress(float(game.simulator.time_s[0]))

    if path.suffix == STILL:
        standing = _write_still(game, path, seconds, overlays, report)
    else:
        _write_film(game, path, seconds, speed, overlays, report)
        standing = game.standing
    game.close()
    return standing


def _write_film(
    game: Exhibition,
    path: Path,
    seconds: float | None,
    speed: float,
    overlays: Sequence[Overlay],
    report: Callable[[], None],
) -> None:
    every = max(1, round(speed / CONTROL_PERIOD / FILM_RATE))
    count = 0
    with open_film(path, speed / CONTROL_PERIOD / every) as film:

        def show() -> None:
            nonlocal count
            if count % every == 0 or game.simulator.decided[0]:
                film(draw(game.simulator, overlays=overlays))
            count += 1

        show()
        game.play(seconds, after_control_period=show, after_step=report)


def _write_still(
    game: Exhibition, path: Path, seconds: float | None, overlays: Sequence[Overlay], report: Callable[[], None]
) -> str:
    """Write the board at the first control period that ends no earlier than `seconds`, or at the end."""
    seen: tuple[NDArray[np.uint8], str] | None = None

    def look() -> None:
        nonlocal seen
        if seen is None and seconds is not None and game.simulator.time_s[0] >= seconds - 1e-9:
            seen = draw(game.simulator, overlays=overlays), game.standing

    game.play(seconds, after_control_period=look, after_step=report)
    picture, standing = seen if seen is not None else (draw(game.simulator, overlays=overlays), game.standing)
    path.parent.mkdir(parents=True, exist_ok=True)
    require_extra("PIL.Image", "render").fromarray(picture).save(path)
    return standing


def check_film(path: Path) -> None:
    """Raise a RenderError unless a file's suffix names a format that can be written."""
    if path.suffix not in FORMATS:
        raise RenderError(f"a film's file name must end in {' or '.join(FORMATS)}, got {str(path)!r}")


@contextmanager
def open_film(path: Path, rate: float) -> Iterator[Callable[[NDArray[np.uint8]], None]]:
    """Give a function that appends a picture to the film, `rate` a second; the file is complete on leaving."""
    check_film(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".mp4":
        with require_extra("imageio.v2", "render").get_writer(path, fps=rate, macro_block_size=4) as writer:
            yield writer.append_data
        return
    image_module = require_extra("PIL.Image", "render")
    frames = []

    def append(picture: NDArray[np.uint8]) -> None:
        # GIFs compress so little that half the size and few colours are what makes them usable.
        half = image_module.fromarray(picture).reduce(2)
        # An octree keeps the teams' colours, of which there is little; the mean colours of a median cut lose them.
        octree = image_module.Quantize.FASTOCTREE
        frames.append(half.quantize(64, method=octree, dither=image_module.Dither.NONE))

    yield append
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=round(1000 / rate), loop=0, optimize=True)
