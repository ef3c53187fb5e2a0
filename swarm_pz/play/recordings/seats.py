"""A recorded game as rows: what each of its seats did, and whether the game should count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, dataclass, field
from typing import Any

import numpy as np

from swarm_pz.config import PRESETS, TEAM_NAMES, TICKS_PER_SECOND, GameConfig
from swarm_pz.play.protocol import CapturedMessage, EndMessage, InForceMessage, SeatCommand, SeatMessage
from swarm_pz.play.recordings.recording import Recording

_PRESET_OF = {GameConfig.preset(name).rules_hash: name for name in PRESETS}


def column(about: str, unit: str = "", default: Any = MISSING) -> Any:
    """Return a field of a row, with its description."""
    return field(default=default, metadata={"about": about, "unit": unit})


@dataclass(frozen=True, kw_only=True)
class SeatRow:
    """One seat in one game."""

    recording: str = column("file of the recording")
    started: str = column("when the game began, on the server's clock, as ISO 8601")
    config_hash: str = column("of the configuration of the table, the rules among it")
    rules_hash: str = column("of the rules of the game: games of the same rules have the same")
    rules: str = column("the preset whose rules these are; empty if it is none")
    mapping: str = column("how drawings become densities")
    min_command_interval: float = column("between two commands of a team that come into force, at least", "s of game")
    speed: float = column("seconds of game that pass in a second", "1")
    time_limit: float = column("when the game ends in a draw", "s of game")
    lesson: bool = column("whether it was a lesson, not a match")
    ended_by: str = column(
        "capture, time, left (a client was away for good or at the end, however the game ended), server (it was told "
        "to end) or forfeit (a control system failed); empty if it is unfinished"
    )
    left_out: str = column(
        "why the game should not count: unfinished, no opponent, lesson, left, stopped, "
        "forfeit or no command; empty if it does"
    )
    side: str = column("red or blue")
    kind: str = column("person, program or policy")
    player: str = column("policy or label")
    system: str = column("control system that flew the seat's drones")
    opponent_kind: str = column("person, program, policy or free")
    opponent: str = column("the other seat's policy or label")
    opponent_system: str = column("control system that flew the other seat's drones")
    start_size: int = column("drones of the seat at the start", "count")
    drones: int = column("drones of both teams", "count")
    command_delay_ms: float = column("delay of the seat's commands that was asked for", "ms")
    display_delay_ms: float = column("delay that was asked for of what the seat was shown", "ms")
    frame_rate: int = column("moments that the seat was shown", "1/s")
    hide: str = column("things that the seat was not shown, with + between them")
    share: float = column("the helper's part of each command", "1")
    helper: str = column("the policy that made this part")
    outcome: str = column("win, draw or loss of the seat; stopped if nobody played the game to its end")
    seconds: float = column("length of the game, as far as it came", "s of game")
    final_share: float = column("share of all drones that this side had at the end", "1")
    commands: int = column("commands that the seat's player gave", "count")
    commands_per_minute: float = column("commands of the player a minute of game", "1/min")
    first_command_s: float | None = column("when the first command came into force", "s of game")
    drawing_s_per_command: float | None = column("how long a drawing took, in the mean", "s")
    input_to_in_force_ms: float | None = column("from the end of an input to its command in force, median", "ms")
    disconnections: int = column("how often the seat's connection was lost", "count")
    away_s: float = column("how long nobody was connected", "s")
    hidden_s: float = column("how long the page was hidden", "s")


def seat_rows(recording: Recording) -> list[SeatRow]:
    """Return a row for each seat of a game that somebody took."""
    header, config, game, end = recording.header, recording.config, recording.config.game, recording.end
    seconds = (end.tick if end is not None else recording.last_tick) / TICKS_PER_SECOND
    teams = np.repeat((0, 1), game.team_sizes)
    for capture in recording.of(CapturedMessage):
        teams[capture.drone] = capture.team
    seats = (header.red, header.blue)
    habits = [_habits(recording, team, seconds) for team in range(2)]
    varied = [one.to_dict() | {"hide": "+".join(one.hide)} for one in config.factors]
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
            time_limit=game.time_limit,
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
            **(varied[team] | {"speed": config.speed}),
            outcome=outcome_of(end, TEAM_NAMES[team]),
            seconds=seconds,
            final_share=float((teams == team).mean()),
            **habits[team],
        )
        for team, (seat, other) in enumerate((seats, seats[::-1]))
        if seat.kind != "free"
    ]


def outcome_of(end: EndMessage | None, side: str) -> str:
    """Return the outcome of a game for a side: "win", "draw" or "loss"; "stopped" if nobody played it to its end."""
    if end is None or end.outcome in ("stopped", "draw"):
        return "draw" if end is not None and end.outcome == "draw" else "stopped"
    return "win" if end.outcome == side else "loss"


def _left_out(recording: Recording, commands: Sequence[int]) -> str:
    """Return the reason why a game should not count; empty if it should."""
    header, end, seats = recording.header, recording.end, (recording.header.red, recording.header.blue)
    ended_by = end.ended_by if end is not None else ""
    reasons = {
        "unfinished": end is None,
        "no opponent": "free" in (seat.kind for seat in seats),
        "lesson": header.lesson,
        "left": ended_by == "left",
        "stopped": ended_by == "server",
        "forfeit": ended_by == "forfeit",
        "no command": any(seat.kind == "person" and not count for seat, count in zip(seats, commands, strict=True)),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")


def _habits(recording: Recording, team: int, seconds: float) -> dict[str, Any]:
    """Return a seat's columns about its player."""
    log = recording.log
    made: dict[int, float] = {}
    commands, forced, first_s = 0, 0, None
    drawing_s, to_force = [], []
    # In order, since a page that was reloaded counts its commands from the start again.
    for line in log:
        if not isinstance(line, SeatCommand | InForceMessage) or line.team != team:
            continue
        if isinstance(line, InForceMessage):
            if line.sender and line.number in (0, forced):
                continue  # only its helper's part is new
            forced = line.number
            first_s = line.tick / TICKS_PER_SECOND if first_s is None else first_s
            to_force += [line.server_ms - made[line.number]] if line.number in made else []
        elif not line.sender:  # a shared one is made from the player's, which is counted
            commands += 1
            made.pop(line.number, None)
            if (timing := line.timing) is not None:
                # The end of the input on the server's clock: arrival less the sender's delay and half the round trip.
                made[line.number] = line.server_ms - (timing.sent_ms - timing.input_ms) - timing.round_trip_ms / 2
                drawing_s += [timing.drawing_ms / 1000.0] if timing.drawing_ms > 0 else []
    seat = [line for line in recording.of(SeatMessage) if line.team == team]
    links = [line for line in seat if line.event in ("connected", "disconnected")]
    last_ms = max((getattr(line, "server_ms", 0.0) for line in log), default=0.0)
    return {
        "commands": commands,
        "commands_per_minute": 60.0 * commands / seconds if seconds else 0.0,
        "first_command_s": first_s,
        "drawing_s_per_command": float(np.mean(drawing_s)) if drawing_s else None,
        "input_to_in_force_ms": float(np.median(to_force)) if to_force else None,
        "disconnections": sum(line.event == "disconnected" for line in seat),
        "away_s": _lasted_s(links, "disconnected", last_ms),
        "hidden_s": _lasted_s(seat, "hidden", last_ms),
    }


def _lasted_s(lines: Sequence[SeatMessage], event: str, last_ms: float) -> float:
    """Return the total seconds from lines of an event to the next line, or to the last moment."""
    ends = [*(line.server_ms for line in lines[1:]), last_ms]
    return sum(end - line.server_ms for line, end in zip(lines, ends, strict=False) if line.event == event) / 1000.0
