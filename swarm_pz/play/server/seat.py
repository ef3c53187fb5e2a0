"""A seat: a side of a room, who has it, and the token that leads back to it."""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from swarm_pz.config import RED
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers
from swarm_pz.play.server.responses import Responses
from swarm_pz.play.server.seat_view import SeatView

log = logging.getLogger("swarm_pz.play")


@dataclass
class Seat:
    """One side of the table."""

    team: int
    kind: Literal["free", "person", "program", "policy"] = "free"
    policy: str = ""
    label: str = ""
    token: str = ""
    ready: bool = False
    connection: Connection | None = None
    view: SeatView | None = None
    """What its connection is shown, through which it is sent to."""
    away_since: float = 0.0
    gone: bool = False
    """Its player gave it up in the middle of a game."""
    target: bytes = b""
    """The target of its latest command, as its side is shown it."""
    place: PolicySeat | None = None
    """Where its policy is loaded, or its player's helper."""
    workers: PolicyWorkers | None = None
    """Who loads it."""
    loading: asyncio.Task[None] | None = None
    policy_state: Literal["loading", "loaded", "failed"] | None = None
    reason: str = ""
    """Why that could not be loaded."""
    responses: Responses | None = None
    """What commands in its player's place; None if nothing does."""

    def take(self, connection: Connection, label: str) -> None:
        """Give it to a client, who may come back to it with its new token; `meet` it then."""
        self.kind, self.label, self.ready = connection.kind, label, False
        self.token = secrets.token_hex(16)

    def reserve(self) -> None:
        """Keep it for a person, who comes with its token."""
        self.kind, self.token, self.away_since = "person", secrets.token_hex(16), time.monotonic()

    def give(self, place: PolicySeat, workers: PolicyWorkers, told: Callable[[], None]) -> None:
        """Give it to a policy, and load that; who is told when it is loaded, or has failed, need not wait."""
        self.kind, self.policy, self.ready = "policy", place.policy, True
        self.help(place, workers, told)

    def help(self, place: PolicySeat, workers: PolicyWorkers, told: Callable[[], None]) -> None:
        """Load a policy that shares its player's commands; as `give`."""
        self.place, self.workers, self.policy_state = place, workers, "loading"
        self.loading = asyncio.create_task(self._load(place, workers, told))

    async def _load(self, place: PolicySeat, workers: PolicyWorkers, told: Callable[[], None]) -> None:
        try:
            await workers.load(place)
        except SwarmError as error:
            self.policy_state, self.reason = "failed", str(error)[:500]
        except Exception:
            log.exception("a policy was not loaded")
            self.policy_state, self.reason = "failed", "it could not be loaded"
        else:
            self.policy_state = "loaded"
        told()

    def free(self) -> None:
        """Make it anybody's; a policy that had it is let go."""
        if self.loading is not None:
            self.loading.cancel()
        if self.workers is not None and self.place is not None:
            self.workers.forget(self.place)
        self.kind, self.policy, self.label, self.token, self.ready = "free", "", "", "", False
        self.drop_responses()
        self.part()
        self.gone = False
        self.place = self.workers = self.loading = self.policy_state = None
        self.reason = ""

    def meet(self, connection: Connection, view: SeatView) -> None:
        """Send to a connection from now on, what its view shows of the game."""
        self.part()
        self.connection, self.view = connection, view

    def part(self) -> None:
        """Send nothing more: its client is gone, or another one came."""
        if self.view is not None:
            self.view.close()
        self.connection = self.view = None

    def drop_responses(self) -> None:
        """Let nothing command in its player's place any more."""
        if self.responses is not None:
            self.responses.close()
        self.responses = None

    @property
    def can_play(self) -> bool:
        """Whether it is ready, and whoever has it is here, or loaded."""
        is_here = self.kind == "policy" or self.connection is not None
        return self.ready and is_here and self.policy_state in (None, "loaded")

    @property
    def side(self) -> protocol.Side:
        """Its name."""
        return "red" if self.team == RED else "blue"

    def state(self, system: ControlSystem) -> protocol.SeatState:
        """Return what everybody in the room sees of it, and of the control system that flies it."""
        return protocol.SeatState(
            kind=self.kind,
            name=self.policy,
            label=self.label,
            connected=self.kind == "policy" or self.connection is not None,
            ready=self.ready,
            policy_state=self.policy_state,
            reason=self.reason,
            gone=self.gone,
            system=system.name,
            takes=system.takes,
        )
