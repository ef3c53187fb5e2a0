"""Players in any language: programs that read observations and write commands, one JSON object a line.

docs/bots.md has the protocol. Limits keep a mistake from hanging or filling a machine; they are no sandbox.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import itertools
import json
import os
import queue
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CHANNELS, GRID_CELLS, MOTION_CHANNELS, GameConfig, ObservationConfig
from swarm_pz.config.values import check_densities
from swarm_pz.errors import CommandError, ConfigError, ForfeitError, PolicyError
from swarm_pz.files import explain
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.observation import Observations, of_game

VERSION = 1
SECONDS = 10.0
"""Longest wait for a line."""
GAME_SECONDS, COMMAND_SECONDS = 20.0, 0.1
"""A chess clock: seconds that a program has in each game, and more for each command."""
LINE_BYTES = 2**20
"""Longest line that a program may write."""
MEMORY_BYTES = 2**30
"""Most data of a program, on Linux."""
FILE_BYTES = 2**26
"""Largest file that it may write, on Linux."""
TOO_SLOW = f"must take at most {GAME_SECONDS:g} s in a game and {COMMAND_SECONDS:g} s more for each command"
_KEPT_LINES = 20
"""Last lines of its standard error that are kept."""
_ENVIRONMENT = ("PATH", "LANG", "SYSTEMROOT")
"""Environment variables that it inherits."""
_MOST_FILES, _MOST_BYTES = 1000, 2**28
"""Limits of a folder that a digest covers."""
_FAILED: dict[str, str] = {}
"""Errors of programs that failed the greeting, by place and digest, so that no time is lost on them again."""


class GameClock:
    """The time that a player has left in each game, like a chess clock; `now` returns seconds."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now, self._began, self._left = now, 0.0, dict[int, float]()

    def begin(self, rows: NDArray[np.int64]) -> None:
        """Begin new games."""
        self._left.update(dict.fromkeys(rows.tolist(), GAME_SECONDS))

    def start(self) -> None:
        """Start counting time."""
        self._began = self._now()

    def is_over(self, rows: NDArray[np.int64]) -> bool:
        """Charge the time since the last call to the answered games, in equal parts; return whether one has run out."""
        began, self._began = self._began, self._now()
        for row in rows.tolist():
            spent = (self._began - began) / len(rows)
            self._left[row] = self._left.get(row, GAME_SECONDS) + COMMAND_SECONDS - spent
        return any(self._left[row] < 0 for row in rows.tolist())


class Program:
    """Plays the densities that a program writes.

    `line` is the program and its arguments, as for a shell, but no shell runs it; words `NAME=VALUE` before the program
    set its environment. It runs in `folder`, which then belongs to the program, or in the working folder. `clock`
    returns seconds, to measure the time of games. `observation` is what it asked to see; `digest` covers its words, the
    files among them, and `folder`, or else their folders below the working folder. Raises a PolicyError if there is no
    such program, or its folder is too large.
    """

    answers = "density"

    def __init__(
        self,
        config: GameConfig,
        line: str,
        folder: Path | None = None,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.name = f"exec:{line}"
        place = Path.cwd() if folder is None else folder.resolve()
        self._config, self._cells, self._clock = config, config.command_cells, GameClock(clock)
        self._start = (*_read(self.name, line, place), place)
        self.digest = _digest(line, place, owns_place=folder is not None)
        self._key = f"{place} {self.digest}"
        self.observation = ObservationConfig(grid=1)
        self._turn = 0
        if self._key not in _FAILED:
            self._open()

    def _open(self) -> None:
        """Start the program, and greet it."""
        self._pipe, self._turn = Pipe(self.name, *self._start), 0
        try:
            self.observation = self._greet()
        except ForfeitError as error:
            _FAILED[self._key] = str(error)

    def _greet(self) -> ObservationConfig:
        self._pipe.send(_greeting(self._config))
        answer = self._pipe.receive("answer the greeting")
        if not _is_number(version := answer.get("swarm_pz")) or version != VERSION:
            raise self._pipe.fault(f'must answer the greeting with "swarm_pz": {VERSION}, got {_shown(answer)}')
        sees, known = answer.get("observation", {}), {entry.name for entry in dataclasses.fields(ObservationConfig)}
        try:
            return ObservationConfig.from_dict(
                {name: value for name, value in sees.items() if name in known} if isinstance(sees, dict) else sees
            )
        except ConfigError as error:
            raise self._pipe.fault(f"asked to see what there is not: {error}") from error

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games, and restart a program that ended; raise a ForfeitError if it failed the greeting."""
        if self._key not in _FAILED and self._pipe.is_over:
            self._open()
        if (fault := _FAILED.get(self._key)) is not None:
            raise ForfeitError(fault)
        self._clock.begin(rows)
        for seed, row in zip(seeds, rows.tolist(), strict=True):
            self._pipe.send({"begin": row, "seed": int(np.random.default_rng(seed).integers(2**31))})

    def act(self, observations: Observations, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the program's densities (n, A, A); if one is invalid or late, end it and raise a ForfeitError."""
        first, densities = self._turn, []
        self._clock.start()
        for place, row in enumerate(rows.tolist()):
            self._pipe.send({"turn": self._turn, "game": row, "see": _plain(of_game(observations, place))})
            self._turn += 1
        for place, turn in enumerate(range(first, self._turn)):
            densities.append(self._density(turn))
            if self._clock.is_over(rows[place : place + 1]):
                raise self._pipe.fault(f"{TOO_SLOW}, but its time was over at turn {turn}")
        return np.stack(densities)

    def _density(self, turn: int) -> NDArray[np.float64]:
        answer = self._pipe.receive(f"answer turn {turn}")
        if not _is_number(received := answer.get("turn")) or received != turn:
            raise self._pipe.fault(f'must answer "turn": {turn}, got {_shown(answer)}')
        density = answer.get("density", ())
        try:
            for value in itertools.chain.from_iterable(density):
                if not _is_number(value):
                    raise CommandError(f"expected numbers, got {_shown(value)}")
            return check_densities(density, (self._cells, self._cells), "density")
        except (CommandError, TypeError) as error:  # it holds no lists
            raise self._pipe.fault(f"answered turn {turn} with no density: {error}") from error


def _is_number(value: Any) -> bool:
    """Return True for a number of JSON, which a string or `true` is not."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _read(name: str, line: str, place: Path) -> tuple[list[str], dict[str, str]]:
    """Return the words that start a program, and its environment."""
    environment = {key: os.environ[key] for key in _ENVIRONMENT if key in os.environ}
    try:
        words = shlex.split(line)
    except ValueError as error:
        raise PolicyError(f"{name} cannot be read as a shell would: {error}") from error
    while words and "=" in words[0] and words[0].split("=", 1)[0].isidentifier():
        key, value = words.pop(0).split("=", 1)
        environment[key] = value
    if not words:
        raise PolicyError(f"expected a program after exec:, as exec:./bot, got {name!r}")
    executable = shutil.which(str(place / words[0]) if Path(words[0]).name != words[0] else words[0])
    if executable is None:
        hint = "; name the file as ./bot, and chmod +x it" if (place / words[0]).is_file() else ""
        raise PolicyError(f"there is no program {words[0]!r} that can be run; got {name!r}{hint}")
    return [executable, *words[1:]], environment


def _digest(line: str, place: Path, *, owns_place: bool) -> str:
    """Return a digest of a program's words, of the files among them, and of the folders of these below its place.

    A folder that belongs to the program counts as a whole. Hidden files, what Python compiles and the card of a
    season's entry do not count.
    """
    words = shlex.split(line)
    files = {place / word for word in words if os.path.isfile(place / word)}  # noqa: PTH113  (which takes any length)
    content = hashlib.sha256(repr([word for word in words if place / word not in files]).encode())
    folders = {place} if owns_place else {path.parent for path in files if place in path.parent.parents}
    for folder in folders:
        counting = (path for path in folder.rglob("*") if _counts(path.relative_to(folder).parts) and path.is_file())
        paths = list(itertools.islice(counting, _MOST_FILES + 1))
        if len(paths) > _MOST_FILES or sum(path.stat().st_size for path in paths) > _MOST_BYTES:
            raise PolicyError(f"{folder} must hold at most {_MOST_FILES:,} files of {_MOST_BYTES / 2**20:g} MiB in all")
        files |= set(paths)
    for path in sorted(files):
        with path.open("rb") as file:
            content.update(hashlib.sha256(path.name.encode()).digest() + hashlib.file_digest(file, "sha256").digest())
    return content.hexdigest()[:32]


def _counts(parts: tuple[str, ...]) -> bool:
    return not any(part.startswith(".") or part in ("__pycache__", "entry.toml") for part in parts)


def _greeting(config: GameConfig) -> dict[str, Any]:
    return {
        "swarm_pz": VERSION,
        "rules": {
            "drones_per_team": config.team_sizes,
            "time_limit": config.time_limit,
            "command_period": config.command_period,
            "command_cells": config.command_cells,
        },
        "kinds": ["grids", "entities", "drones"],
        "grids": [grid for grid in range(1, GRID_CELLS + 1) if GRID_CELLS % grid == 0],
        "channels": CHANNELS + MOTION_CHANNELS,
        "limits": {
            "seconds": SECONDS,
            "game_seconds": GAME_SECONDS,
            "command_seconds": COMMAND_SECONDS,
            "line_bytes": LINE_BYTES,
            "memory_bytes": MEMORY_BYTES,
        },
    }


def _plain(seen: Any) -> Any:
    """Return an observation as lists; floats have six decimals, to keep JSON short."""
    if isinstance(seen, dict):
        return {name: _plain(values) for name, values in seen.items()}
    return seen.tolist() if seen.dtype.kind in "iu" else np.round(seen.astype(np.float64), 6).tolist()


def _shown(content: Any) -> str:
    text = json.dumps(content)
    return text if len(text) <= 80 else f"{text[:80]}..."


class Pipe:
    """A running program, and the lines to and from it; threads keep either side from blocking."""

    def __init__(self, name: str, words: list[str], environment: dict[str, str], place: Path) -> None:
        self._name = name
        self._fault: str | None = None
        try:
            self._process = subprocess.Popen(  # noqa: S603  (what the player named)
                words,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=environment,
                cwd=place,
                start_new_session=True,
            )
        except OSError as error:
            raise PolicyError(f"{name} cannot be started: {explain(error)}") from error
        _limit(self._process.pid)
        guard = _guard(self._process.pid)
        self._outbox: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._requests: queue.SimpleQueue[bool] = queue.SimpleQueue()
        self._inbox: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._errors = deque[str](maxlen=_KEPT_LINES)
        threads = [
            threading.Thread(target=work, args=arguments, daemon=True)
            for work, *arguments in (
                (_write, self._process.stdin, self._outbox),
                (_read_lines, self._process.stdout, self._requests, self._inbox),
                (_keep_lines, self._process.stderr, self._errors),
            )
        ]
        for thread in threads:
            thread.start()
        self._keeper = threads[-1]
        self._end = weakref.finalize(self, _end, self._process, guard, self._outbox, self._requests)

    def send(self, message: dict[str, Any]) -> None:
        """Write a line, in the background."""
        if self._fault is not None:
            raise ForfeitError(self._fault)
        self._outbox.put(json.dumps(message, separators=(",", ":")).encode() + b"\n")

    @property
    def is_over(self) -> bool:
        """True once the program was ended."""
        return self._fault is not None

    def receive(self, what: str, seconds: float | None = None) -> dict[str, Any]:
        """Return the next object that the program writes; wait `SECONDS` by default."""
        seconds = SECONDS if seconds is None else seconds
        try:
            self._requests.put(True)
            line = self._inbox.get(timeout=seconds)
        except queue.Empty:
            raise self.fault(f"must {what} within {seconds:g} s") from None
        except BaseException:  # an alarm: a late line must not answer the next request
            self.fault(f"was interrupted when it had to {what}")
            raise
        if len(line) > LINE_BYTES:
            raise self.fault(f"must {what} with a line of at most {LINE_BYTES:,} bytes")
        if not line:
            raise self.fault(f"must {what}, but {self._how_it_ended()}")
        try:
            message = json.loads(line)
        except (ValueError, RecursionError):
            message = None
        if not isinstance(message, dict):
            raise self.fault(f"must {what} with a JSON object, got {_shown(line.decode(errors='replace').strip())}")
        return message

    def _how_it_ended(self) -> str:
        try:
            status = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return "closed its output"
        if status >= 0:
            return f"ended with status {status}"
        named = {entry.value: entry.name for entry in signal.Signals}  # real-time signals have no names
        return f"ended by signal {named.get(-status, -status)}"

    def fault(self, what: str) -> ForfeitError:
        """End the program, and return an error with the last line of its standard error."""
        self._end()
        self._keeper.join(1.0)  # standard error ends with the program, and its last line may not have been read yet
        output = f"; it wrote: {self._errors[-1]}" if self._errors else ""
        self._fault = f"{self._name} {what}{output}"
        return ForfeitError(self._fault)


def _limit(process: int) -> None:
    """Limit the memory and the files of a process, where the system can."""
    if sys.platform != "linux":
        return
    import resource

    # Not the address space, of which some languages reserve much and use little.
    limits = {resource.RLIMIT_DATA: MEMORY_BYTES, resource.RLIMIT_FSIZE: FILE_BYTES, resource.RLIMIT_CORE: 0}
    for limit, most in limits.items():
        try:
            resource.prlimit(process, limit, (most, most))
        except ProcessLookupError:  # it has ended
            return


def _guard(process: int) -> subprocess.Popen[bytes] | None:
    """Start a shell that kills a program and its group once this process has ended in any way."""
    if sys.platform == "win32":
        return None
    line = ["/bin/sh", "-c", 'read -r _; kill -s KILL -- "-$0"', str(process)]
    return subprocess.Popen(line, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True)  # noqa: S603


def _write(stream: IO[bytes], outbox: queue.SimpleQueue[bytes | None]) -> None:
    with contextlib.suppress(OSError), stream:  # if it reads no more, its answer will be missing
        while (line := outbox.get()) is not None:
            stream.write(line)
            stream.flush()


def _read_lines(stream: IO[bytes], requests: queue.SimpleQueue[bool], inbox: queue.SimpleQueue[bytes]) -> None:
    """Read a line for each request, at most a byte longer than allowed; at the end, an empty one."""
    with stream:
        while requests.get():
            inbox.put(stream.readline(LINE_BYTES + 1))


def _keep_lines(stream: IO[bytes], kept: deque[str]) -> None:
    with stream:
        while line := stream.readline(200):
            kept.append(line.decode(errors="replace").strip())


def _end(
    process: subprocess.Popen[bytes],
    guard: subprocess.Popen[bytes] | None,
    outbox: queue.SimpleQueue[bytes | None],
    requests: queue.SimpleQueue[bool],
) -> None:
    """Kill a program and what it started, and let the threads end."""
    if sys.platform == "win32":
        process.kill()
    else:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    if guard is not None:
        guard.kill()
        guard.communicate()
    outbox.put(None)
    requests.put(False)
