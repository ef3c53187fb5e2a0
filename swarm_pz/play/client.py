"""A program at the table: takes a seat in a room, is shown the game, answers with densities.

A seat from a script of one's own, against the ring:

    >>> from swarm_pz.play.client import play
    >>> def flank(frame, team):                                # doctest: +SKIP
    ...     return np.eye(10)
    >>> play("127.0.0.1:8000", flank, opponent="ring")         # doctest: +SKIP
    'red'
"""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import ArrayLike
from websockets import Subprotocol
from websockets.sync.client import connect

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, Frame, decode_frame


def play(
    address: str,
    tactic: Callable[[Frame, int], ArrayLike],
    *,
    room: str | None = None,
    opponent: str | None = None,
    seat: protocol.Side = "red",
    period: float = 1.0,
) -> str:
    """Play one game and return who won it: "red", "blue" or "draw".

    Parameters
    ----------
    address : str
        Host and port of the server.
    tactic : callable
        From a frame and the own team (0 red, 1 blue) to a density (A, A) with values in [0, 1].
    room : str, optional
        Code of a room to join; a new one is opened if none is given, with `opponent` in the other seat.
    opponent : str, optional
        Name of a policy.
    seat : {"red", "blue"}
    period : float
        Seconds of game between two commands.
    """
    with connect(f"ws://{address}/socket", subprotocols=[Subprotocol(protocol.SUBPROTOCOL)], max_size=None) as socket:

        def say(message: protocol.ClientMessage) -> None:
            socket.send(protocol.encode(message))

        say(protocol.Hello(kind="program"))
        say(protocol.Join(room, seat) if room is not None else protocol.Create(seat=seat, opponent=opponent))
        say(protocol.Ready())
        team, number, next_tick, frames, has_begun = TEAM_NAMES.index(seat), 0, 0, 0, False
        for data in socket:
            if isinstance(data, str):
                message = protocol.decode_server(data)
                if isinstance(message, protocol.Refused) and message.code != "too_many":
                    raise PolicyError(f"the table refused {message.about or 'a message'}: {message.reason}")
                if isinstance(message, protocol.RoomState):
                    if message.phase == "starting":
                        next_tick = 0  # commands count from the countdown on, and anew in each
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
                    density = [[float(value) for value in row] for row in tactic(frame, team)]  # type: ignore
                    say(protocol.CommandMessage(number, density=density))
    raise PolicyError("the table closed the connection")
