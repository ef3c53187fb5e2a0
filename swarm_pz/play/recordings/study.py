"""A folder of recorded games as tables: who won, how fast, and what people did meanwhile.

Times to the end of a game are censored where nobody won: a draw says only that a win takes longer. So
medians are Kaplan-Meier's, and means are restricted to the time limit; see `swarm_pz.evaluation.survival`.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import RecordingError, require_extra
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.evaluation.provenance import versions
from swarm_pz.evaluation.survival import kaplan_meier
from swarm_pz.play.recordings.folder import SUFFIX
from swarm_pz.play.recordings.format import (
    CapturedLine,
    CommandLine,
    EndLine,
    FrameLine,
    InForceLine,
    PaintedLine,
    Recording,
)

SCHEMA_VERSION = 2


@dataclass(frozen=True, kw_only=True)
class SeatRow:
    """What one seat did in one game; durations in seconds, delays in milliseconds.

    Attributes
    ----------
    recording, started : str
    config_hash, rules_hash : str
        Of the table, and of the game that it plays.
    mapping : str
    min_command_interval, speed, time_limit : float
    taken_over : bool
        The game went on from a moment of another one.
    side : {"red", "blue"}
    kind : {"person", "program", "policy"}
    player : str
        Policy or label.
    opponent_kind : {"person", "program", "policy", "free"}
    opponent : str
        The other seat's policy or label.
    start_size, drones : int
        Drones at the start, and of both teams.
    outcome : {"win", "draw", "loss", "stopped"}
    seconds : float
        Of game time.
    final_share : float
        Of all drones.
    commands : int
    commands_per_minute : float
    first_command_s : float or None
    drawing_s_per_command : float or None
    lost_while_drawing : int
        Drones lost while a drawing was made.
    input_to_in_force_ms, input_to_painted_ms : float or None
        Medians.
    disconnections : int
    hidden_s : float
        For how long the page was hidden.
    """

    recording: str
    started: str
    config_hash: str
    rules_hash: str
    mapping: str
    min_command_interval: float
    speed: float
    time_limit: float
    taken_over: bool
    side: str
    kind: str
    player: str
    opponent_kind: str
    opponent: str
    start_size: int
    drones: int
    outcome: str
    seconds: float
    final_share: float
    commands: int
    commands_per_minute: float
    first_command_s: float | None
    drawing_s_per_command: float | None
    lost_while_drawing: int
    input_to_in_force_ms: float | None
    input_to_painted_ms: float | None
    disconnections: int
    hidden_s: float


@dataclass(frozen=True, kw_only=True)
class SummaryRow:
    """All finished games of one player against one opponent, of one kind and under one configuration.

    Attributes
    ----------
    kind, player, opponent_kind, opponent, config_hash, rules_hash : str
    min_command_interval : float
    games, wins, draws, losses : int
    win_rate, win_rate_low, win_rate_high : float
        With Wilson's 95 % interval.
    median_s : float or None
        Kaplan-Meier median of the time to a win of either side; None if it is later than the last win.
    restricted_mean_s : float
        Mean of that time, restricted to the longest game.
    final_share : float
    commands_per_minute : float
    """

    kind: str
    player: str
    opponent_kind: str
    opponent: str
    config_hash: str
    rules_hash: str
    min_command_interval: float
    games: int
    wins: int
    draws: int
    losses: int
    win_rate: float
    win_rate_low: float
    win_rate_high: float
    median_s: float | None
    restricted_mean_s: float
    final_share: float
    commands_per_minute: float


def seat_rows(recording: Recording) -> list[SeatRow]:
    """Return what the seats of a game did; seats that nobody took are left out."""
    header, config, end = recording.header, recording.config, recording.end
    tick = end.tick if end is not None else recording.last_tick
    seconds = tick / TICKS_PER_SECOND
    teams = np.repeat((0, 1), config.game.team_sizes)
    for capture in recording.of(CapturedLine):
        teams[capture.drone] = capture.team
    seats = (header.red, header.blue)
    rows = []
    for team, seat in enumerate(seats):
        if seat.kind == "free":
            continue
        other = seats[1 - team]
        outcome = "stopped"
        if end is not None and end.outcome != "stopped":
            outcome = "draw" if end.outcome == "draw" else "win" if end.outcome == TEAM_NAMES[team] else "loss"
        rows.append(
            SeatRow(
                recording=recording.name,
                started=header.started,
                config_hash=config.hash,  # the header's may be as an earlier version wrote it
                rules_hash=config.game.rules_hash,
                mapping=config.mapping,
                min_command_interval=config.min_command_interval,
                speed=config.speed,
                time_limit=config.game.time_limit,
                taken_over=header.origin is not None,
                side=TEAM_NAMES[team],
                kind=seat.kind,
                player=seat.policy or seat.label,
                opponent_kind=other.kind,
                opponent=other.policy or other.label,
                start_size=config.game.team_sizes[team],
                drones=config.game.num_drones,
                outcome=outcome,
                seconds=seconds,
                final_share=float((teams == team).mean()),
                **_habits(recording, team, seconds),
            )
        )
    return rows


def _habits(recording: Recording, team: int, seconds: float) -> dict[str, Any]:
    """Return what a seat's player did; of a game that was taken over, only from there on."""
    origin = recording.header.origin
    begin_s = origin.tick / TICKS_PER_SECOND if origin is not None else 0.0
    played_s = seconds - begin_s
    events = recording.events[origin.lines if origin is not None else 0 :]
    speed = recording.config.speed
    inputs: dict[int, float] = {}
    drawing_s, first_s, commands, lost, disconnections = [], None, 0, 0, 0
    spans: list[tuple[float, float]] = []
    captured_ms: list[float] = []
    to_force, to_paint = [], []
    hidden_ms, hidden_since, last_ms = 0.0, None, 0.0
    # In order, since a page that was reloaded counts its commands from the start again.
    for line in events:
        last_ms = max(last_ms, getattr(line, "ms", 0.0))
        if isinstance(line, CapturedLine):
            if line.team != team:
                captured_ms.append(1000.0 * (line.tick / TICKS_PER_SECOND - begin_s) / speed)
        elif isinstance(line, FrameLine | EndLine) or line.team != team:
            continue
        elif isinstance(line, CommandLine):
            commands += 1
            inputs.pop(line.number, None)
            if (timing := line.timing) is not None:
                # When it arrived, less what its sender says had passed since.
                inputs[line.number] = line.received_ms - (timing.sent_ms - timing.input_ms) - timing.round_trip_ms / 2
                spans.append((inputs[line.number] - timing.drawing_ms, inputs[line.number]))
                drawing_s += [timing.drawing_ms / 1000.0] if timing.drawing_ms > 0 else []
        elif isinstance(line, InForceLine):
            first_s = line.tick / TICKS_PER_SECOND - begin_s if first_s is None else first_s
            to_force += [line.ms - inputs[line.number]] if line.number in inputs else []
        elif isinstance(line, PaintedLine):
            to_paint += [line.ms - inputs[line.number]] if line.number in inputs else []
        else:
            if hidden_since is not None:
                hidden_ms += line.ms - hidden_since
            hidden_since = line.ms if line.event == "hidden" else None
            disconnections += line.event == "disconnected"
    if hidden_since is not None:
        hidden_ms += last_ms - hidden_since
    lost = sum(any(began <= ms <= ended for began, ended in spans) for ms in captured_ms)
    return {
        "commands": commands,
        "commands_per_minute": 60.0 * commands / played_s if played_s > 0 else 0.0,
        "first_command_s": first_s,
        "drawing_s_per_command": float(np.mean(drawing_s)) if drawing_s else None,
        "lost_while_drawing": lost,
        "input_to_in_force_ms": _median(to_force),
        "input_to_painted_ms": _median(to_paint),
        "disconnections": disconnections,
        "hidden_s": hidden_ms / 1000.0,
    }


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def summarise(rows: Sequence[SeatRow]) -> list[SummaryRow]:
    """Return the summary of the games that two sides played from their start to their end."""
    groups: dict[tuple[str, ...], list[SeatRow]] = {}
    for row in rows:
        if row.outcome != "stopped" and not row.taken_over and row.opponent_kind != "free":
            key = (row.kind, row.player, row.opponent_kind, row.opponent, row.config_hash)
            groups.setdefault(key, []).append(row)
    summary = []
    for (kind, player, opponent_kind, opponent, config_hash), group in sorted(groups.items()):
        outcomes = [row.outcome for row in group]
        wins = outcomes.count("win")
        low, high = wilson(wins, len(group))
        median, mean = kaplan_meier([row.seconds for row in group], [row.outcome != "draw" for row in group])
        summary.append(
            SummaryRow(
                kind=kind,
                player=player,
                opponent_kind=opponent_kind,
                opponent=opponent,
                config_hash=config_hash,
                rules_hash=group[0].rules_hash,
                min_command_interval=group[0].min_command_interval,
                games=len(group),
                wins=wins,
                draws=outcomes.count("draw"),
                losses=outcomes.count("loss"),
                win_rate=wins / len(group),
                win_rate_low=low,
                win_rate_high=high,
                median_s=median,
                restricted_mean_s=mean,
                final_share=float(np.mean([row.final_share for row in group])),
                commands_per_minute=float(np.mean([row.commands_per_minute for row in group])),
            )
        )
    return summary


def read_folder(folder: Path) -> tuple[list[SeatRow], list[str]]:
    """Return the seats of all games of a folder, oldest first, and what could not be read and why.

    Raises
    ------
    RecordingError
        If there is no recorded game in it.
    """
    paths = sorted(folder.glob(f"*{SUFFIX}"))
    if not paths:
        raise RecordingError(f"there are no recorded games (*{SUFFIX}) in {folder}")
    rows, faults = [], []
    for path in paths:
        try:
            rows += seat_rows(Recording.read(path))
        except RecordingError as error:
            faults.append(str(error))
    return rows, faults


def write_tables(rows: Sequence[SeatRow], folder: Path, *, parquet: bool = False, command: str = "") -> list[Path]:
    """Write ``seats`` and ``summary`` as CSV, or Parquet, with ``schema.json`` beside them.

    The schema says what was called, too, and the versions; the rules stand in the recordings, and their hashes
    in the tables.

    Raises
    ------
    MissingExtraError
        If Parquet is asked for and not installed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    tables: dict[str, tuple[type[SeatRow] | type[SummaryRow], Sequence[SeatRow] | Sequence[SummaryRow]]] = {
        "seats": (SeatRow, rows),
        "summary": (SummaryRow, summarise(rows)),
    }
    for name, (kind, entries) in tables.items():
        names = [field.name for field in fields(kind)]
        path = folder / f"{name}.{'parquet' if parquet else 'csv'}"
        if parquet:
            arrow = require_extra("pyarrow", "study")
            columns = {column: [getattr(entry, column) for entry in entries] for column in names}
            require_extra("pyarrow.parquet", "study").write_table(arrow.table(columns), path)
        else:
            with path.open("w", newline="") as file:
                writer = csv.DictWriter(file, names)
                writer.writeheader()
                writer.writerows([{key: _plain(value) for key, value in asdict(entry).items()} for entry in entries])
        written.append(path)
    schema = {
        "version": SCHEMA_VERSION,
        "versions": versions(),
        "command": command,
        "tables": {name: {field.name: str(field.type) for field in fields(kind)} for name, (kind, _) in tables.items()},
    }
    (folder / "schema.json").write_text(json.dumps(schema, indent=2) + "\n")
    return [*written, folder / "schema.json"]


def _plain(value: Any) -> Any:
    """Return a value for CSV; a label that a spreadsheet would take for a formula is quoted."""
    if isinstance(value, float):
        return round(value, 6)
    return f"'{value}" if isinstance(value, str) and value[:1] in ("=", "+", "-", "@") else value
