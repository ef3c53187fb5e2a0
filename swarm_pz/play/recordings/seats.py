"""A recorded game as rows: what each of its seats did, and whether the game was one that counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from swarm_pz.config import PRESETS, TEAM_NAMES, TICKS_PER_SECOND, GameConfig
from swarm_pz.play.recordings.format import (
    CapturedLine,
    CommandLine,
    EndLine,
    InForceLine,
    PaintedLine,
    Recording,
    SeatLine,
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


def trial_rows(recording: Recording) -> list[dict[str, Any]]:
    """Return a row for each seat, as experiments keep them: `seat_rows`, captures and losses, and the start's seed."""
    takers = [capture.team for capture in recording.of(CapturedLine)]
    counts = {name: takers.count(team) for team, name in enumerate(TEAM_NAMES)}
    more = {"seed": recording.header.seed}
    rows = seat_rows(recording)
    return [asdict(row) | {"captured": counts[row.side], "lost": len(takers) - counts[row.side]} | more for row in rows]


def seat_rows(recording: Recording) -> list[SeatRow]:
    """Return what the seats of a game did; seats that nobody took are left out."""
    header, config, game, end = recording.header, recording.config, recording.config.game, recording.end
    seconds = (end.tick if end is not None else recording.last_tick) / TICKS_PER_SECOND
    teams = np.repeat((0, 1), game.team_sizes)
    for capture in recording.of(CapturedLine):
        teams[capture.drone] = capture.team
    seats = (header.red, header.blue)
    habits = [_habits(recording, team, seconds) for team in range(2)]
    left_out = _left_out(recording, [habit["commands"] for habit in habits])
    return [
        SeatRow(
            recording=recording.name,
            started=header.started,
            config_hash=config.hash,
            rules_hash=game.rules_hash,
            rules=_PRESET_OF.get(game.rules_hash, ""),
            mapping=config.mapping,
            min_command_interval=config.min_command_interval,
            speed=config.speed,
            time_limit=game.time_limit,
            taken_over=header.origin is not None,
            lesson=header.lesson,
            ended_by=end.ended_by if end is not None else "",
            left_out=left_out,
            side=TEAM_NAMES[team],
            kind=seat.kind,
            player=seat.policy or seat.label,
            system=game.team_controllers[team],
            opponent_kind=other.kind,
            opponent=other.policy or other.label,
            opponent_system=game.team_controllers[1 - team],
            start_size=game.team_sizes[team],
            drones=game.num_drones,
            outcome=outcome_of(end, TEAM_NAMES[team]),
            seconds=seconds,
            final_share=float((teams == team).mean()),
            **habits[team],
        )
        for team, (seat, other) in enumerate((seats, seats[::-1]))
        if seat.kind != "free"
    ]


def outcome_of(end: EndLine | None, side: str) -> str:
    """Return how a game ended for a side: "win", "draw" or "loss"; "stopped" if nobody played it to its end."""
    if end is None or end.outcome in ("stopped", "draw"):
        return "draw" if end is not None and end.outcome == "draw" else "stopped"
    return "win" if end.outcome == side else "loss"


def _left_out(recording: Recording, commands: Sequence[int]) -> str:
    """Return why a game does not count in the summary; empty if it does."""
    header, end, seats = recording.header, recording.end, (recording.header.red, recording.header.blue)
    ended_by = end.ended_by if end is not None else ""
    reasons = {
        "unfinished": end is None,
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
    origin, live = recording.header.origin, recording.live
    begin_s = origin.tick / TICKS_PER_SECOND if origin is not None else 0.0
    inputs: dict[int, float] = {}
    commands, automatic, forced, first_s = 0, 0, 0, None
    drawing_s, to_force, to_paint, spans = [], [], [], []
    # In order, since a page that was reloaded counts its commands from the start again.
    for line in live:
        if not isinstance(line, CommandLine | InForceLine | PaintedLine) or line.team != team:
            continue
        sender = "" if isinstance(line, PaintedLine) else line.sender
        if sender and not sender.startswith(SHARED):
            automatic += isinstance(line, CommandLine)
        elif isinstance(line, CommandLine):
            if sender:
                continue  # made of the player's, which counts by itself
            commands += 1
            inputs.pop(line.number, None)
            if (timing := line.timing) is not None:
                # When it arrived, less what its sender says had passed since.
                made = line.received_ms - (timing.sent_ms - timing.input_ms) - timing.round_trip_ms / 2
                inputs[line.number] = made
                spans.append((made - timing.drawing_ms, made))
                drawing_s += [timing.drawing_ms / 1000.0] if timing.drawing_ms > 0 else []
        elif isinstance(line, PaintedLine):
            to_paint += [line.ms - inputs[line.number]] if line.number in inputs else []
        elif not sender or line.number not in (0, forced):  # else its helper alone asked for something else
            forced = line.number
            first_s = line.tick / TICKS_PER_SECOND - begin_s if first_s is None else first_s
            to_force += [line.ms - inputs[line.number]] if line.number in inputs else []
    taken = [line.tick / TICKS_PER_SECOND for line in live if isinstance(line, CapturedLine) and line.team != team]
    lost_ms = [1000.0 * (second - begin_s) / recording.config.speed for second in taken]
    seat = [line for line in live if isinstance(line, SeatLine) and line.team == team]
    links = [line for line in seat if line.event in ("connected", "disconnected")]
    last_ms = max((getattr(line, "ms", 0.0) for line in live), default=0.0)
    return {
        "commands": commands,
        "automatic_commands": automatic,
        "commands_per_minute": 60.0 * commands / (seconds - begin_s) if seconds > begin_s else 0.0,
        "first_command_s": first_s,
        "drawing_s_per_command": float(np.mean(drawing_s)) if drawing_s else None,
        "lost_while_drawing": sum(any(began <= ms <= ended for began, ended in spans) for ms in lost_ms),
        "input_to_in_force_ms": _median(to_force),
        "input_to_painted_ms": _median(to_paint),
        "disconnections": sum(line.event == "disconnected" for line in seat),
        "away_s": _lasted_s(links, "disconnected", last_ms),
        "hidden_s": _lasted_s(seat, "hidden", last_ms),
    }


def _lasted_s(lines: Sequence[SeatLine], event: str, last_ms: float) -> float:
    """Return the seconds from each line of an event to the next line, or to the last moment."""
    ends = [*(line.ms for line in lines[1:]), max(last_ms, 0.0)]
    return sum(end - line.ms for line, end in zip(lines, ends, strict=False) if line.event == event) / 1000.0


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None
