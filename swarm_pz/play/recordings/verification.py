"""Verification of a recorded game: it is simulated again from its start and commands, and compared tick by tick.

Rounding depends on the kind of processor, and games are chaotic: on another kind, the same commands may lead to
another game after some seconds. Names, labels, clock times and the outputs of policies are not checked.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from swarm_pz.config import CONTROL_PERIOD, TEAM_NAMES
from swarm_pz.play.commands import Command
from swarm_pz.play.frames import FASTEST, Frame
from swarm_pz.play.game import LiveGame
from swarm_pz.play.protocol import CapturedMessage, SeatCommand, SeatMessage
from swarm_pz.play.recordings.recording import FRAME_TICKS, Recording, reason_of_end

_MOST_FAULTS = 10
_POSITION_STEP, _VELOCITY_STEP = 1.0 / 65535, FASTEST / 32767
"""Resolution of a frame."""
_ACCELERATION_STEP = 1e-3
"""Tolerance of accelerations of games in a page, in units of the largest one.

From the same state, page and simulator differ by less than 1e-4 (tests/play/engine_cases.py). Here the controller's
memory is the simulator's own, and in 5,300 solves the largest difference was 1.5e-4.
"""
_ROUNDING = 2e-7
"""Further tolerance of positions and velocities, for the rounding of float32."""


@dataclass(frozen=True, kw_only=True)
class Verification:
    """The comparison of a recorded game with a simulation from its start and commands.

    `frames` is the number of compared frames. If the simulation differs, from tick `first_difference` on, the recording
    was changed, or made on another kind of processor. `faults` contradict the rules on any processor. `finished` games
    have a recorded end. For a game `in_page`, each control period was simulated from its own frame.
    """

    frames: int
    first_difference: int | None
    faults: tuple[str, ...]
    finished: bool
    in_page: bool = False

    @property
    def verified(self) -> bool:
        """True if frames were compared, and all agree with the recording, without faults."""
        return self.frames > 0 and self.first_difference is None and not self.faults


def verify(recording: Recording) -> Verification:
    """Simulate a recorded game again, and compare."""
    again = _Again(recording)
    difference = again.play()
    faults = list(again.faults)
    if difference is None:  # else the simulated game may end differently
        faults += _end(recording, again.game)
    return Verification(
        frames=again.compared,
        first_difference=difference,
        faults=tuple(islice(faults, _MOST_FAULTS)),
        finished=recording.end is not None,
        in_page=again.in_page,
    )


class _Again:
    """A recorded game that is played again: commands arrive as they did, and come into force by the rules."""

    def __init__(self, recording: Recording) -> None:
        self.recording, self.game = recording, recording.start()
        self.compared, self.faults, self.in_page = 0, [], False  # type: int, list[str], bool
        self._arrived: dict[int, list[Command]] = defaultdict(list)
        for line, command in zip(recording.of(SeatCommand), recording.commands, strict=True):
            self._arrived[line.tick].append(command)
        self._begun: dict[int, list[Command]] = defaultdict(list)
        for tick, command in recording.in_force():
            self._begun[tick].append(command)
        self._captured: dict[int, list[tuple[int, int]]] = defaultdict(list)
        for capture in recording.of(CapturedMessage):
            self._captured[capture.tick].append((capture.drone, capture.team))

    def play(self) -> int | None:
        """Play to the last tick that was recorded; return the first tick whose frame or captures differ."""
        recording, game, end = self.recording, self.game, self.recording.end
        frames = recording.frames()
        frame, teams = next(frames, None), game.simulator.games.teams[0].copy()
        for tick in range(recording.last_tick + 1):
            is_torn = end is None and tick == recording.last_tick  # the rest of its messages may be lost
            before, teams = teams, game.simulator.games.teams[0].copy()
            taken = [(int(drone), int(teams[drone])) for drone in np.flatnonzero(teams != before)]
            recorded = self._captured[tick]
            if game.tick != tick or recorded != (taken[: len(recorded)] if is_torn else taken):
                return tick
            is_due = tick % FRAME_TICKS == 0 or game.over
            if frame is not None and frame.tick == tick:
                self.compared += 1
                if not is_due or not self._shows(frame):
                    return tick
                if frame.is_exact:
                    games, self.in_page = game.simulator.games, True
                    games.positions[0], games.velocities[0] = frame.positions, frame.velocities
                frame = next(frames, None)
            elif is_due and not is_torn:
                return tick
            self._command(tick)
            if tick < recording.last_tick:
                if (poses := recording.poses.get(tick)) is not None:
                    game.place(poses)
                game.advance()
        return None if frame is None else frame.tick

    def _command(self, tick: int) -> None:
        """Hand in the commands of a tick, and compare those that come into force."""
        game, begun = self.game, self._begun[tick]
        for command in self._arrived[tick]:
            game.hand_in(command)
        due = [] if game.over else [event.command for event in game.begin_period()]
        end = self.recording.end
        is_cut = end is None or end.outcome == "stopped" or end.ended_by == "forfeit"
        if tick == self.recording.last_tick and is_cut:  # the last messages may be lost, or the period did not end
            due = [command for command in due if command in begun]
        for command in (*due, *begun):
            if due.count(command) != begun.count(command):
                name = f"{command.number} by {command.sender}" if command.sender else str(command.number)
                verb = "had to" if command in due else "cannot"
                fault = f"command {name} of {TEAM_NAMES[command.team]} {verb} come into force at tick {tick}"
                self.faults.append(fault)

    def _shows(self, frame: Frame) -> bool:
        """Return True if a recorded frame shows the present moment, with neither altitudes nor fields."""
        simulator = self.game.simulator
        positions = np.abs(frame.positions - simulator.positions[0]).max(initial=0.0)
        velocities = np.abs(np.clip(simulator.speeds[0], -FASTEST, FASTEST) - frame.velocities).max(initial=0.0)
        near, alike = 0.51 * _POSITION_STEP, 0.51 * _VELOCITY_STEP
        if frame.is_exact:
            largest = self.recording.config.game.controller.max_acceleration
            alike = _ACCELERATION_STEP * largest * CONTROL_PERIOD + _ROUNDING
            near = alike * CONTROL_PERIOD + _ROUNDING
        is_here = positions <= near and velocities <= alike
        is_same = is_here and (frame.teams == simulator.teams[0]).all()
        return bool(is_same) and frame.altitudes is None and frame.fields is None


def _end(recording: Recording, game: LiveGame) -> Iterator[str]:
    """Yield the contradictions between the recorded end and the simulated game, which is at its last tick."""
    end = recording.end
    if end is None:
        return
    outcome: str = game.outcome or "stopped"
    forfeits = [line.team for line in recording.of(SeatMessage) if line.event == "forfeit"]
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
