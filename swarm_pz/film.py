"""Films: a game as pictures, written as an animated GIF or an MP4."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swarm_pz.batch_env import BatchEnv
from swarm_pz.config import BLUE, CONTROL_PERIOD, RED, GameConfig
from swarm_pz.errors import RenderError, require_extra
from swarm_pz.policy import Player, ask, load_players
from swarm_pz.render import draw
from swarm_pz.scenario import check_seed

FORMATS = (".gif", ".mp4")
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
    progress: Callable[[float], None] | None = None,
) -> str:
    """Play one game and write it as a film.

    Parameters
    ----------
    red, blue : str or Policy
    path : Path
        Where to; its suffix, .gif or .mp4, chooses the format.
    config : GameConfig, optional
    seed : int
    seconds : float, optional
        Show this much of the game at most; all of it if not given.
    speed : float
        Seconds of game a second of film.
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
    check_film(path)
    for name, value in (("seconds", seconds), ("speed", speed)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise RenderError(f"{name} must be a number above 0, got {value!r}")
    check_seed(seed)
    config = config if config is not None else GameConfig()
    batch = BatchEnv(config)
    players = load_players(red, blue, config)
    streams = [np.random.SeedSequence(seed, spawn_key=(place,)) for place in range(2)]
    row = np.zeros(1, np.int64)
    batch.reset([seed])
    for player, stream in zip(players, streams, strict=True):
        player.reset([stream], row)
    end = batch.limit_s if seconds is None else seconds
    simulator = batch.simulator
    every = max(1, round(speed / CONTROL_PERIOD / FILM_RATE))
    count = 0
    with open_film(path, speed / CONTROL_PERIOD / every) as film:

        def show() -> None:
            nonlocal count
            if count % every == 0 or simulator.decided[0]:
                film(draw(simulator))
            count += 1

        show()
        while batch.running[0] and simulator.time_s[0] < end:
            commands = [
                ask(player, batch, np.array([team]), row)[0] for team, player in zip((RED, BLUE), players, strict=True)
            ]
            batch.step([commands], show)
            if progress is not None:
                progress(float(simulator.time_s[0]))
    outcome = batch.outcome(0, RED)
    red_size, blue_size = simulator.sizes[0]
    standing = f"{simulator.time_s[0]:.1f} s, red {red_size}, blue {blue_size}"
    result = {None: "unfinished", "win": "red won", "loss": "blue won", "draw": "a draw"}[outcome]
    batch.close()
    return f"{result} ({standing})"


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
