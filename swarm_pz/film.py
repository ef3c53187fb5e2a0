"""Films: a game as pictures, written as an animated GIF or WebP, or an MP4; and stills, as PNG."""

from __future__ import annotations

import errno
import math
import os
import signal
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, NoReturn, cast

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, RED, GameConfig
from swarm_pz.errors import RenderError, require_extra
from swarm_pz.evaluation.rollout import Rollout, Watch, game_number
from swarm_pz.files import FULL, check_file, draft_of
from swarm_pz.policy import Player
from swarm_pz.rendering.board import ASKED, INK, TEAM_COLOURS
from swarm_pz.rendering.painter import FILM, PICTURE, Overlay, Painter
from swarm_pz.simulator import Simulator

FORMATS = (".gif", ".mp4", ".webp")
STILL = ".png"
FILM_RATE = 20
"""Pictures a second of film, roughly."""


def film_game(
    policy: str | Player,
    opponent: str | Player,
    path: Path,
    *,
    config: GameConfig | None = None,
    seed: int = 0,
    pair: int = 0,
    side: str = "red",
    seconds: float | None = None,
    speed: float = 2.0,
    overlays: Sequence[Overlay] = (),
    progress: Callable[[float, float], None] | None = None,
) -> str:
    """Play one game of a match and write it as a film, or the board at one moment as a picture; return its standing.

    The suffix chooses the format: .gif, .mp4, .webp; .png for a picture. `seed`, `pair` and the policy's `side` choose
    the game of the match. `seconds` is the longest game time to show, or the moment of a picture; `speed` is in seconds
    of game per second of film. `overlays` of `swarm_pz.rendering.overlays` replace the outlines of targets.
    `progress` is called with the seconds of game shown so far, and their maximum. On an error, no new file is
    left.

    Raises
    ------
    RenderError
        If the suffix names no format that can be written, or seconds or speed are not above 0.
    OutputError
        If the file cannot be written.
    """
    if path.suffix not in (*FORMATS, STILL):
        raise RenderError(
            f"the file's name must end in {' or '.join(FORMATS)} for a film, or in {STILL} for a picture, "
            f"got {str(path)!r}"
        )
    for name, value in (("seconds", seconds), ("speed", speed)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise RenderError(f"{name} must be a number above 0, got {value!r}")
    check_file(path)

    def report(game: Rollout) -> None:
        if progress is not None:
            end = game.batch.limit_s if seconds is None else min(seconds, game.batch.limit_s)
            progress(min(float(game.simulator.time_s[0]), end), end)

    with closing(Rollout(policy, opponent, [game_number(pair, side)], seed=seed, config=config)) as game:
        if path.suffix == STILL:
            return _write_still(game, path, seconds, overlays, report)
        _write_film(game, path, seconds, speed, overlays, report)
        return game.standing()


def _write_film(
    game: Rollout, path: Path, seconds: float | None, speed: float, overlays: Sequence[Overlay], report: Watch
) -> None:
    every, count = max(1, round(speed / CONTROL_PERIOD / FILM_RATE)), 0
    rate = speed / CONTROL_PERIOD / every
    painter = Painter(game.names(), targets=True, overlays=overlays, layout=PICTURE if overlays else FILM)
    with open_film(path, rate, painter.size) as append:

        def show(game: Rollout) -> None:
            nonlocal count
            if count % every == 0:
                append(painter.draw(game.simulator))
            count += 1

        show(game)
        game.play(seconds, after_control_period=show, after_step=report)
        winner = {"win": "red", "loss": "blue", "draw": "draw", None: None}[game.batch.outcome(0, RED)]
        if winner is not None:
            show_winner(append, painter, game.simulator, winner, rate)
        elif (count - 1) % every:  # the last picture is missing
            append(painter.draw(game.simulator))


def show_winner(
    append: Callable[[NDArray[np.uint8]], object], painter: Painter, simulator: Simulator, winner: str, rate: float
) -> None:
    """Append the end of a game with its winner, for one second of film."""
    picture = painter.draw(simulator, winner=winner)
    for _ in range(max(1, round(rate))):
        append(picture)


def _write_still(game: Rollout, path: Path, seconds: float | None, overlays: Sequence[Overlay], report: Watch) -> str:
    """Write the board at the first control period that ends no earlier than `seconds`, or at the end."""
    painter = Painter(game.names(), targets=True, overlays=overlays)
    seen: tuple[NDArray[np.uint8], str] | None = None

    def look(game: Rollout) -> None:
        nonlocal seen
        if seen is None and seconds is not None and game.simulator.time_s[0] >= seconds - 1e-9:
            seen = painter.draw(game.simulator), game.standing()

    with draft_of(path) as draft:
        game.play(seconds, after_control_period=look, after_step=report)
        picture, standing = seen if seen is not None else (painter.draw(game.simulator), game.standing())
        require_extra("PIL.Image", "render").fromarray(picture).save(draft)
    return standing


@contextmanager
def open_film(path: Path, rate: float, size: tuple[int, int]) -> Iterator[Callable[[NDArray[np.uint8]], object]]:
    """Yield a function that appends a picture to the film; the file appears, complete, when the block ends.

    `rate` is in pictures a second, `size` the width and height of every picture, both even. Raises RenderError if the
    suffix names no format that can be written, or the encoder fails, and OutputError if the file cannot be written.
    """
    if path.suffix not in FORMATS:
        raise RenderError(f"a film's file name must end in {' or '.join(FORMATS)}, got {str(path)!r}")
    program = require_extra("imageio_ffmpeg", "render").get_ffmpeg_exe()
    pictures = f"-f rawvideo -pix_fmt rgb24 -s {size[0]}x{size[1]} -r {rate} -i -".split()
    with draft_of(path) as draft, TemporaryDirectory() as folder, Path(folder, "errors").open("w+") as errors:
        inks: list[str] = []
        if path.suffix == ".mp4":
            coding = "-c:v libx264 -preset veryfast -crf 23 -tune animation -pix_fmt yuv420p -threads 1"
        else:
            palette = Path(folder, "palette.png")
            require_extra("PIL.Image", "render").fromarray(_palette()).save(palette)
            inks = ["-i", str(palette)]
            coding = "-lavfi paletteuse=dither=none:diff_mode=rectangle"
            if path.suffix == ".webp":
                coding += ",format=bgra -c:v libwebp_anim -lossless 1 -loop 0"
        encoder = subprocess.Popen(  # noqa: S603
            [program, "-y", "-v", "error", *pictures, *inks, *coding.split(), str(draft.absolute())],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            start_new_session=True,  # Ctrl-C reaches only this process, which ends the encoder
        )
        pipe = cast("IO[bytes]", encoder.stdin)
        has_failed = True
        try:
            yield lambda picture: pipe.write(np.ascontiguousarray(picture).data)
            pipe.close()
            has_failed = encoder.wait() != 0
        except BrokenPipeError:
            encoder.wait()
        finally:
            encoder.kill()  # unless it has ended
            with suppress(BrokenPipeError):
                pipe.close()
            encoder.wait()
        if has_failed:
            errors.seek(0)
            _explain(path, errors.read().strip(), encoder.returncode)


def _explain(path: Path, output: str, status: int) -> NoReturn:
    """Raise the error of an encoder that has failed; a full disk is an OSError."""
    if any(os.strerror(number) in output for number in FULL) or status == -getattr(signal, "SIGXFSZ", 0):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    raise RenderError(f"the film {str(path)!r} could not be encoded: {output or f'the encoder ended with {status}'}")


def _palette() -> NDArray[np.uint8]:
    """Return the colours of animations, uint8 (16, 16, 3): the board's, each in 64 steps from white."""
    inks = np.array([*TEAM_COLOURS, ASKED, INK], np.float64)
    strengths = np.arange(64)[:, None, None] / 63
    return np.round(255 + strengths * (inks - 255)).astype(np.uint8).reshape(16, 16, 3)
