"""What the server says."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from swarm_pz.play.protocol.fields import Message, Reason, Settings, Side


class Card(Message):
    """How good a policy is, and what it looks like at one moment of a game as blue."""

    rating: float
    """On the ladder; `uniform` is 1000."""
    target: list[str]
    """Rows from the bottom up, digits from 0 to 9."""
    drones: list[tuple[int, int]]
    """x and y in hundredths of a map width."""


class PolicyInfo(Message):
    """A policy that may take a seat."""

    name: str
    about: str
    card: Card | None = None
    """Of those that were rated."""
    answers: str = "density"
    """The kind of its commands: it flies what takes them; "any" is for policies that suit themselves to the system."""


class SystemInfo(Message):
    """A control system that may fly a seat."""

    name: str
    about: str
    takes: str
    """The kind of its commands."""
    serves_densities: bool
    """Whether it can be flown by densities, and so by strokes."""


class Commands(Message):
    """What commands a seat takes, and what is needed to make them by hand."""

    system: str
    takes: str
    shape: list[int]
    low: float | list[Any]
    """Least numbers, nested as the shape; one number if all are the same. So below."""
    high: float | list[Any]
    default: list[Any]
    """The command that is in force at the start."""
    serves_densities: bool
    leaders: int | None = None
    """How many places one moves."""
    shapes: list[str] = msgspec.field(default_factory=list)
    """Names of formations."""
    weights: tuple[float, float] | None = None
    """Least and largest weight of an attractor."""


class Welcome(Message, tag="welcome"):
    """The answer to a hello."""

    version: str
    policies: list[PolicyInfo]
    min_command_interval: float
    command_cells: int
    server_ms: float
    addresses: list[str] = msgspec.field(default_factory=list)
    """Of this page, as other devices in the network reach it; none if only this machine can."""
    records_labels: bool = False
    """Whether labels stand in recordings; else only those at the table see them."""
    systems: list[SystemInfo] = msgspec.field(default_factory=list)
    """Control systems that may fly a seat."""
    default_systems: list[str] = msgspec.field(default_factory=list)
    """Names of those that fly red and blue where a room's settings say nothing else."""
    ladder: bool = False
    """Whether people can climb here."""
    embedders: list[str] = msgspec.field(default_factory=list)
    """Origins of the pages that may hold this one in a frame."""


class SeatFactors(Message):
    """What an experimenter varies at a seat, as far as its client has to know it to show the game."""

    hide: list[str] = msgspec.field(default_factory=list)
    """Of "opponents", "ground", "trails", "target": what it is not sent, or (trails) should not paint."""
    frame_rate: int = 30
    """Moments that it is sent a second; below 30 it should show them as they are, and not what follows from them."""
    helper: str = ""
    """The policy that makes a share of its commands."""
    share: float = 0.0


class Seated(Message, tag="seated"):
    """A seat is yours; the token takes it back after a lost connection."""

    room: str
    seat: Side
    token: str
    commands: Commands
    """What it takes."""
    factors: SeatFactors | None = None
    """None where nothing is varied that is to be known."""


class SeatState(Message):
    """Who sits in a seat."""

    kind: Literal["free", "person", "program", "policy"] = "free"
    name: str = ""
    label: str = ""
    connected: bool = False
    ready: bool = False
    policy_state: Literal["loading", "loaded", "failed"] | None = None
    """Of a policy: a game waits until it is loaded, and one that failed does not play."""
    reason: str = ""
    """Why a policy failed to load."""
    gone: bool = False
    """Who had it gave it up for good in the game that is played; its swarm goes on with its last command."""
    system: str = ""
    """The control system that flies it."""
    takes: str = ""
    """The kind of its commands."""


class RoomState(Message, tag="room"):
    """A room, sent whenever anything of it changes."""

    code: str
    phase: Literal["waiting", "starting", "playing", "over", "replay"]
    """While a game starts, it counts down: its start is shown, and commands are taken for its first tick."""
    settings: Settings
    red: SeatState
    blue: SeatState
    watchers: int
    sizes: list[tuple[int, int]]
    """Drones of red and blue, once a second since the start."""
    min_command_interval: float
    outcome: Literal["red", "blue", "draw", "stopped"] | None = None
    recording: str | None = None
    """Of the game that is over, or that is watched."""
    last_tick: int | None = None
    """Of a recorded game."""
    starts_ms: float | None = None
    """When the countdown is over, on the server's clock; the first tick waits for policies' first commands, too."""
    verified: bool | None = None
    """Whether the recorded game plays here as it did; else it cannot be taken over."""
    ended_by: str | None = None
    """Of a game that is over, as in its recording."""
    forfeit: str = ""
    """Which side's control system failed, so that it lost, and how."""
    once: bool = False
    """One game is played here, and no more."""


class Received(Message, tag="received"):
    """A command has arrived; it waits if the last one is too young."""

    number: int
    server_ms: float


class InForceMessage(Message, tag="in_force"):
    """The swarm follows a command from this tick on."""

    seat: Side
    number: int
    tick: int
    server_ms: float
    sender: str = ""
    """Of a command that an automatic response gave: "auto:" and its policy, or "auto:saved"; of one that a
    policy shares, "shared:" and that policy, with the number of the player's latest."""


class Acting(Message, tag="acting"):
    """Which of the seat's automatic responses commands now; whenever that changes."""

    seat: Side
    rule: int | None
    """Its place among the rules, from 0; None for none."""
    sender: str = ""
    """As in `in_force`."""


class Refused(Message, tag="refused"):
    """A message was not obeyed, and why; nothing has changed."""

    code: Reason
    reason: str
    about: str = ""
    recording: str | None = None
    """To a hello whose token's seat is gone: the game that was played there."""


class Rung(Message):
    """An opponent on the ladder."""

    name: str
    rating: float


class Level(Message, tag="level"):
    """What somebody has reached on the ladder with a control system.

    It is sent to who asks, and to who has played, once their game is kept. It is in rating points, as of cards, and
    between low and high with 95 %; before the first game these say what is likely of anybody.
    """

    code: str
    system: str
    level: float
    low: float
    high: float
    games: int
    seconds: float
    """Of game, in all."""
    last: Literal["win", "draw", "loss"] | None
    """How the latest game ended."""
    opponent: str
    """Whom the next game is against."""
    side: Side
    """One's own in it."""
    rungs: list[Rung]
    """All opponents, the weakest first."""


class Notice(Message, tag="notice"):
    """Something that everybody in the room should know."""

    text: str


class Displaced(Message, tag="displaced"):
    """Another connection has taken this seat; this one is sent nothing more."""


class Pong(Message, tag="pong"):
    """The answer to a ping."""

    sent_ms: float
    server_ms: float


ServerMessage = (
    Welcome | Seated | RoomState | Received | InForceMessage | Acting | Refused | Level | Notice | Displaced | Pong
)
