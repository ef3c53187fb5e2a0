"""A seat: a side of a room, who has it and what that client is sent, and the token that leads back to it."""

from __future__ import annotations

import itertools
import secrets
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Literal

from swarm_pz.config import RED
from swarm_pz.play import protocol
from swarm_pz.play.factors import Factors
from swarm_pz.play.forms import commands_of
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import RecordedSeat
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers
from swarm_pz.play.server.refusal import RefusedError
from swarm_pz.play.server.responses import ReadyRule, Responses
from swarm_pz.play.server.seat_policy import SeatPolicy
from swarm_pz.play.server.seat_view import SeatView


@dataclass
class Seat:
    """One side of a room."""

    team: int
    config: TableConfig
    """Of the room."""
    code: str
    """The room's."""
    workers: PolicyWorkers
    """Who load policies."""
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
    loaded: SeatPolicy | None = None
    """Its policy, or its player's helper."""
    responses: Responses | None = None
    """What commands in its player's place; None if nothing does."""
    _numbers: itertools.count[int] = field(default_factory=itertools.count, compare=False)

    def __post_init__(self) -> None:
        game = self.config.game
        self.commands = commands_of(game.team_systems[self.team], game)

    # --- whose it is ------------------------------------------------------------------------------

    @property
    def side(self) -> protocol.Side:
        """Its name."""
        return "red" if self.team == RED else "blue"

    @property
    def factors(self) -> Factors:
        """What an experimenter varies at it."""
        return self.config.factors[self.team]

    @property
    def helper(self) -> str:
        """The policy that makes a share of its player's commands; empty if none does."""
        return self.factors.helper if self.factors.share > 0.0 else ""

    @property
    def takes_part(self) -> bool:
        """Whether it has drones in this room."""
        return self.config.game.team_sizes[self.team] > 0

    def check_side(self) -> None:
        """Refuse to be given to anybody if there is nothing to do in it."""
        if not self.takes_part:
            raise RefusedError("not_valid", f"{self.side} has no drones in this room")

    def take(self, connection: Connection, label: str) -> None:
        """Give it to a client, who may come back to it with its new token; `meet` it then."""
        self.kind, self.label, self.ready = connection.kind, label, False
        self.token = secrets.token_hex(16)

    def reserve(self) -> None:
        """Keep it for a person, who comes with its token."""
        self.kind, self.token, self.away_since = "person", secrets.token_hex(16), time.monotonic()

    def give_up(self) -> None:
        """Let nobody come back to it in this game; its swarm goes on with its last command."""
        self.part()
        self.token, self.gone = "", True
        self.drop_responses()

    def wait(self) -> None:
        """Wait for its client to come back with its token."""
        self.part()
        self.away_since = time.monotonic()
        self.ready = False

    def free(self) -> None:
        """Make it anybody's; a policy that had it is let go."""
        if self.loaded is not None:
            self.loaded.close()
        self.kind, self.policy, self.label, self.token, self.ready = "free", "", "", "", False
        self.drop_responses()
        self.part()
        self.gone = False
        self.loaded = None

    # --- its policies -----------------------------------------------------------------------------

    def _new_key(self) -> Hashable:
        """Return what no other place of a policy has."""
        return self.code, self.team, next(self._numbers)

    def give(self, policy: str, told: Callable[[], None]) -> None:
        """Give it to a policy, and load that; who is told when it is loaded, or has failed, need not wait."""
        self.kind, self.policy, self.ready = "policy", policy, True
        self._load(policy, told)

    def help(self, told: Callable[[], None]) -> None:
        """Load the policy that shares its player's commands, if one does; as `give`."""
        if self.helper:
            self._load(self.helper, told)

    def _load(self, policy: str, told: Callable[[], None]) -> None:
        place = PolicySeat(key=self._new_key(), policy=policy, game=self.config.game, team=self.team)
        self.loaded = SeatPolicy(place, self.workers, told)

    @property
    def place(self) -> PolicySeat | None:
        """Where its policy is loaded, or its player's helper."""
        return self.loaded.place if self.loaded is not None else None

    @property
    def policy_state(self) -> Literal["loading", "loaded", "failed"] | None:
        """Of its policy, or its player's helper; None if there is neither."""
        return self.loaded.state if self.loaded is not None else None

    @property
    def fault(self) -> str:
        """Which of them cannot play, and why; empty if none has failed."""
        if self.loaded is None or self.loaded.state != "failed":
            return ""
        return f"{self.loaded.place.policy} cannot play: {self.loaded.reason}"

    def respond(self, rules: list[ReadyRule]) -> None:
        """Set its automatic responses, in place of those that it had."""
        if rules and self.helper:
            raise RefusedError(
                "not_valid", f"{self.helper} shares this seat's commands: it takes no automatic responses"
            )
        if self.responses is None:
            told = self.tell_acting, self._rule_failed
            self.responses = Responses(self._new_key(), self.config.game, self.team, self.workers, *told)
        self.responses.replace(rules)

    def drop_responses(self) -> None:
        """Let nothing command in its player's place any more."""
        if self.responses is not None:
            self.responses.close()
        self.responses = None

    # --- what its client is sent ------------------------------------------------------------------

    def meet(self, connection: Connection) -> SeatView:
        """Send to a connection from now on, and return the view by which it sees the game."""
        self.part()
        self.connection = connection
        self.view = SeatView(connection, self.team, self.factors, self.config.speed)
        connection.send(
            protocol.Seated(self.code, self.side, self.token, commands=self.commands, factors=self._told_factors())
        )
        return self.view

    def part(self) -> None:
        """Send nothing more: its client is gone, or another one came."""
        if self.view is not None:
            self.view.close()
        self.connection = self.view = None

    def send(self, message: protocol.ServerMessage) -> None:
        """Tell its client, if there is one, something of the game."""
        if self.view is not None:
            self.view.send(message)

    def show_target(self, target: bytes | None = None) -> None:
        """Show its client a target, or the latest one again."""
        self.target = self.target if target is None else target
        if self.view is not None and self.target:
            self.view.send_bytes(self.target)

    def tell_acting(self) -> None:
        """Tell its client which automatic response commands now."""
        if self.connection is not None and self.responses is not None:
            place, sender = self.responses.acting
            self.send(protocol.Acting(seat=self.side, rule=place, sender=sender))

    def _rule_failed(self, reason: str) -> None:
        if self.connection is not None:
            self.connection.send(protocol.Refused(code="not_valid", reason=reason[:500], about="rules"))

    def _told_factors(self) -> protocol.SeatFactors | None:
        """Return what its client has to know of its factors; None if that is nothing."""
        factors = self.factors
        told = protocol.SeatFactors(
            hide=[*factors.hide], frame_rate=factors.frame_rate, helper=self.helper, share=factors.share
        )
        return told if told != protocol.SeatFactors() else None

    # --- what others see of it --------------------------------------------------------------------

    @property
    def can_play(self) -> bool:
        """Whether it is ready, and whoever has it is here, or loaded."""
        is_here = self.kind == "policy" or self.connection is not None
        return self.ready and is_here and self.policy_state in (None, "loaded")

    def state(self) -> protocol.SeatState:
        """Return what everybody in the room sees of it, and of the control system that flies it."""
        return protocol.SeatState(
            kind=self.kind,
            name=self.policy,
            label=self.label,
            connected=self.kind == "policy" or self.connection is not None,
            ready=self.ready,
            policy_state=self.policy_state,
            reason=self.loaded.reason if self.loaded is not None else "",
            gone=self.gone,
            system=self.commands.system,
            takes=self.commands.takes,
        )

    def recorded(self, *, with_label: bool) -> RecordedSeat:
        """Return what the recording of a game says of it."""
        return RecordedSeat(kind=self.kind, policy=self.policy, label=self.label if with_label else "")
