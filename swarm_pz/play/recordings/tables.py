"""Tables of a folder of recorded games: results, lengths, and the habits of players.

Times to the end of a game are censored where nobody won: a draw says only that a win takes longer. So
medians are Kaplan-Meier's, and means are restricted to the time limit; see `swarm_pz.evaluation.survival`.

Only games that were played are summed up: what is left out, and why, stands in every row.

Each row is of games that are independent of each other: of a game whose two seats are the same player (of two people
without labels, say) both seats are in one row, where a win of one is a loss of the other, so it counts once.
"""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import Field, astuple, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.config import RED, TEAM_NAMES
from swarm_pz.errors import RecordingError, require_extra
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.evaluation.provenance import versions
from swarm_pz.evaluation.survival import kaplan_meier
from swarm_pz.play.recordings.folder import SUFFIX
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.seats import SeatRow, column, seat_rows

SCHEMA_VERSION = 6
NOTES = {
    "text": "In CSV, text that begins with = + - @ TAB or CR has an apostrophe before it, so that no spreadsheet "
    "takes it for a formula.",
    "left_out": "Why a game is not in the summary; empty if it is. Lessons, games that a player left (for good, or "
    "away at the end), games that a control system's fault ended and games in which a person gave no command are in it "
    "with --all, if they have a result.",
    "both_seats": "Player and opponent are the same, so that both seats of each game are in the row. Each game counts "
    "once, as red's: won is what red won, and win_rate tells whether a side is better off, not a player.",
}
_TYPES = {"str": "text", "int": "whole number", "float": "number", "bool": "truth"}
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_KEY = ("kind", "player", "system", "opponent_kind", "opponent", "opponent_system", "config_hash")
"""Columns in which the games of a row of the summary are alike."""


@dataclass(frozen=True, kw_only=True)
class SummaryRow:
    """All games that count of one player against one opponent, of one kind and under one configuration."""

    kind: str = column("person, program or policy")
    player: str = column("policy or label")
    system: str = column("control system that flew the player's drones")
    opponent_kind: str = column("person, program or policy")
    opponent: str = column("the opponent's policy or label")
    opponent_system: str = column("control system that flew the opponent's drones")
    both_seats: bool = column(
        "whether player and opponent are the same, flown by the same control system, so that both seats of each game "
        "are of this row: it counts once, as red's, and what is won, lost and the share at the end are red's"
    )
    config_hash: str = column("of the configuration of the table, the rules among it")
    rules_hash: str = column("of the rules of the games")
    rules: str = column("the preset whose rules these are; empty if it is none")
    min_command_interval: float = column("between two commands of a team that come into force, at least", "s of game")
    games: int = column("games that count", "count")
    wins: int = column("games that the player won", "count")
    draws: int = column("games that nobody won", "count")
    losses: int = column("games that the opponent won", "count")
    win_rate: float = column("share of the games that the player won", "1")
    win_rate_low: float = column("lower end of Wilson's 95 % interval, which takes games for independent", "1")
    win_rate_high: float = column("upper end of that interval", "1")
    median_s: float | None = column(
        "Kaplan-Meier median of the time to a win of either side; empty if it is later than the last win", "s of game"
    )
    restricted_mean_s: float = column("mean of that time, restricted to the longest game", "s of game")
    final_share: float = column("share of all drones that were the player's at the end, in the mean", "1")
    commands_per_minute: float = column("commands of a seat a minute of game, in the mean", "1/min")


def counts(row: SeatRow, every_game: bool = False) -> bool:
    """Tell whether a game is in the summary; with `every_game`, lessons and games that were left are, too."""
    has_result = row.outcome != "stopped" and row.opponent_kind != "free"
    return has_result and (every_game or not row.left_out)


def left_out(rows: Sequence[SeatRow], every_game: bool = False) -> dict[str, int]:
    """Return the numbers of games that are not in the summary, by reason."""
    reasons = {row.recording: row.left_out for row in rows if not counts(row, every_game)}
    return dict(sorted(Counter(reasons.values()).items()))


def summarise(rows: Sequence[SeatRow], every_game: bool = False) -> list[SummaryRow]:
    """Return the summary of the games that count; with `every_game`, as of `counts`, also of others."""
    groups: dict[tuple[str, ...], list[SeatRow]] = {}
    for row in rows:
        if counts(row, every_game):
            groups.setdefault(tuple(getattr(row, name) for name in _KEY), []).append(row)
    return [_summary(groups[key]) for key in sorted(groups)]


def _summary(seats: Sequence[SeatRow]) -> SummaryRow:
    """Return the row of seats that are alike."""
    first = seats[0]
    player, opponent = (first.kind, first.player, first.system), (first.opponent_kind, first.opponent)
    both_seats = player == (*opponent, first.opponent_system)
    games = [row for row in seats if row.side == TEAM_NAMES[RED]] if both_seats else seats
    outcomes = [row.outcome for row in games]
    wins = outcomes.count("win")
    low, high = wilson(wins, len(games))
    median, mean = kaplan_meier([row.seconds for row in games], [row.outcome != "draw" for row in games])
    return SummaryRow(
        **{name: getattr(first, name) for name in (*_KEY, "rules_hash", "rules", "min_command_interval")},
        both_seats=both_seats,
        games=len(games),
        wins=wins,
        draws=outcomes.count("draw"),
        losses=outcomes.count("loss"),
        win_rate=wins / len(games),
        win_rate_low=low,
        win_rate_high=high,
        median_s=median,
        restricted_mean_s=mean,
        final_share=float(np.mean([row.final_share for row in games])),
        commands_per_minute=float(np.mean([row.commands_per_minute for row in seats])),
    )


def read_folder(folder: Path) -> tuple[list[SeatRow], list[str]]:
    """Return the seats of all games of a folder, oldest first, and the errors of files that could not be read.

    Raises RecordingError if there is no recorded game in it.
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


def write_tables(
    rows: Sequence[SeatRow], folder: Path, *, every_game: bool = False, parquet: bool = False, command: str = ""
) -> list[Path]:
    """Write ``seats`` and ``summary`` as CSV, or Parquet, with ``schema.json`` beside them.

    The schema has the command, the versions, and the numbers of games that the summary leaves out, by reason. Raises
    MissingExtraError if Parquet is asked for and not installed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tables: dict[str, tuple[type[Any], Sequence[Any]]] = {
        "seats": (SeatRow, rows),
        "summary": (SummaryRow, summarise(rows, every_game)),
    }
    paths = [folder / f"{name}.{'parquet' if parquet else 'csv'}" for name in tables]
    for path, (kind, entries) in zip(paths, tables.values(), strict=True):
        write_table(entries, kind, path)
    schema = {
        "version": SCHEMA_VERSION,
        "versions": versions(),
        "command": command,
        "notes": NOTES,
        "every_game": every_game,
        "left_out": left_out(rows, every_game),
        "tables": {name: columns_of(kind) for name, (kind, _) in tables.items()},
    }
    (folder / "schema.json").write_text(json.dumps(schema, indent=2) + "\n")
    return [*paths, folder / "schema.json"]


def columns_of(kind: type[Any]) -> dict[str, dict[str, Any]]:
    """Return the description of every column of a table, as plain values."""
    known = {entry.name: entry.metadata for entry in fields(SeatRow)}
    return {
        entry.name: {
            **(entry.metadata or known[entry.name]),
            "type": _TYPES[_type_of(entry)],
            "may_be_empty": str(entry.type).endswith(" | None"),
        }
        for entry in fields(kind)
    }


def _type_of(entry: Field[Any]) -> str:
    return str(entry.type).removesuffix(" | None")


def write_table(rows: Sequence[Any], kind: type[Any], path: Path) -> None:
    """Write rows of a dataclass as Parquet or, with any other suffix, as CSV in UTF-8.

    Columns of Parquet have the same types even where they are empty.
    """
    if path.suffix == ".parquet":
        arrow = require_extra("pyarrow", "lab")
        known = {"str": arrow.string(), "int": arrow.int64(), "float": arrow.float64(), "bool": arrow.bool_()}
        schema = arrow.schema([(entry.name, known[_type_of(entry)]) for entry in fields(kind)])
        columns = {name: [getattr(row, name) for row in rows] for name in schema.names}
        require_extra("pyarrow.parquet", "lab").write_table(arrow.table(columns, schema=schema), path)
        return
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(entry.name for entry in fields(kind))
        writer.writerows([_plain(value) for value in astuple(row)] for row in rows)


def _plain(value: Any) -> Any:
    """Return a value for CSV; a label that a spreadsheet would take for a formula is quoted."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return round(value, 6)
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value
