"""A seat: a side of a room, its player or policy, its client's view, and the token that leads back to it.

`Seat.take` makes the token, and `swarm_pz.play.server.lobby.Lobby.seat_of` finds the seat of a token.
"""

from __future__ import annotations

import itertools
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from swarm_pz.play import protocol
from swarm_pz.play.factors import Factors
from swarm_pz.play.forms import commands_of
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import SIDES, RecordedSeat
from swarm_pz.play.server.connection import Connection, RefusedError
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers, SeatPolicy
from swarm_pz.play.server.seat_view import SeatView


@dataclass
class Seat:
    """One side of a room.

    - `config`, `code`: of the room.
    - `view`: shows the game to its connection.
    - `gone`: its player gave it up during a game.
    - `target`: of its latest command, as a message.
    - `loaded`: its policy, or its player's helper.
    - `takes_part`: it has drones in this room.
    - `factors`: what an experimenter varies at it.
    - `helper`: the policy that makes a share of its player's commands; empty without one.
    - `wins`: games that its player has won here against the other player.
    """

    team: int
    config: TableConfig
    code: str
    workers: PolicyWorkers
    kind: Literal["free", "person", "program", "policy"] = "free"
    policy: str = ""
    label: str = ""
    token: str = ""
    ready: bool = False
    connection: Connection | None = None
    view: SeatView | None = None
    away_since: float = 0.0
    gone: bool = False
    target: bytes = b""
    loaded: SeatPolicy | None = None
    wins: int = 0
    _numbers: itertools.count[int] = field(default_factory=itertools.count, compare=False)

    def __post_init__(self) -> None:
        game = self.config.game
        self.side = SIDES[self.team]
        self.commands = commands_of(game.team_systems[self.team], game)
        self.takes_part = game.team_sizes[self.team] > 0
        self.factors: Factors = self.config.factors[self.team]
        self.helper = self.factors.helper if self.factors.share > 0.0 else ""

    # --- its player -------------------------------------------------------------------------------

    def check_side(self) -> None:
        """Refuse a side without drones."""
        if not self.takes_part:
            raise RefusedError("not_valid", f"{self.side} has no drones in this room")

    def take(self, kind: Literal["person", "program"], label: str, changed: Callable[[], None]) -> None:
        """Give it to a client, make its token, and load its helper, if there is one, as `give` loads a policy."""
        self.kind, self.label, self.ready = kind, label, False
        self.token, self.away_since = secrets.token_hex(16), time.monotonic()
        if self.helper:
            self.loaded = self._load(self.helper, changed)

    def give_up(self) -> None:
        """Let nobody come back to it in this game; its swarm goes on with its last command."""
        self.part()
        self.token, self.gone = "", True

    def wait(self) -> None:
        """Wait for its client to come back with its token."""
        self.part()
        self.away_since = time.monotonic()
        self.ready = False

    def free(self) -> None:
        """Free the seat, and unload its policy."""
        if self.loaded is not None:
            self.loaded.close()
        self.kind, self.policy, self.label, self.token, self.ready = "free", "", "", "", False
        self.part()
        self.gone, self.loaded, self.wins = False, None, 0

    def swap(self, other: Seat) -> None:
        """Exchange players with another seat; they keep their tokens."""
        for name in ("label", "token", "ready", "connection", "away_since", "wins"):
            own, its = getattr(self, name), getattr(other, name)
            setattr(self, name, its)
            setattr(other, name, own)
        for seat in (self, other):
            if seat.connection is not None:
                seat.meet(seat.connection)

    # --- its policies -----------------------------------------------------------------------------

    def give(self, policy: str, changed: Callable[[], None]) -> None:
        """Give the seat to a policy, and load the policy; `changed` is called when it is loaded, or has failed."""
        self.kind, self.policy, self.ready = "policy", policy, True
        self.loaded = self._load(policy, changed)

    def _load(self, policy: str, changed: Callable[[], None]) -> SeatPolicy:
        key = self.code, self.team, next(self._numbers)
        place = PolicySeat(key=key, policy=policy, game=self.config.game, team=self.team)
        return SeatPolicy(place, self.workers, changed)

    @property
    def policy_state(self) -> Literal["loading", "loaded", "failed"] | None:
        """State of its policy, or its player's helper; None without either."""
        return self.loaded.state if self.loaded is not None else None

    @property
    def fault(self) -> str:
        """Name of the policy that failed to load, with the reason; empty if none has failed."""
        if self.loaded is None or self.loaded.state != "failed":
            return ""
        return f"{self.loaded.place.policy} cannot play: {self.loaded.reason}"

    # --- its client -------------------------------------------------------------------------------

    def meet(self, connection: Connection) -> SeatView:
        """Send to a connection from now on, and return its view of the game."""
        self.part()
        self.connection = connection
        self.view = SeatView(connection, self.team, self.factors, self.config.speed)
        own = self.factors
        shown = protocol.SeatFactors(hide=[*own.hide], frame_rate=own.frame_rate, helper=self.helper, share=own.share)
        factors = shown if shown != protocol.SeatFactors() else None
        connection.send(protocol.Seated(self.code, self.side, self.token, commands=self.commands, factors=factors))
        return self.view

    def part(self) -> None:
        """Send nothing more: its client is gone, or another one came."""
        if self.view is not None:
            self.view.close()
        self.connection = self.view = None

    def send(self, message: protocol.ServerMessage) -> None:
        """Send its client, if there is one, a message."""
        if self.view is not None:
            self.view.send(message)

    def show_target(self, target: bytes | None = None) -> None:
        """Show its client a target, or the latest one again."""
        self.target = self.target if target is None else target
        if self.view is not None and self.target:
            self.view.send(self.target)

    # --- its state --------------------------------------------------------------------------------

    @property
    def is_here(self) -> bool:
        """True if its client is connected, or a policy has it."""
        return self.kind == "policy" or self.connection is not None

    @property
    def can_play(self) -> bool:
        """True if it is ready, and its client is here, or its policy loaded."""
        return self.ready and self.is_here and self.policy_state in (None, "loaded")

    def state(self) -> protocol.SeatState:
        """Return its state, for everybody in the room."""
        return protocol.SeatState(
            kind=self.kind,
            name=self.policy,
            label=self.label,
            connected=self.is_here,
            ready=self.ready,
            policy_state=self.policy_state,
            reason=self.loaded.reason if self.loaded is not None else "",
            gone=self.gone,
        )

    def recorded(self, *, with_label: bool) -> RecordedSeat:
        """Return its entry in the header of a recording."""
        return RecordedSeat(kind=self.kind, policy=self.policy, label=self.label if with_label else "")
