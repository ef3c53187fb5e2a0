"""What people reached on the ladder: a file for each code, a line for each game, and a table of all.

A line is on the disk before its level is told to anybody, so a server that is killed loses no more than the game that
is being played.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Literal

import msgspec

from swarm_pz.errors import RecordingError
from swarm_pz.files import draft_of
from swarm_pz.play.levels import Level, Met, level_of
from swarm_pz.play.recordings.recorder import sync_folder
from swarm_pz.play.studies.design import check_code

TABLE = "levels.csv"
REACHED_S = 1200.0
"""Seconds of game after which systems are compared by the levels that people have reached: 20 minutes."""


@dataclass(frozen=True, kw_only=True)
class Climbed:
    """One game of somebody on the ladder, as a line of their file holds it."""

    at: float
    """When it was over, Unix time."""
    system: str
    """The control system that flew the person's swarm."""
    opponent: str
    rating: float
    """The opponent's, as it was then."""
    side: Literal["red", "blue"]
    """The person's."""
    seed: int
    outcome: Literal["win", "draw", "loss"]
    ended_by: str
    """As in the recording: a game that was "left" is lost."""
    seconds: float
    """Of game."""
    recording: str
    """The file's name."""

    @property
    def met(self) -> Met:
        """What it says of the person's level."""
        return Met(self.opponent, self.rating, {"win": 1.0, "draw": 0.5, "loss": 0.0}[self.outcome])


@dataclass(frozen=True, kw_only=True)
class LevelRow:
    """What one person reached with one control system: levels with their 95 % intervals."""

    code: str
    system: str
    games: int
    won: int
    drawn: int
    lost: int
    left: int
    """Those are among the lost."""
    seconds: float
    """Of game, in all."""
    level: float
    low: float
    high: float
    games_20min: int
    """Games until 20 minutes were played: those that began within them. So below."""
    level_20min: float
    low_20min: float
    high_20min: float


_line = msgspec.json.Decoder(Climbed)


class Climber:
    """Somebody's file; it is made with the first game.

    Parameters
    ----------
    folder : Path
    code : str

    Attributes
    ----------
    games : list of Climbed
        In the order in which they were played.

    Raises
    ------
    ConfigError
        If it is no code.
    RecordingError
        If the file is corrupt; it is left as it is.
    """

    def __init__(self, folder: Path, code: str) -> None:
        self.code = check_code(code)
        self._path = folder / f"{code}.jsonl"
        self.games: list[Climbed] = []
        self._whole = 0
        """Bytes of the file's whole lines: what follows was never told to anybody."""
        if self._path.exists():
            whole, end, _ = self._path.read_bytes().rpartition(b"\n")
            self._whole = len(whole) + len(end)
            self.games = [self._read(line, number) for number, line in enumerate(whole.splitlines(), 1)]

    def _read(self, line: bytes, number: int) -> Climbed:
        try:
            return _line.decode(line)
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise RecordingError(
                f"line {number} of {self._path.name} is corrupt: {error}; mend or move the file, nothing was changed"
            ) from error

    def add(self, game: Climbed) -> None:
        """Keep a game: on the disk when this returns.

        Raises
        ------
        OSError
            If it cannot be written; then nothing is kept.
        """
        line = msgspec.json.encode(game) + b"\n"
        is_new = not self._path.exists()
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("ab") as file:
            file.truncate(self._whole)
            file.write(line)
            file.flush()
            os.fsync(file.fileno())
        if is_new:
            sync_folder(self._path.parent)
        self._whole += len(line)
        self.games.append(game)

    def of(self, system: str) -> list[Climbed]:
        """Return the games that were played with a control system."""
        return [game for game in self.games if game.system == system]


def reached(games: Sequence[Climbed]) -> Level:
    """Return the level that somebody's games show."""
    return level_of([game.met for game in games])


def rows_of(climber: Climber) -> list[LevelRow]:
    """Return what somebody has reached with each control system, by its name."""
    rows = []
    for system in sorted({game.system for game in climber.games}):
        games = climber.of(system)
        first, played = 0, 0.0
        while first < len(games) and played < REACHED_S:
            played += games[first].seconds
            first += 1
        whole, early = reached(games), reached(games[:first])
        outcomes = [game.outcome for game in games]
        rows.append(
            LevelRow(
                code=climber.code,
                system=system,
                games=len(games),
                won=outcomes.count("win"),
                drawn=outcomes.count("draw"),
                lost=outcomes.count("loss"),
                left=sum(game.ended_by == "left" for game in games),
                seconds=sum(game.seconds for game in games),
                level=whole.value,
                low=whole.low,
                high=whole.high,
                games_20min=first,
                level_20min=early.value,
                low_20min=early.low,
                high_20min=early.high,
            )
        )
    return rows


def write_table(folder: Path) -> list[str]:
    """Write the table of a folder's levels, a row for each code and control system.

    Returns
    -------
    faults : list of str
        Files that could not be read, and why: their people are missing in it.
    """
    rows, faults = [], []
    for path in sorted(folder.glob("*.jsonl")):
        try:
            rows += rows_of(Climber(folder, path.stem))
        except (RecordingError, ValueError, OSError) as error:
            faults.append(str(error))
    with draft_of(folder / TABLE) as draft, draft.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([field.name for field in fields(LevelRow)])
        for row in rows:
            writer.writerow([round(value, 1) if isinstance(value, float) else value for value in astuple(row)])
    return faults
