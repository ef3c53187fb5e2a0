"""The games of a study: rooms of one game each, which are settled when they end."""

from __future__ import annotations

import asyncio
import logging
import time
from typing import Literal

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import SwarmError
from swarm_pz.play.factors import Factors
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.room import Room
from swarm_pz.play.server.room_settings import Hosted, RoomPlan
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.progress import Step

AWAY_S = 15.0
"""Seconds of a participant's absence after which a game is stopped, and played again."""
UNUSED_S = 60.0
"""Seconds that a game waits for its participants before it begins."""
log = logging.getLogger("swarm_pz.play")


class StudyGame:
    """The game of some participants; `seats` are their teams."""

    def __init__(self, players: tuple[int, ...], room: Room, seats: tuple[int, ...]) -> None:
        self.players, self.room, self.seats = players, room, seats
        self.is_over = False

    @property
    def phase(self) -> Literal["ready", "running", "saving"]:
        """Phase, for a participant's page."""
        if self.is_over:
            return "saving"
        return "running" if self.room.phase == "playing" else "ready"

    @property
    def fault(self) -> str:
        """Reason why it cannot begin; empty if it can."""
        faults = [seat.fault for seat in self.room.seats if seat.fault]
        return f"{faults[0]}. Please tell whoever runs the study" if faults else ""

    def _seat(self, number: int) -> Seat:
        return self.room.seats[self.seats[self.players.index(number)]]

    def seat_of(self, number: int) -> dict[str, str]:
        """Return the room, side and token of a participant's seat."""
        seat = self._seat(number)
        return {"room": self.room.code, "seat": seat.side, "token": seat.token}

    def has(self, number: int) -> bool:
        """Return true if a participant's browser is in it."""
        return not self.is_over and self._seat(number).connection is not None

    @property
    def away_s(self) -> float:
        """Seconds of the longest absence of a participant; 0 if all are there."""
        seats = [self.room.seats[team] for team in self.seats]
        now = time.monotonic()
        return max((now - seat.away_since for seat in seats if seat.connection is None), default=0.0)


class StudyGames:
    """All games of a study that are not settled."""

    def __init__(self, folder: StudyFolder, lobby: Lobby) -> None:
        self._folder, self._lobby = folder, lobby
        self._of: dict[int, StudyGame] = {}
        self._ending: set[asyncio.Task[None]] = set()

    def of(self, number: int) -> StudyGame | None:
        """Return a participant's game, until it is settled."""
        return self._of.get(number)

    def is_played_by(self, number: int) -> bool:
        """Return true if a participant's browser is in a game."""
        game = self._of.get(number)
        return game is not None and game.has(number)

    def open(self, players: tuple[int, ...], step: Step) -> None:
        """Open a room for a game, with a seat for each of its participants.

        Raises SwarmError if it cannot be played.
        """
        condition, study = step.condition, self._folder.study
        assert condition is not None  # noqa: S101
        first = TEAM_NAMES.index(condition.side)
        seats = (first, 1 - first)[: len(players)]
        red, blue = (condition.bare if team in seats else Factors(speed=condition.speed) for team in range(2))
        table = self._lobby.context.table.replace(game=condition.game(study.rules), mapping=None, factors=(red, blue))
        path, seed = self._folder.recording(players[0], step), self._folder.seed_of(step)
        hosted = Hosted(path=path, over=lambda: self._over(game))
        plan = RoomPlan(config=table, seed=seed, once=True, hosted=hosted)
        game = StudyGame(players, self._lobby.open_hosted(plan), seats)
        for team in seats:
            game.room.reserve(team)
        if len(players) == 1:
            try:
                game.room.place_policy("blue" if first == 0 else "red", self._folder.opponent_of(step))
            except SwarmError:
                self._lobby.close_room(game.room)
                raise
        for number in players:
            self._of[number] = game

    def _over(self, game: StudyGame) -> None:
        game.is_over = True
        task = asyncio.create_task(self._end(game))
        self._ending.add(task)
        task.add_done_callback(self._ending.discard)

    async def _end(self, game: StudyGame) -> None:
        """Settle a game, once its recording is on the disk."""
        assert game.room.session is not None  # noqa: S101
        await asyncio.to_thread(game.room.session.recorder.join)
        for number in game.players:
            try:
                await asyncio.to_thread(self._folder.settle, number)
            except (SwarmError, OSError) as error:  # the participant's page tries again
                log.error("a game was not written down: %s", error)
        self._forget(game)

    def _forget(self, game: StudyGame) -> None:
        for number in game.players:
            if self._of.get(number) is game:
                del self._of[number]

    def look(self) -> None:
        """Stop games that a participant has left."""
        for game in {id(game): game for game in self._of.values()}.values():
            if game.is_over:
                continue
            is_running = game.room.phase == "playing"
            is_gone = game.room.code not in self._lobby.rooms
            if is_gone or game.away_s > (AWAY_S if is_running else UNUSED_S):
                self.drop(game)

    def drop(self, game: StudyGame) -> None:
        """Break off a game, and close its connections."""
        there = game.room.connections
        self._lobby.close_room(game.room)
        if not game.is_over:
            self._forget(game)
        for connection in there:
            connection.close("this game was broken off")

    async def leave(self, number: int) -> None:
        """Break off a participant's game, and wait until its recording is set aside."""
        if (game := self._of.get(number)) is not None:
            self.drop(game)
            await self.close()

    async def close(self) -> None:
        """Wait until games that have ended are settled."""
        await asyncio.gather(*self._ending, return_exceptions=True)
