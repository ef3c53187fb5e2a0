"""Playback of a recorded game by simulation, since its start and commands determine everything.

Rounding depends on the kind of processor, and games are chaotic: on another kind, the same commands may lead to
another game after some seconds. The recorded frames show that. A game that was played in a page has an exact frame for
each control period: each period is simulated from its own frame, and leads to the next one but for rounding.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

from swarm_pz.config import CONTROL_PERIOD, TEAM_NAMES, TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND
from swarm_pz.config.base import check
from swarm_pz.errors import RecordingError
from swarm_pz.film import FILM_RATE, open_film, show_winner
from swarm_pz.play.commands import Command
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.verification import Verification, verify
from swarm_pz.rendering.painter import FILM, Painter


class Playback:
    """A recorded game that can be set to any of its ticks; `game` is its state at the present one."""

    def __init__(self, recording: Recording) -> None:
        self.recording, self.game = recording, recording.start()
        self._begun: dict[int, list[Command]] = defaultdict(list)
        for tick, command in recording.in_force():
            self._begun[tick].append(command)
        self._exact = {frame.tick: frame for frame in recording.frames() if frame.is_exact}

    def seek(self, tick: int) -> None:
        """Go to a tick, before its solve; beyond the end, to the last tick. The way back begins at the start."""
        if tick < self.game.tick:
            self.game = self.recording.start()
        game, end = self.game, min(tick, self.recording.last_tick)
        while game.tick < end and not game.over:
            if (poses := self.recording.poses.get(game.tick)) is not None:
                game.place(poses)
            if (frame := self._exact.get(game.tick)) is not None:
                games = game.simulator.games
                games.positions[0], games.velocities[0] = frame.positions, frame.velocities
            for command in self._begun[game.tick]:
                game.put_in_force(command)
            game.simulator.advance(1)

    def write_positions(self, path: Path) -> None:
        """Write every drone at every tick, 30 a second, as CSV: the game is simulated between recorded frames.

        Raises RecordingError if the simulation differs from the recording.
        """
        check(path.suffix == ".csv", "positions", str(path), "a file that ends in .csv")
        if (result := self.verify()).first_difference is not None:
            raise RecordingError(f"{self.recording.name} plays differently here from tick {result.first_difference}")
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(("tick", "drone", "team", "x", "y", "velocity_x", "velocity_y"))
            for tick in range(self.recording.last_tick + 1):
                self.seek(tick)
                games = self.game.simulator.games
                for drone, team in enumerate(games.teams[0]):
                    place = (*games.positions[0, drone], *games.velocities[0, drone])
                    writer.writerow((tick, drone, TEAM_NAMES[team], *(f"{value:.6f}" for value in place)))

    def verify(self) -> Verification:
        """Play the game again by the rules; see `swarm_pz.play.recordings.verification.verify`."""
        return verify(self.recording)

    def film(self, path: Path, speed: float = 2.0, progress: Callable[[float, float], None] | None = None) -> None:
        """Write the game as a film.

        The suffix chooses the format: .gif, .mp4, .webp. `speed` is in seconds of game a second of film; `progress` is
        called with the seconds of game shown so far, and all of them. Errors are as of `open_film`.
        """
        every = max(1, round(speed / CONTROL_PERIOD / FILM_RATE)) * TICKS_PER_CONTROL_PERIOD
        seats = (self.recording.header.red, self.recording.header.blue)
        red, blue = (seat.policy or seat.label or seat.kind for seat in seats)
        painter, last = Painter((red, blue), targets=True, layout=FILM), self.recording.last_tick
        rate = speed * TICKS_PER_SECOND / every
        with open_film(path, rate, painter.size) as append:
            for tick in range(0, last + every, every):
                self.seek(tick)
                append(painter.draw(self.game.simulator))
                if progress is not None:
                    progress(min(tick, last) / TICKS_PER_SECOND, last / TICKS_PER_SECOND)
            if self.game.outcome is not None:
                show_winner(append, painter, self.game.simulator, self.game.outcome, rate)
