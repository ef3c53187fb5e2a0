"""The lobby: all rooms, the tokens that lead back to seats, and the recorded games."""

from __future__ import annotations

import contextlib
import logging
import secrets
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from swarm_pz.errors import OutputError, RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.forms import welcome_of
from swarm_pz.play.recordings.folder import SUFFIX, Summary, checked_name, is_regular, summary_of
from swarm_pz.play.server.connection import RefusedError
from swarm_pz.play.server.rate_limit import AddressLimits
from swarm_pz.play.server.room import AWAY_S, Room
from swarm_pz.play.server.room_settings import POLICY_COST, RoomPlan
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.server_context import ServerContext, check_folder
from swarm_pz.play.server.worker import Worker

MOST_ROOMS, MOST_ROOMS_OF_ADDRESS = 125, 50
"""Largest costs of all rooms, and of the rooms of one address, in the unit of `cost_of`: enough for 100 rooms with a
policy each, and for 40 of a class behind one address."""
OPENING_S = 50.0
"""Seconds in which an address may open `MOST_ROOMS_OF_ADDRESS` rooms: opening one and beginning its game is costly."""
MOST_GUESSES, GUESSES_S = 20, 100.0
"""Wrong codes that an address may send, and within how many seconds."""
EMPTY_S = 30.0
"""Seconds after which an abandoned room is closed."""
_MOST_LISTED = 200
"""Recorded games that are listed."""
_LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
log = logging.getLogger("swarm_pz.play")


class Lobby:
    """All rooms by code, and the recorded games.

    - `policies`: names of those that may have a seat, with a line about each.
    - `cards`: of rated policies.
    - `addresses`: of the page, for other devices.
    - `embedders`: origins of pages that may hold this one in a frame.
    - `is_hosted`: only a study opens rooms; clients take seats that it keeps for them.
    - `drawing`: the thread that renders commands.
    """

    def __init__(
        self,
        context: ServerContext,
        policies: Mapping[str, str],
        cards: Mapping[str, protocol.Card] | None = None,
        addresses: Sequence[str] = (),
        embedders: Sequence[str] = (),
        is_hosted: bool = False,
    ) -> None:
        self.context, self.is_hosted = context, is_hosted
        self.addresses, self.embedders = list(addresses), list(embedders)
        self.rooms: dict[str, Room] = {}
        self._openings = AddressLimits(MOST_ROOMS_OF_ADDRESS, OPENING_S)
        self._guesses = AddressLimits(MOST_GUESSES, GUESSES_S)
        self.drawing, self._listing = self._workers = [Worker(name) for name in ("drawing", "listing")]
        self._policies = frozenset(policies)
        self._welcome = welcome_of(
            context.table,
            policies,
            cards or {},
            addresses=self.addresses,
            records_labels=context.record_labels,
            embedders=self.embedders,
        )

    def welcome(self) -> protocol.Welcome:
        """Return the answer to a client's hello."""
        return msgspec.structs.replace(self._welcome, server_ms=self.context.now_ms())

    def check_policy(self, name: str) -> str:
        """Return a policy's name, or refuse one that may not be given a seat."""
        if name not in self._policies:
            raise RefusedError("unknown", f"there is no policy {name[:80]!r} here")
        return name

    # --- rooms ------------------------------------------------------------------------------------

    def find_room(self, code: str, address: str) -> Room:
        """Return the room of a code.

        Raises RefusedError if there is none, or the address has sent too many wrong codes.
        """
        guesses = self._guesses.of(address)
        if guesses.is_reached():  # even if the code is right, so guessing finds none
            raise RefusedError("too_many", "too many codes of no room came from your network; wait for two minutes")
        room = self.rooms.get(code.upper())
        if room is None:
            guesses.take()
            raise RefusedError("unknown", f"there is no room {code}")
        return room

    def open_room(self, plan: RoomPlan, address: str = "", policies: int = 0) -> Room:
        """Return a new room for `policies` policies.

        Raises RefusedError if the server or the address has too many rooms, or games cannot be recorded.
        """
        if not self._openings.of(address).take():
            raise RefusedError("full", "your network opens rooms too fast; wait for some seconds, or join one")
        try:
            check_folder(self.context.folder)
        except OutputError as error:
            log.warning("%s", error)
            raise RefusedError("not_valid", "games cannot be recorded on this server now; tell who runs it") from error
        room = Room(self._new_code(), plan, self.context, address)
        self._make_way(room, policies)
        self.rooms[room.code] = room
        return room

    def _make_way(self, room: Room, policies: int) -> None:
        """Close empty rooms of a new room's address until there is enough capacity for it and its policies.

        Raises RefusedError if that is not enough.
        """
        cost = room.cost + POLICY_COST * policies
        kept = [*self.rooms.values()]
        empty = [other for other in kept if other.address == room.address and not other.connections]
        empty.sort(key=lambda other: other.last_used)
        while True:
            own = [other.cost for other in kept if other.address == room.address]
            left, where = MOST_ROOMS - sum(other.cost for other in kept), "on this server"
            if own:  # an address's first room may exceed its limit
                left, where = min((left, where), (MOST_ROOMS_OF_ADDRESS - sum(own), "for your network"))
            if cost <= left:
                break
            if not empty:
                raise RefusedError(
                    "full",
                    f"this room takes as much as {cost:.2f} rooms of 10 against 10 at normal speed, and there are "
                    f"{max(left, 0.0):.2f} left {where}: take fewer drones or policies, a lower speed or a simpler "
                    "control system, leave or join another room, or try again later",
                )
            kept.remove(empty.pop(0))
        for other in set(self.rooms.values()) - {*kept}:
            self.close_room(other)

    def open_hosted(self, plan: RoomPlan) -> Room:
        """Return a new room of a study."""
        code = self._new_code()
        self.rooms[code] = Room(code, plan, self.context)
        return self.rooms[code]

    def _new_code(self) -> str:
        code = ""
        while not code or code in self.rooms:
            code = "".join(secrets.choice(_LETTERS) for _ in range(4))
        return code

    def close_room(self, room: Room) -> None:
        """End a room's game and forget it."""
        self.rooms.pop(room.code, None)
        try:
            room.close()
        except Exception:  # the others go on
            log.exception("room %s did not close well", room.code)

    def close_idle_rooms(self) -> None:
        """Close rooms that were empty for a while, and free the seats of players who do not come back."""
        now = time.monotonic()
        self._openings.forget()
        self._guesses.forget()
        for room in list(self.rooms.values()):
            room.free_absent()
            if room.connections:
                room.last_used = now
            if now - room.last_used > (EMPTY_S if room.abandoned else AWAY_S):
                self.close_room(room)

    def close(self) -> None:
        """End all games, threads and processes."""
        for room in list(self.rooms.values()):
            self.close_room(room)
        self.context.workers.close()
        for worker in self._workers:
            worker.close()

    # --- tokens and recorded games ----------------------------------------------------------------

    def seat_of(self, token: str) -> tuple[Room, Seat] | None:
        """Return a token's room and seat."""
        for room in self.rooms.values():
            for seat in room.seats:
                if seat.token and secrets.compare_digest(seat.token, token):
                    return room, seat
        return None

    async def recordings(self) -> list[Summary]:
        """Return summaries of the recorded games that can be watched, the latest first."""
        return await self._listing.do(self._list, self._running())

    def _list(self, running: set[Path]) -> list[Summary]:
        listed = []
        for path in sorted(self.context.folder.glob(f"*{SUFFIX}"), reverse=True)[:_MOST_LISTED]:
            with contextlib.suppress(RecordingError):
                listed.append(summary_of(self._file_of(path.name, running)))
        return listed

    def find_recording(self, name: str) -> Path:
        """Return the file of a recorded game that is over: nobody may see drawings of a running one.

        Raises RecordingError if there is none of that name.
        """
        return self._file_of(name, self._running())

    def _file_of(self, name: str, running: set[Path]) -> Path:
        path = self.context.folder / checked_name(name)
        if not is_regular(path) or path in running:
            raise RecordingError(f"there is no recording {name} here")
        return path

    def _running(self) -> set[Path]:
        """Return the files of games that are played, or not wholly written."""
        sessions = [(room.session, room.outcome) for room in self.rooms.values()]
        return {
            session.recorder.path
            for session, outcome in sessions
            if session is not None and not (outcome and session.recorder.written)
        }
