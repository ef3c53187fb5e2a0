"""The ladder at a table: whom a player meets next, and the level after that game."""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from collections.abc import Awaitable, Container
from pathlib import Path

from swarm_pz.config import BLUE, RED, TEAM_NAMES, TICKS_PER_SECOND, GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.files import explain
from swarm_pz.play import protocol
from swarm_pz.play.climbers import Climbed, Climber, reached, write_table
from swarm_pz.play.game import TableConfig
from swarm_pz.play.levels import RUNGS, next_rung
from swarm_pz.play.recordings.format import EndedBy, Outcome
from swarm_pz.play.server.connection import RefusedError
from swarm_pz.play.server.room import Room
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.worker import Worker

RATED = "ergodic"
"""The control system that flew the opponents when they were rated, and flies them here."""
log = logging.getLogger("swarm_pz.play")


def check_rules(game: GameConfig) -> None:
    """Check that a table's rules are those by which the opponents were rated; players' control systems may differ.

    Raises ConfigError if they are not.
    """
    if game.replace(controllers=RATED).rules_hash != GameConfig().rules_hash:
        raise ConfigError(
            "--ladder plays by the rules by which its opponents were rated, the default ones: leave out what sets "
            "others (of --game, --game.controllers may stay)"
        )


class Climbing:
    """The ladder at a table, and the folder of the levels; a thread reads and writes it, so that no game waits.

    - `table`: its first control system is the default.
    - `policies`: opponents that may be met.
    """

    def __init__(self, folder: Path, table: TableConfig, policies: Container[str]) -> None:
        self._folder = folder
        self._system = table.game.team_controllers[RED]
        self._rungs = [rung for rung in RUNGS if rung.name in policies]
        self._ratings = dict(self._rungs)
        self._rooms: dict[str, Room] = {}
        """Of each code, where its latest game is."""
        self._worker = Worker("climbing")
        self._telling: set[asyncio.Task[None]] = set()
        if not self._rungs:
            raise ConfigError("none of the ladder's opponents is installed: there is nobody to meet")

    def close(self) -> None:
        """Wait until all games are kept."""
        self._worker.close(wait=True)

    async def level(self, code: str, system: str | None) -> protocol.Level:
        """Return what a player has reached with a control system, and whom they meet next.

        Raises ConfigError, RecordingError if it is no code, or its file is corrupt.
        """
        return await self._worker.do(self._read, code, system or self._system)

    def _read(self, code: str, system: str) -> protocol.Level:
        games = Climber(self._folder, code).of(system)
        level = reached(games)
        return protocol.Level(
            code=code,
            system=system,
            level=level.value,
            low=level.low,
            high=level.high,
            games=len(games),
            opponent=next_rung([game.met for game in games], self._rungs).name,
            side="blue" if len(games) % 2 else "red",
        )

    @staticmethod
    def settings(level: protocol.Level) -> protocol.Settings:
        """Return the settings of the room of a player's next game."""
        systems = (level.system, RATED) if level.side == "red" else (RATED, level.system)
        return protocol.Settings(red_system=systems[RED], blue_system=systems[BLUE])

    def check_free(self, code: str) -> None:
        """Refuse to begin a game for a code of which one is being played."""
        room = self._rooms.get(code)
        if room is not None and room.is_on:
            raise RefusedError(
                "taken", f"{code} plays already, in room {room.code}: go back to that game, or wait until it is over"
            )

    def follow(self, room: Room, level: protocol.Level) -> None:
        """Count the game that will be played in a room, by the player who sits there now."""
        seat = room.seats[TEAM_NAMES.index(level.side)]
        token, seed = seat.token, secrets.randbelow(2**32)
        room.once = room.ranked = True
        room.seed = seed
        self._rooms[level.code] = room

        def over(outcome: Outcome, ended_by: EndedBy) -> None:
            session = room.session
            if seat.token not in (token, "") or session is None:
                return  # somebody else played it
            if ended_by in ("server", "forfeit") or (outcome == "stopped" and ended_by != "left"):
                return  # it was not decided by a player
            game = Climbed(
                at=time.time(),
                system=level.system,
                opponent=level.opponent,
                rating=self._ratings[level.opponent],
                side=level.side,
                seed=seed,
                outcome="draw" if outcome == "draw" else "win" if outcome == level.side else "loss",
                ended_by=ended_by,
                seconds=session.game.tick / TICKS_PER_SECOND,
                recording=session.recorder.path.name,
            )
            task = asyncio.create_task(_tell(seat, self._worker.do(self._keep, level.code, game)))
            self._telling.add(task)
            task.add_done_callback(self._telling.discard)

        room.on_over = over

    def _keep(self, code: str, game: Climbed) -> protocol.Level:
        Climber(self._folder, code).add(game)
        told = self._read(code, game.system)
        try:
            for fault in write_table(self._folder):
                log.warning("left out of the table of levels: %s", fault)
        except OSError as error:  # it is made of the files, and can be made again
            log.warning("the table of levels was not written: %s", explain(error))
        return told


async def _tell(seat: Seat, kept: Awaitable[protocol.Level]) -> None:
    """Tell the player, if they are still there, what they have reached."""
    message: protocol.ServerMessage
    try:
        message = await kept
    except Exception as error:
        log.exception("a game was not counted")
        told = error.strerror if isinstance(error, OSError) else str(error)
        message = protocol.Notice(text=f"this game could not be counted: {told}"[:500])
    if seat.connection is not None:
        seat.connection.send(message)
