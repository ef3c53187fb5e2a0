"""A folder of recorded games as tables: who won, how fast, and what people did meanwhile.

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
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.config import RED, TEAM_NAMES
from swarm_pz.errors import RecordingError, require_extra
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.evaluation.provenance import versions
from swarm_pz.evaluation.survival import kaplan_meier
from swarm_pz.play.recordings.folder import SUFFIX
from swarm_pz.play.recordings.format import Recording
from swarm_pz.play.recordings.seats import SeatRow, seat_rows

SCHEMA_VERSION = 5
NOTES = {
    "text": "In CSV, text that begins with = + - @ TAB or CR has an apostrophe before it, so that no spreadsheet "
    "takes it for a formula.",
    "left_out": "Why a game is not in the summary; empty if it is. Lessons, games that a player left (for good, or "
    "away at the end), games that a control system's fault ended and games in which a person gave no command are in it "
    "with --all, if they have a result.",
    "both_seats": "Player and opponent are the same, so that both seats of each game are in the row. Each game counts "
    "once, as red's: won is what red won, and win_rate tells whether a side is better off, not a player.",
}
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


@dataclass(frozen=True, kw_only=True)
class SummaryRow:
    """All games that count of one player against one opponent, of one kind and under one configuration.

    Attributes
    ----------
    kind, player, system, opponent_kind, opponent, opponent_system : str
    both_seats : bool
        Player and opponent are the same, flown by the same control system, so that both seats of each game are of this
        row: it counts once, as red's, and what is won, lost and the share at the end are red's.
    config_hash, rules_hash, rules : str
    min_command_interval : float
    games, wins, draws, losses : int
    win_rate, win_rate_low, win_rate_high : float
        With Wilson's 95 % interval, which takes games for independent.
    median_s : float or None
        Kaplan-Meier median of the time to a win of either side; None if it is later than the last win.
    restricted_mean_s : float
        Mean of that time, restricted to the longest game.
    final_share : float
    commands_per_minute : float
        Of a seat; with both seats, of either.
    """

    kind: str
    player: str
    system: str
    opponent_kind: str
    opponent: str
    opponent_system: str
    both_seats: bool
    config_hash: str
    rules_hash: str
    rules: str
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


def counts(row: SeatRow, every_game: bool = False) -> bool:
    """Tell whether a game is in the summary, perhaps in that of every game that has a result."""
    has_result = row.outcome != "stopped" and not row.taken_over and row.opponent_kind != "free"
    return has_result and (every_game or not row.left_out)


def left_out(rows: Sequence[SeatRow], every_game: bool = False) -> dict[str, int]:
    """Return how many games are not in the summary, by reason."""
    reasons = {row.recording: row.left_out for row in rows if not counts(row, every_game)}
    return dict(sorted(Counter(reasons.values()).items()))


def summarise(rows: Sequence[SeatRow], every_game: bool = False) -> list[SummaryRow]:
    """Return the summary of the games that two sides played from their start to their end.

    Parameters
    ----------
    rows : sequence of SeatRow
    every_game : bool
        Count lessons, games that were left and games in which a person gave no command, too.
    """
    groups: dict[tuple[str, ...], list[SeatRow]] = {}
    for row in rows:
        if counts(row, every_game):
            key = (row.kind, row.player, row.system, row.opponent_kind, row.opponent, row.opponent_system)
            groups.setdefault((*key, row.config_hash), []).append(row)
    summary = []
    for (*player_of, config_hash), seats in sorted(groups.items()):
        kind, player, system, opponent_kind, opponent, opponent_system = player_of
        both_seats = (kind, player, system) == (opponent_kind, opponent, opponent_system)
        group = [row for row in seats if row.side == TEAM_NAMES[RED]] if both_seats else seats
        outcomes = [row.outcome for row in group]
        wins = outcomes.count("win")
        low, high = wilson(wins, len(group))
        median, mean = kaplan_meier([row.seconds for row in group], [row.outcome != "draw" for row in group])
        summary.append(
            SummaryRow(
                kind=kind,
                player=player,
                system=system,
                opponent_kind=opponent_kind,
                opponent=opponent,
                opponent_system=opponent_system,
                both_seats=both_seats,
                config_hash=config_hash,
                rules_hash=group[0].rules_hash,
                rules=group[0].rules,
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
                commands_per_minute=float(np.mean([row.commands_per_minute for row in seats])),
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


def write_tables(
    rows: Sequence[SeatRow], folder: Path, *, every_game: bool = False, parquet: bool = False, command: str = ""
) -> list[Path]:
    """Write ``seats`` and ``summary`` as CSV, or Parquet, with ``schema.json`` beside them.

    The schema says what was called, too, the versions, and how many games the summary leaves out and why; the rules
    stand in the recordings, and their hashes in the tables.

    Raises
    ------
    MissingExtraError
        If Parquet is asked for and not installed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    tables: dict[str, tuple[type[SeatRow] | type[SummaryRow], Sequence[SeatRow] | Sequence[SummaryRow]]] = {
        "seats": (SeatRow, rows),
        "summary": (SummaryRow, summarise(rows, every_game)),
    }
    for name, (kind, entries) in tables.items():
        names = [field.name for field in fields(kind)]
        path = folder / f"{name}.{'parquet' if parquet else 'csv'}"
        if parquet:
            arrow = require_extra("pyarrow", "lab")
            columns = {column: [getattr(entry, column) for entry in entries] for column in names}
            require_extra("pyarrow.parquet", "lab").write_table(arrow.table(columns), path)
        else:
            with path.open("w", newline="") as file:
                writer = csv.DictWriter(file, names)
                writer.writeheader()
                writer.writerows([{key: plain(value) for key, value in asdict(entry).items()} for entry in entries])
        written.append(path)
    schema = {
        "version": SCHEMA_VERSION,
        "versions": versions(),
        "command": command,
        "notes": NOTES,
        "every_game": every_game,
        "left_out": left_out(rows, every_game),
        "tables": {name: {field.name: str(field.type) for field in fields(kind)} for name, (kind, _) in tables.items()},
    }
    (folder / "schema.json").write_text(json.dumps(schema, indent=2) + "\n")
    return [*written, folder / "schema.json"]


def plain(value: Any) -> Any:
    """Return a value for CSV; a label that a spreadsheet would take for a formula is quoted."""
    if isinstance(value, float):
        return round(value, 6)
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value
