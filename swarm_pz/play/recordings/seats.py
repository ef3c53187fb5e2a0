"""A recorded game as rows: what each of its seats did, and whether the game was one that counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from swarm_pz.config import PRESETS, TEAM_NAMES, TICKS_PER_SECOND, GameConfig
from swarm_pz.play.recordings.format import (
    CapturedLine,
    ClockLine,
    CommandLine,
    EndLine,
    FrameLine,
    InForceLine,
    PaintedLine,
    Recording,
)
from swarm_pz.play.shared import SHARED

_PRESET_OF = {GameConfig.preset(name).rules_hash: name for name in PRESETS}


@dataclass(frozen=True, kw_only=True)
class SeatRow:
    """What one seat did in one game; durations in seconds, delays in milliseconds.

    Attributes
    ----------
    recording, started : str
    config_hash, rules_hash : str
        Of the table, and of the game that it plays.
    rules : str
        The preset whose rules these are; empty if it is none.
    mapping : str
    min_command_interval, speed, time_limit : float
    taken_over : bool
        The game went on from a moment of another one.
    lesson : bool
        It was a lesson, not a match.
    ended_by : {"capture", "time", "left", "server", "forfeit", ""}
        "left" if a client was away for good or at the end, however the game ended; "forfeit" if a control system
        failed; empty if it is unfinished.
    left_out : {"", "unfinished", "taken over", "no opponent", "lesson", "left", "stopped", "forfeit", "no command"}
        Why the game does not count in the summary; empty if it does.
    side : {"red", "blue"}
    kind : {"person", "program", "policy"}
    player : str
        Policy or label.
    system : str
        The control system that flew it.
    opponent_kind : {"person", "program", "policy", "free"}
    opponent, opponent_system : str
        The other seat's policy or label, and what flew it.
    start_size, drones : int
        Drones at the start, and of both teams.
    outcome : {"win", "draw", "loss", "stopped"}
    seconds : float
        Of game time.
    final_share : float
        Of all drones.
    commands : int
        Its player's own.
    automatic_commands : int
        Those that automatic responses gave in its player's place.
    commands_per_minute : float
        Of its player's own.
    first_command_s : float or None
    drawing_s_per_command : float or None
    lost_while_drawing : int
        Drones lost while a drawing was made.
    input_to_in_force_ms, input_to_painted_ms : float or None
        Medians.
    disconnections : int
    away_s, hidden_s : float
        For how long nobody was connected, and the page was hidden.
    """

    recording: str
    started: str
    config_hash: str
    rules_hash: str
    rules: str
    mapping: str
    min_command_interval: float
    speed: float
    time_limit: float
    taken_over: bool
    lesson: bool
    ended_by: str
    left_out: str
    side: str
    kind: str
    player: str
    system: str
    opponent_kind: str
    opponent: str
    opponent_system: str
    start_size: int
    drones: int
    outcome: str
    seconds: float
    final_share: float
    commands: int
    automatic_commands: int
    commands_per_minute: float
    first_command_s: float | None
    drawing_s_per_command: float | None
    lost_while_drawing: int
    input_to_in_force_ms: float | None
    input_to_painted_ms: float | None
    disconnections: int
    away_s: float
    hidden_s: float


def seat_rows(recording: Recording) -> list[SeatRow]:
    """Return what the seats of a game did; seats that nobody took are left out."""
    header, config, end = recording.header, recording.config, recording.end
    tick = end.tick if end is not None else recording.last_tick
    seconds = tick / TICKS_PER_SECOND
    teams = np.repeat((0, 1), config.game.team_sizes)
    for capture in recording.of(CapturedLine):
        teams[capture.drone] = capture.team
    seats = (header.red, header.blue)
    habits = [_habits(recording, team, seconds) for team in range(2)]
    ended_by = _ended_by(recording)
    left_out = _left_out(recording, ended_by, [habit["commands"] for habit in habits])
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
                config_hash=config.hash,
                rules_hash=config.game.rules_hash,
                rules=_PRESET_OF.get(config.game.rules_hash, ""),
                mapping=config.mapping,
                min_command_interval=config.min_command_interval,
                speed=config.speed,
                time_limit=config.game.time_limit,
                taken_over=header.origin is not None,
                lesson=header.lesson,
                ended_by=ended_by,
                left_out=left_out,
                side=TEAM_NAMES[team],
                kind=seat.kind,
                player=seat.policy or seat.label,
                system=config.game.team_controllers[team],
                opponent_kind=other.kind,
                opponent=other.policy or other.label,
                opponent_system=config.game.team_controllers[1 - team],
                start_size=config.game.team_sizes[team],
                drones=config.game.num_drones,
                outcome=outcome,
                seconds=seconds,
                final_share=float((teams == team).mean()),
                **habits[team],
            )
        )
    return rows


def _ended_by(recording: Recording) -> str:
    end = recording.end
    if end is None:
        return ""
    return end.ended_by


def _left_out(recording: Recording, ended_by: str, commands: Sequence[int]) -> str:
    """Return why a game does not count in the summary; empty if it does."""
    header, seats = recording.header, (recording.header.red, recording.header.blue)
    reasons = {
        "unfinished": recording.end is None,
        "taken over": header.origin is not None,
        "no opponent": "free" in (seat.kind for seat in seats),
        "lesson": header.lesson,
        "left": ended_by == "left",
        "stopped": ended_by == "server",
        "forfeit": ended_by == "forfeit",
        "no command": any(seat.kind == "person" and not count for seat, count in zip(seats, commands, strict=True)),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")


def _habits(recording: Recording, team: int, seconds: float) -> dict[str, Any]:
    """Return what a seat's player did; of a game that was taken over, only from there on."""
    origin = recording.header.origin
    begin_s = origin.tick / TICKS_PER_SECOND if origin is not None else 0.0
    played_s = seconds - begin_s
    speed = recording.config.speed
    inputs: dict[int, float] = {}
    forced = 0
    drawing_s, first_s, commands, automatic, lost, disconnections = [], None, 0, 0, 0, 0
    spans: list[tuple[float, float]] = []
    captured_ms: list[float] = []
    to_force, to_paint = [], []
    hidden_ms, hidden_since, last_ms = 0.0, None, 0.0
    away_ms, away_since = 0.0, None
    # In order, since a page that was reloaded counts its commands from the start again.
    for line in recording.live:
        last_ms = max(last_ms, getattr(line, "ms", 0.0))
        if isinstance(line, CapturedLine):
            if line.team != team:
                captured_ms.append(1000.0 * (line.tick / TICKS_PER_SECOND - begin_s) / speed)
        elif isinstance(line, FrameLine | EndLine | ClockLine) or line.team != team:
            continue
        elif isinstance(line, CommandLine | InForceLine) and line.sender and not line.sender.startswith(SHARED):
            automatic += isinstance(line, CommandLine)
        elif isinstance(line, CommandLine) and line.sender:
            continue  # made of the player's, which counts by itself
        elif isinstance(line, InForceLine) and line.sender and line.number in (0, forced):
            continue  # its helper alone asked for something else
        elif isinstance(line, CommandLine):
            commands += 1
            inputs.pop(line.number, None)
            if (timing := line.timing) is not None:
                # When it arrived, less what its sender says had passed since.
                inputs[line.number] = line.received_ms - (timing.sent_ms - timing.input_ms) - timing.round_trip_ms / 2
                spans.append((inputs[line.number] - timing.drawing_ms, inputs[line.number]))
                drawing_s += [timing.drawing_ms / 1000.0] if timing.drawing_ms > 0 else []
        elif isinstance(line, InForceLine):
            forced = line.number
            first_s = line.tick / TICKS_PER_SECOND - begin_s if first_s is None else first_s
            to_force += [line.ms - inputs[line.number]] if line.number in inputs else []
        elif isinstance(line, PaintedLine):
            to_paint += [line.ms - inputs[line.number]] if line.number in inputs else []
        else:
            if hidden_since is not None:
                hidden_ms += line.ms - hidden_since
            hidden_since = line.ms if line.event == "hidden" else None
            disconnections += line.event == "disconnected"
            if line.event == "connected" and away_since is not None:
                away_ms, away_since = away_ms + line.ms - away_since, None
            elif line.event == "disconnected" and away_since is None:
                away_since = line.ms
    if away_since is not None:
        away_ms += last_ms - away_since
    if hidden_since is not None:
        hidden_ms += last_ms - hidden_since
    lost = sum(any(began <= ms <= ended for began, ended in spans) for ms in captured_ms)
    return {
        "commands": commands,
        "automatic_commands": automatic,
        "commands_per_minute": 60.0 * commands / played_s if played_s > 0 else 0.0,
        "first_command_s": first_s,
        "drawing_s_per_command": float(np.mean(drawing_s)) if drawing_s else None,
        "lost_while_drawing": lost,
        "input_to_in_force_ms": _median(to_force),
        "input_to_painted_ms": _median(to_paint),
        "disconnections": disconnections,
        "away_s": away_ms / 1000.0,
        "hidden_s": hidden_ms / 1000.0,
    }


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None
