"""The lobby: all rooms, the tokens that lead back to seats, and the recorded games."""

from __future__ import annotations

import asyncio
import importlib.metadata
import logging
import secrets
import time
from collections.abc import Mapping
from pathlib import Path

from swarm_pz.errors import ConfigError, OutputError, RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.recordings.folder import checked_name, is_regular
from swarm_pz.play.server.games_folder import check_folder
from swarm_pz.play.server.live_session import Moment, ServerContext
from swarm_pz.play.server.replay_session import LoadedRecording
from swarm_pz.play.server.room import RefusedError, Room
from swarm_pz.play.server.seat import Seat

MOST_ROOMS = 100
_IDLE_S = 600.0
"""Seconds after which a room without anybody is closed."""
_LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
log = logging.getLogger("swarm_pz.play")


class Lobby:
    """What there is to go to: rooms, seats in them, and recorded games.

    Parameters
    ----------
    context : ServerContext
    policies : mapping of str to str
        What may be given a seat, with a line about each.

    Attributes
    ----------
    rooms : dict of str to Room
        By code.
    """

    def __init__(self, context: ServerContext, policies: Mapping[str, str]) -> None:
        self.context = context
        self.rooms: dict[str, Room] = {}
        self._reading = asyncio.Lock()
        self._policies = [protocol.PolicyInfo(name=name, about=text) for name, text in policies.items()]

    def welcome(self) -> protocol.Welcome:
        """Return what every client is told first."""
        return protocol.Welcome(
            version=importlib.metadata.version("swarm-pz"),
            policies=self._policies,
            min_command_interval=self.context.table.min_command_interval,
            command_cells=self.context.table.game.command_cells,
            server_ms=self.context.now_ms(),
        )

    def check_policy(self, name: str) -> str:
        """Return a policy's name, or refuse one that may not be given a seat."""
        if name not in {policy.name for policy in self._policies}:
            raise RefusedError("unknown", f"there is no policy {name[:80]!r} here")
        return name

    def open_room(self, settings: protocol.Settings, moment: Moment | None = None) -> Room:
        """Return a new room, perhaps one in which a recorded game goes on.

        Raises
        ------
        RefusedError
            If there are too many, there is no such game, or games cannot be recorded.
        """
        if len(self.rooms) >= MOST_ROOMS:
            raise RefusedError("full", f"this server has {MOST_ROOMS} rooms and no more; try again later")
        try:
            check_folder(self.context.folder)
        except OutputError as error:
            log.warning("%s", error)
            raise RefusedError("not_valid", "games cannot be recorded on this server now; tell who runs it") from error
        code = ""
        while not code or code in self.rooms:
            code = "".join(secrets.choice(_LETTERS) for _ in range(4))
        try:
            self.rooms[code] = Room(code, settings, self.context, moment)
        except ConfigError as error:
            raise RefusedError("not_valid", str(error)) from error
        return self.rooms[code]

    def close_room(self, room: Room) -> None:
        """End a room's game and forget it."""
        self.rooms.pop(room.code, None)
        try:
            room.close()
        except Exception:  # whatever is wrong with one room is not the others' affair
            log.exception("room %s did not close well", room.code)

    def close_idle_rooms(self) -> None:
        """Close rooms that nobody has been in for a while, and give up the seats of who does not come back."""
        now = time.monotonic()
        for room in list(self.rooms.values()):
            room.free_absent()
            if room.connections:
                room.last_used = now
            if room.abandoned or now - room.last_used > _IDLE_S:
                self.close_room(room)

    def close(self) -> None:
        """End all games, and the processes of policies."""
        for room in list(self.rooms.values()):
            self.close_room(room)
        self.context.workers.close()

    def seat_of(self, token: str) -> tuple[Room, Seat] | None:
        """Return the seat that a token opens."""
        for room in self.rooms.values():
            for seat in room.seats:
                if seat.token and secrets.compare_digest(seat.token, token):
                    return room, seat
        return None

    def recording_of(self, token: str) -> str | None:
        """Return the recorded game that a token's seat became, if it is over and still there."""
        name = self.context.seat_index.recording_of(token)
        try:
            return self.find_recording(name).name if name is not None else None
        except RecordingError:
            return None

    def find_recording(self, name: str) -> Path:
        """Return the file of a recorded game that is over: others may not see what a player draws.

        Raises
        ------
        RecordingError
            If there is none of that name.
        """
        path = self.context.folder / checked_name(name)
        running = {
            room.session.recorder.path
            for room in self.rooms.values()
            if room.session is not None and not (room.outcome and room.session.recorder.written)
        }
        if not is_regular(path) or path in running:
            raise RecordingError(f"there is no recording {name} here")
        return path

    async def read(self, name: str) -> LoadedRecording:
        """Return a recorded game, played through; one at a time, since it takes a core.

        Raises
        ------
        RecordingError
            If there is none of that name, or it cannot be read.
        """
        path = self.find_recording(name)
        async with self._reading:
            return await asyncio.to_thread(LoadedRecording.read, path)
