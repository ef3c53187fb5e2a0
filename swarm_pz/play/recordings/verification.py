"""What in a recorded game cannot have been so, by the rules of the table that wrote it.

The simulation decides frames, captures, sizes and the end; the rules decide when commands came into force, a
drawing's density and who can have sent what. Nothing protects names, labels and times of clocks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from swarm_pz.config import TEAM_NAMES, TICKS_PER_CONTROL_PERIOD
from swarm_pz.errors import CommandError
from swarm_pz.play.commands import as_followed
from swarm_pz.play.game import LiveGame
from swarm_pz.play.recordings.format import (
    CommandLine,
    EndLine,
    InForceLine,
    PaintedLine,
    Recording,
    SeatLine,
    reason_of_end,
)
from swarm_pz.play.strokes import Stroke, attraction_of, density_of

_DENSITY_STEP = 1e-6
"""What a drawing's density may differ by, since another processor may have made it."""
_FIRST_LINE = 2
"""Number of the first event's line."""


@dataclass(frozen=True, kw_only=True)
class Verification:
    """How a recorded game compares with what follows from its commands and its start.

    Attributes
    ----------
    frames : int
        Frames compared.
    first_difference : int or None
        Tick at which the simulation first differs: the recording was changed, or made on another kind of processor.
    faults : tuple of str
        What cannot have been so on any processor, with the number of its line.
    finished : bool
        Whether the recording holds the game's end.
    in_page : bool
        Whether it was played in a page, and so each control period was simulated from its own frame.
    """

    frames: int
    first_difference: int | None
    faults: tuple[str, ...]
    finished: bool
    in_page: bool = False

    @property
    def verified(self) -> bool:
        """Whether there was something to compare, and all that is there comes out as recorded."""
        return self.frames > 0 and self.first_difference is None and not self.faults


def faults_of(recording: Recording, game: LiveGame | None) -> Iterator[str]:
    """Say what in a recording cannot have been so.

    `game` is the recorded game at its last tick; None if the simulation led elsewhere, so that its end is another one.
    """
    yield from _past(recording)
    yield from _schedule(recording)
    yield from _commands(recording)
    yield from _seats(recording)
    if game is not None:
        yield from _end(recording, game)


def _past(recording: Recording) -> Iterator[str]:
    """Say which lines are on the wrong side of the moment from which a game was taken over."""
    origin = recording.header.origin
    if origin is None:
        return
    for number, line in enumerate(recording.events, _FIRST_LINE):
        if isinstance(line, CommandLine) and line.tick == origin.tick:
            continue  # it may have come before or after
        if isinstance(line, PaintedLine | SeatLine):
            is_past = False
        else:
            came_later = isinstance(line, InForceLine | EndLine)  # what a tick led to is the past at that tick
            is_past = line.tick < origin.tick + (not came_later)
        if is_past != (number - _FIRST_LINE < origin.lines):
            side = "before" if is_past else "after"
            yield f"line {number}: it is of {side} tick {origin.tick}, from which the game was taken over"


def _schedule(recording: Recording) -> Iterator[str]:
    """Say which commands came into force at another moment than follows from when commands arrived."""
    interval, origin, end = recording.config.interval_ticks, recording.header.origin, recording.end
    begin = origin.tick if origin is not None else 0
    for team, side in enumerate(TEAM_NAMES):
        latest = before = -interval
        told = []
        for number, line in enumerate(recording.events, _FIRST_LINE):
            if isinstance(line, InForceLine) and line.team == team:
                if line.tick % TICKS_PER_CONTROL_PERIOD or line.tick - latest < interval:
                    yield f"line {number}: command {line.number} cannot come into force at tick {line.tick}"
                latest = line.tick
                if line.tick < begin:
                    before = latest
                else:
                    told.append((line.tick, _called(line)))
        own = [line for line in recording.live if isinstance(line, CommandLine) and line.team == team]
        due = _due([(line.tick, _called(line)) for line in own], before, interval)
        # Where the recording breaks off, what came into force at last may have been lost; where the game ended while
        # control systems chose accelerations, it came into force before.
        least = sum(tick < recording.last_tick for tick, _ in due)
        is_cut = end is None or end.outcome == "stopped" or end.ended_by == "forfeit"
        due = due[: max(least, len(told)) if is_cut else least]
        for tick, name in sorted(set(due) ^ set(told)):
            verb = "had to" if (tick, name) in due else "cannot"
            yield f"command {name} of {side} {verb} come into force at tick {tick}"


def _called(line: CommandLine | InForceLine) -> str:
    """Return what a command is called: its number, and who gave it in the player's place."""
    return f"{line.number} by {line.sender}" if line.sender else str(line.number)


def _due(arrived: list[tuple[int, str]], latest: int, interval: int) -> list[tuple[int, str]]:
    """Return the ticks at which commands come into force, of those that arrived at some; the latest one waits."""
    due: list[tuple[int, str]] = []
    for place, (tick, number) in enumerate(arrived):
        solve = -(-max(tick, latest + interval) // TICKS_PER_CONTROL_PERIOD) * TICKS_PER_CONTROL_PERIOD
        # One that arrives before that solve takes its place.
        if place + 1 == len(arrived) or arrived[place + 1][0] > solve:
            due.append((solve, number))
            latest = solve
    return due


def _commands(recording: Recording) -> Iterator[str]:
    """Say which commands cannot be their sender's."""
    header, config = recording.header, recording.config
    counted = [0, 0]
    lines = [(n, line) for n, line in enumerate(recording.events, _FIRST_LINE) if isinstance(line, CommandLine)]
    past = header.origin.lines if header.origin is not None else 0
    for (number, line), command in zip(lines, recording.commands, strict=True):
        where, values, is_density = f"line {number}", command.values, command.kind == "density"
        is_policy = (header.red, header.blue)[line.team].kind == "policy"
        if is_density and (values != as_followed(values)).any():
            yield f"{where}: the density is not as tables write it, with 1 for its largest value"
        if line.sender and (line.timing is not None or line.strokes is not None or is_policy):
            yield f"{where}: an automatic response has no clock, draws nothing and is a player's"
        if is_policy and number - _FIRST_LINE >= past:
            if line.strokes is not None or line.timing is not None:
                yield f"{where}: a policy draws nothing and has no clock"
            if line.number <= counted[line.team]:
                yield f"{where}: a policy's commands count up, got {line.number} after {counted[line.team]}"
            counted[line.team] = line.number
        if line.strokes is not None:
            try:
                strokes = [Stroke(brush=s.brush, width=s.width, points=tuple(s.points)) for s in line.strokes]
                draw = density_of if is_density else attraction_of
                asked = draw(strokes, config.game.command_cells, config.mapping)
            except CommandError as error:
                yield f"{where}: {error}"
                continue
            drawn = values * asked.max() if is_density else values
            if drawn.shape != asked.shape or np.abs(drawn - asked).max() > _DENSITY_STEP:
                yield f"{where}: the density is not that of its strokes"


def _seats(recording: Recording) -> Iterator[str]:
    """Say which lines are of a seat that cannot have sent them."""
    kinds = (recording.header.red.kind, recording.header.blue.kind)
    here = [kind == "policy" for kind in kinds]
    live = recording.live
    for number, line in enumerate(live, len(recording.events) - len(live) + _FIRST_LINE):
        if not isinstance(line, CommandLine | PaintedLine | SeatLine | InForceLine):
            continue
        team, kind = line.team, kinds[line.team]
        if isinstance(line, SeatLine):
            of_players = line.event not in ("failed", "forfeit")
            has_policy = kind == "policy" or recording.config.factors[team].share > 0.0
            can_fail = not recording.config.game.team_systems[team].kernel  # compiled ones cannot
            own = has_policy if line.event == "failed" else can_fail
            fits = kind in ("person", "program") if of_players else own
            if line.event in ("connected", "disconnected"):
                here[team] = line.event == "connected"
        elif isinstance(line, PaintedLine):
            fits = kind in ("person", "program")
        else:
            fits = kind != "free" and (here[team] or isinstance(line, InForceLine) or bool(line.sender))
        if not fits:
            yield f"line {number}: {TEAM_NAMES[team]} ({kind}) was not there, or cannot have done this"


def _end(recording: Recording, game: LiveGame) -> Iterator[str]:
    """Say what of the game's end does not follow from the game, which stands at its last tick."""
    end = recording.end
    if end is None:
        return
    where, outcome = f"line {len(recording.events) + _FIRST_LINE - 1}", game.outcome or "stopped"
    forfeits = [line.team for line in recording.live if isinstance(line, SeatLine) and line.event == "forfeit"]
    if forfeits and outcome == "stopped":
        outcome = TEAM_NAMES[1 - forfeits[0]]
    if (end.tick, end.sizes, end.outcome) != (game.tick, game.sizes, outcome):
        yield (
            f"{where}: the game ended at tick {game.tick}, {outcome}, with {game.sizes[0]} to {game.sizes[1]} "
            f"drones, not at tick {end.tick}, {end.outcome}, with {end.sizes[0]} to {end.sizes[1]}"
        )
    follows = "forfeit" if forfeits else reason_of_end(end.outcome, end.sizes, bool(recording.away))
    if end.ended_by != follows and (end.outcome, end.ended_by) != ("stopped", "server"):
        yield f"{where}: the game was ended by {follows!r}, not by {end.ended_by!r}"
