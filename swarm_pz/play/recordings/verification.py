"""Rules of the table that a recorded game must have kept, besides those of the simulation.

The simulation decides frames, captures, sizes and the end; here it is checked when commands came into force, and that
a drawing's density is its own. Names, labels, times of clocks and the answers of policies are not checked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from swarm_pz.config import TEAM_NAMES, TICKS_PER_CONTROL_PERIOD
from swarm_pz.errors import CommandError
from swarm_pz.play.commands import as_followed
from swarm_pz.play.game import LiveGame
from swarm_pz.play.protocol import InForceMessage, SeatCommand, SeatMessage
from swarm_pz.play.recordings.recording import Recording, reason_of_end
from swarm_pz.play.strokes import Stroke, attraction_of, density_of

_DENSITY_STEP = 1e-6
"""Tolerance of a drawing's density, since another processor may have made it."""


@dataclass(frozen=True, kw_only=True)
class Verification:
    """The comparison of a recorded game with the simulation of its commands from its start.

    Attributes
    ----------
    frames : int
        Frames compared.
    first_difference : int or None
        Tick at which the simulation first differs: the recording was changed, or made on another kind of processor.
    faults : tuple of str
        Contradictions to the rules on any processor.
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
        """True if there was something to compare, and all of it comes out as recorded."""
        return self.frames > 0 and self.first_difference is None and not self.faults


def faults_of(recording: Recording, game: LiveGame | None) -> Iterator[str]:
    """Yield the contradictions in a recording.

    `game` is the recorded game at its last tick; None if the simulation led elsewhere, so that its end is another one.
    """
    yield from _schedule(recording)
    yield from _commands(recording)
    if game is not None:
        yield from _end(recording, game)


def _schedule(recording: Recording) -> Iterator[str]:
    """Yield the commands that came into force at another tick than follows from their arrivals."""
    interval, origin, end = recording.config.interval_ticks, recording.header.origin, recording.end
    begin = origin.tick if origin is not None else 0
    for team, side in enumerate(TEAM_NAMES):
        begun = [(line.tick, _called(line)) for line in recording.of(InForceMessage) if line.team == team]
        before = max((tick for tick, _ in begun if tick < begin), default=-interval)
        begun = [(tick, name) for tick, name in begun if tick >= begin]
        own = [line for line in recording.live if isinstance(line, SeatCommand) and line.team == team]
        due = _due([(line.tick, _called(line)) for line in own], before, interval)
        # Where the recording breaks off, the last commands in force may have been lost; where the game ended while
        # control systems chose accelerations, they came into force before.
        least = sum(tick < recording.last_tick for tick, _ in due)
        is_cut = end is None or end.outcome == "stopped" or end.ended_by == "forfeit"
        due = due[: max(least, len(begun)) if is_cut else least]
        for tick, name in sorted(set(due) ^ set(begun)):
            verb = "had to" if (tick, name) in due else "cannot"
            yield f"command {name} of {side} {verb} come into force at tick {tick}"


def _called(line: SeatCommand | InForceMessage) -> str:
    """Return a command's number, and its sender in the player's place."""
    return f"{line.number} by {line.sender}" if line.sender else str(line.number)


def _due(arrived: list[tuple[int, str]], latest: int, interval: int) -> list[tuple[int, str]]:
    """Return the ticks at which commands come into force, from their arrival ticks; the latest one waits."""
    due: list[tuple[int, str]] = []
    for place, (tick, number) in enumerate(arrived):
        solve = -(-max(tick, latest + interval) // TICKS_PER_CONTROL_PERIOD) * TICKS_PER_CONTROL_PERIOD
        # One that arrives before that solve takes its place.
        if place + 1 == len(arrived) or arrived[place + 1][0] > solve:
            due.append((solve, number))
            latest = solve
    return due


def _commands(recording: Recording) -> Iterator[str]:
    """Yield the commands that no table writes so."""
    for line, command in zip(recording.of(SeatCommand), recording.commands, strict=True):
        where, values = f"command {line.number} of {line.seat} at tick {line.tick}", command.values
        is_density = command.kind == "density"
        if is_density and (values != as_followed(values)).any():
            yield f"{where}: the density is not as tables write it, with 1 for its largest value"
        if line.strokes is None:
            continue
        try:
            strokes = [Stroke(brush=s.brush, width=s.width, points=tuple(s.points)) for s in line.strokes]
            draw = density_of if is_density else attraction_of
            asked = draw(strokes, recording.config.game.command_cells, recording.config.mapping)
        except CommandError as error:
            yield f"{where}: {error}"
            continue
        drawn = values * asked.max() if is_density else values
        if drawn.shape != asked.shape or np.abs(drawn - asked).max() > _DENSITY_STEP:
            yield f"{where}: the density is not that of its strokes"


def _end(recording: Recording, game: LiveGame) -> Iterator[str]:
    """Yield the contradictions of the recorded end to the game, which stands at its last tick."""
    end = recording.end
    if end is None:
        return
    outcome = game.outcome or "stopped"
    forfeits = [line.team for line in recording.live if isinstance(line, SeatMessage) and line.event == "forfeit"]
    if forfeits and outcome == "stopped":
        outcome = TEAM_NAMES[1 - forfeits[0]]
    if (end.tick, end.sizes, end.outcome) != (game.tick, game.sizes, outcome):
        yield (
            f"the game ended at tick {game.tick}, {outcome}, with {game.sizes[0]} to {game.sizes[1]} "
            f"drones, not at tick {end.tick}, {end.outcome}, with {end.sizes[0]} to {end.sizes[1]}"
        )
    follows = "forfeit" if forfeits else reason_of_end(end.outcome, end.sizes, recording.is_somebody_away)
    if end.ended_by != follows and (end.outcome, end.ended_by) != ("stopped", "server"):
        yield f"the game was ended by {follows!r}, not by {end.ended_by!r}"
