"""A program that plays: it takes a seat in a room, sees the game, and sends commands.

Play your own function against the policy `ring`:

    >>> from swarm_pz.play.client import play
    >>> def flank(frame, team):                                # doctest: +SKIP
    ...     return np.eye(10)
    >>> play("127.0.0.1:8000", flank, opponent="ring")         # doctest: +SKIP
    'red'

Steer each drone yourself:

    >>> def brake(frame, team):                                # doctest: +SKIP
    ...     return np.clip(-frame.velocities, -1, 1)
    >>> play("127.0.0.1:8000", brake, opponent="ring", red_system="direct", answers="accelerations")  # doctest: +SKIP
    'blue'
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import msgspec
import numpy as np
from websockets import Subprotocol
from websockets.sync.client import connect

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import ConfigError, PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, Frame, decode_frame


def play(
    address: str,
    tactic: Callable[[Frame, int], Any],
    *,
    room: str | None = None,
    opponent: str | None = None,
    seat: protocol.Side = "red",
    period: float = 1.0,
    answers: str = "density",
    seed: int | None = None,
    **settings: Any,
) -> str:
    """Play one game and return who won it: "red", "blue" or "draw".

    Parameters
    ----------
    address : str
        Host and port of the server.
    tactic : callable
        Function of a frame and its own team (0 red, 1 blue). It returns a density (A, A) with values in [0, 1], or a
        command of the kind `answers`: an array, or a mapping that the control system reads.
    room : str, optional
        Code of a room to join. Without it a new room is opened, with `opponent` in the other seat.
    opponent : str, optional
        Name of a policy.
    seat : {"red", "blue"}
    period : float
        Seconds of game between two commands.
    answers : str
        The kind of the tactic's commands.
    seed : int, optional
        Seed of the game's start in a new room; random if not given.
    **settings
        Settings of a new room, as in `swarm_pz.play.protocol.Settings`: `red` and `blue` (drones), `time_limit`
        (seconds of game), `speed` (seconds of game per second), `red_system`, `blue_system` (control systems).

    Raises
    ------
    ConfigError
        If a setting is not valid, or settings or a seed are given together with `room`.
    PolicyError
        If the server refuses a message (but for "too_many") or hangs up, or the seat takes other commands.
    """
    if room is not None and (settings or seed is not None):
        raise ConfigError(f"expected no settings and no seed for room {room!r}, which has its own: leave them out")
    try:
        fields = {"seat": seat, "opponent": opponent, "seed": seed, "settings": settings}
        opening = msgspec.convert(fields, protocol.Create)
    except msgspec.ValidationError as error:
        known = ", ".join(protocol.Settings.__struct_fields__)
        raise ConfigError(f"no room can be opened so: {error}; settings are {known}") from error
    spoken = [Subprotocol(protocol.SUBPROTOCOL)]
    with connect(f"ws://{address}/socket", subprotocols=spoken, max_size=None) as socket:

        def say(message: protocol.ClientMessage) -> None:
            socket.send(protocol.encode(message))

        say(protocol.Hello(kind="program"))
        say(protocol.Join(room, seat) if room is not None else opening)
        say(protocol.Ready())
        team, number, next_tick, frames, has_begun = TEAM_NAMES.index(seat), 0, 0, 0, False
        for data in socket:
            if isinstance(data, str):
                message = protocol.decode_server(data)
                if isinstance(message, protocol.Refused) and message.code != "too_many":
                    raise PolicyError(f"the table refused {message.about or 'a message'}: {message.reason}")
                if isinstance(message, protocol.Seated):
                    takes, serves = message.commands.takes, message.commands.serves_densities
                    if answers != takes and not (answers == "density" and serves):
                        flown_by = f"the seat is flown by {message.commands.system}"
                        raise PolicyError(f"{flown_by}, which takes commands of kind {takes!r}, not {answers!r}")
                if isinstance(message, protocol.RoomState):
                    if message.phase == "starting":
                        next_tick = 0  # commands count from the start of each countdown
                    has_begun |= message.phase in ("starting", "playing")
                    if has_begun and message.outcome is not None:
                        return message.outcome
            elif data[0] == FRAME:
                frame = decode_frame(data)
                frames += 1
                if frames % 4 == 0:
                    say(protocol.Acknowledge(frame.sequence))
                if frame.tick >= next_tick:
                    number, next_tick = number + 1, frame.tick + round(period * TICKS_PER_SECOND)
                    command = _plain(tactic(frame, team))
                    is_density = answers == "density"
                    say(protocol.CommandMessage(number, **{"density" if is_density else "command": command}))
    raise PolicyError("the table closed the connection")


def _plain(command: Any) -> Any:
    """Return a command as plain JSON values."""
    if isinstance(command, Mapping):
        return {str(name): value if isinstance(value, str) else _plain(value) for name, value in command.items()}
    return np.asarray(command, np.float64).tolist()
