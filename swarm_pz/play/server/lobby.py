"""The lobby: all rooms, the tokens that lead back to seats, and the recorded games."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.metadata
import logging
import secrets
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from swarm_pz.errors import ConfigError, RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.recordings.format import SUFFIX, checked_name
from swarm_pz.play.server.live_session import Moment, ServerContext
from swarm_pz.play.server.replay_session import LoadedRecording
from swarm_pz.play.server.room import RefusedError, Room
from swarm_pz.play.server.seat import Seat

MOST_ROOMS = 100
_IDLE_S = 600.0
"""Seconds after which a room without anybody is closed."""
_MOST_LISTED = 200
"""Recorded games that are listed at once."""
_LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
log = logging.getLogger("swarm_pz.play")


class Lobby:
    """What there is to go to: rooms, seats in them, and recorded games.

    Parameters
    ----------
    context : ServerContext
    policies : mapping of str to str
        What may be given a seat, with a line about each.
    cards : mapping of str to Card, optional
        Of those of them that were rated.
    addresses : sequence of str, optional
        Of the page, as other devices reach it.

    Attributes
    ----------
    rooms : dict of str to Room
        By code.
    """

    def __init__(
        self,
        context: ServerContext,
        policies: Mapping[str, str],
        cards: Mapping[str, protocol.Card] | None = None,
        addresses: Sequence[str] = (),
    ) -> None:
        self.context = context
        self.addresses = list(addresses)
        self.rooms: dict[str, Room] = {}
        self._reading = asyncio.Lock()
        known = cards if cards is not None else {}
        self._policies = [
            protocol.PolicyInfo(name=name, about=text, card=known.get(name)) for name, text in policies.items()
        ]

    def welcome(self) -> protocol.Welcome:
        """Return what every client is told first."""
        return protocol.Welcome(
            version=importlib.metadata.version("swarm-pz"),
            policies=self._policies,
            min_command_interval=self.context.table.min_command_interval,
            command_cells=self.context.table.game.command_cells,
            server_ms=self.context.now_ms(),
            addresses=self.addresses,
            records_labels=self.context.record_labels,
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
            If there are too many, or there is no such game.
        """
        if len(self.rooms) >= MOST_ROOMS:
            raise RefusedError("full", f"this server has {MOST_ROOMS} rooms and no more; try again later")
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
            room.stop()
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

    def recordings(self) -> list[str]:
        """Return the names of the recorded games that one may watch, the latest first."""
        found = sorted((path.name for path in self.context.folder.glob(f"*{SUFFIX}")), reverse=True)
        names = []
        for name in found[:_MOST_LISTED]:
            with contextlib.suppress(RecordingError):
                names.append(self.find_recording(name).name)
        return names

    def find_recording(self, name: str) -> Path:
        """Return the file of a recorded game that is over: others may not see what a player draws.

        Raises
        ------
        RecordingError
            If there is none of that name.
        """
        path = self.context.folder / checked_name(name)
        running = {room.session.recorder.path for room in self.rooms.values() if room.session and not room.outcome}
        if not path.is_file() or path in running:
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
