"""The table for ROS programs: a rosbridge server whose clients sit in seats like any other player.

It runs in a process of its own and speaks to the table as every program does, over its socket; so messages of
10 MB, or clients that never read, disturb nobody's game.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray
from websockets import Subprotocol
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from swarm_pz.config import CONTROL_PERIOD, GRID_CELLS, TEAM_NAMES, GameConfig
from swarm_pz.errors import ProtocolError
from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, Frame, decode_frame
from swarm_pz.play.ros import messages
from swarm_pz.play.ros.rosbridge import Client, Message, Rosbridge
from swarm_pz.simulator.ergodicity import reconstruct

_MODES = 10
_EVERY = frozenset({"/agent_team_status"})
_ALONE_S = 60.0
"""Seconds after which seats are given up that no client of the bridge plays."""

Side = Literal["red", "blue"]


class Bridge:
    """A rosbridge `Node` whose clients play in one room of a table.

    Parameters
    ----------
    address : str
        Host and port of the table.
    opponent : str, optional
        A policy that plays the other side of who comes first; without one the game waits for somebody there.
    say : callable
        Where lines go.
    """

    def __init__(self, address: str, opponent: str | None, say: Callable[[str], None]) -> None:
        self._address, self._opponent, self._say = address, opponent, say
        self._rosbridge = Rosbridge(self, messages.TOPICS, _EVERY)
        self._seats: dict[Side, Seat] = {}
        self._owners: dict[Side, Client] = {}
        self._clients: set[Client] = set()
        self._shown = Shown(self._rosbridge)
        self._room: str | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def run(self, host: str, port: int) -> None:
        """Serve until cancelled."""
        port = await self._rosbridge.open(host, port)
        self._say(f"rosbridge is at ws://{host}:{port}")
        try:
            while True:
                await asyncio.sleep(_ALONE_S)
                self._leave_if_alone()
        finally:
            for seat in self._seats.values():
                seat.stop()
            await self._rosbridge.close()

    # --- what clients say -----------------------------------------------------------------------

    def heard(self, client: Client, topic: str, message: Message) -> None:
        """Take a message of one of the topics that mean something here; others are nobody's business."""
        self._clients.add(client)
        for side in TEAM_NAMES:
            if topic == f"/{side}_connection_service":
                self._sit(client, cast("Side", side))
            elif topic == f"/swarm/{side}/density":
                self._command(client, side, _floats(message))
            elif topic == f"/swarm/{side}/target":
                self._command(client, side, _occupancy(message))
        if topic == "/tablet_comm":
            self._command(client, message.get("team"), _floats(message))
        elif topic == "/clear_locs":
            for side, owner in self._owners.items():
                if owner is client:
                    self._command(client, side, np.ones(1))

    def called(self, client: Client, service: str, arguments: Message) -> Message:
        """Refuse: the table has no services."""
        raise ProtocolError(f"there is no service {service}; a seat is taken by publishing /red_connection_service")

    def left(self, client: Client) -> None:
        """Keep the seat of who has gone: it may come back."""
        self._clients.discard(client)

    def _sit(self, client: Client, side: Side) -> None:
        self._own(client, side)
        seat = self._seats.get(side)
        if seat is not None and not seat.ended:
            seat.say(protocol.Ready())
            return
        seat = self._seats[side] = Seat(self._address, side, self._shown, self._say)
        there = next((one for name, one in self._seats.items() if name != side and not one.ended), None)
        task = asyncio.create_task(seat.play(there.room if there is not None else None, self._opponent))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _own(self, client: Client, side: Side) -> None:
        """Give a side to a client, unless another has it that is still there."""
        owner = self._owners.get(side)
        if owner is not None and owner is not client and owner in self._clients:
            raise ProtocolError(f"{side} is taken by a client at {owner.address}")
        self._owners[side] = client

    def _command(self, client: Client, team: object, values: NDArray[np.float64]) -> None:
        if team not in TEAM_NAMES:
            raise ProtocolError(f"team must be red or blue, got {str(team)[:40]!r}")
        side = cast("Side", team)
        seat = self._seats.get(side)
        if seat is None or seat.ended:
            raise ProtocolError(f"nobody has taken {side}: publish on {side}_connection_service first")
        self._own(client, side)
        seat.command(coarse(values, seat.cells))

    def _leave_if_alone(self) -> None:
        if not self._clients:
            for seat in self._seats.values():
                seat.say(protocol.Leave())
                seat.stop()
            self._seats.clear()


class Seat:
    """A seat at the table that a client of the bridge plays.

    Attributes
    ----------
    cells : int
        Cells a side of a command.
    ended : bool
        Whether its connection to the table is over.
    """

    def __init__(self, address: str, side: Side, shown: Shown, say: Callable[[str], None]) -> None:
        self.cells, self.ended = GameConfig().command_cells, False
        self._address, self._side, self._shown, self._say = address, side, shown, say
        self._code: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._out: asyncio.Queue[protocol.ClientMessage] = asyncio.Queue()
        self._task: asyncio.Task[None] | None = None
        self._number = 0
        self._waiting: NDArray[np.float64] | None = None
        self._may_command = False

    @property
    def room(self) -> asyncio.Future[str]:
        """The code of its room, when it is known."""
        return self._code

    def say(self, message: protocol.ClientMessage) -> None:
        """Say something to the table."""
        self._out.put_nowait(message)

    def command(self, density: NDArray[np.float64]) -> None:
        """Send a density (A, A) with values in [0, 1]; the latest waits while no game takes commands."""
        if not self._may_command:
            self._waiting = density
            return
        self._number += 1
        self.say(protocol.CommandMessage(self._number, density=density.tolist()))

    def stop(self) -> None:
        """End the connection."""
        if self._task is not None:
            self._task.cancel()

    async def play(self, room: asyncio.Future[str] | None, opponent: str | None) -> None:
        """Sit down, in the room of the other seat if there is one, and show what is seen until it is over."""
        self._task = asyncio.current_task()
        try:
            code = await room if room is not None else None
            address = f"ws://{self._address}/socket"
            async with connect(address, subprotocols=[Subprotocol(protocol.SUBPROTOCOL)], max_size=None) as socket:
                self._say_first(code, opponent)
                writer = asyncio.create_task(self._write(socket))
                try:
                    await self._listen(socket)
                finally:
                    writer.cancel()
        except (ConnectionClosed, OSError) as error:
            self._say(f"rosbridge: {self._side} lost its seat: {error}")
        finally:
            self.ended = True
            if not self._code.done():
                self._code.cancel()

    def _say_first(self, code: str | None, opponent: str | None) -> None:
        waiting = [self._out.get_nowait() for _ in range(self._out.qsize())]
        first: protocol.ClientMessage
        first = protocol.Create(seat=self._side, opponent=opponent) if code is None else protocol.Join(code, self._side)
        for message in (protocol.Hello(kind="program"), first, protocol.Ready(), *waiting):
            self.say(message)

    async def _write(self, socket: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await socket.send(protocol.encode(await self._out.get()))

    async def _listen(self, socket: ClientConnection) -> None:
        frames = 0
        async for data in socket:
            if isinstance(data, str):
                self._hear(protocol.decode_server(data))
            elif data[0] == FRAME:
                frame = decode_frame(data)
                frames += 1
                if frames % 4 == 0:
                    self.say(protocol.Acknowledge(frame.sequence))
                self._shown.show(frame)

    def _hear(self, message: protocol.ServerMessage) -> None:
        if isinstance(message, protocol.Welcome):
            self.cells = message.command_cells
        elif isinstance(message, protocol.Seated) and not self._code.done():
            self._code.set_result(message.room)
            self._say(f"rosbridge: {self._side} plays in room {message.room}")
        elif isinstance(message, protocol.RoomState):
            self._may_command = message.phase in ("starting", "playing")
            if self._may_command and self._waiting is not None:
                waiting, self._waiting = self._waiting, None
                self.command(waiting)
        elif isinstance(message, protocol.Refused):
            self._say(f"rosbridge: the table refused {self._side}'s {message.about or 'message'}: {message.reason}")


class Shown:
    """What subscribers are shown of a game: each moment once, though both seats see it."""

    def __init__(self, rosbridge: Rosbridge) -> None:
        self._rosbridge = rosbridge
        self._sequence, self._tick = -1, -1
        self._teams: NDArray[np.int8] | None = None
        self._past = Past()

    def show(self, frame: Frame) -> None:
        """Publish what a frame tells, as far as anybody wants it."""
        if frame.tick == self._tick or frame.tick == 0 == self._tick:
            return
        if frame.tick < self._tick:
            self._teams, self._past = None, Past()
        self._tick = frame.tick
        self._tell_teams(frame)
        self._past.add(frame)
        makers: dict[str, Callable[[], Message]] = {
            "/clock": lambda: messages.clock(frame.tick),
            "/tf": lambda: messages.transforms(frame),
            "/agent/visual": lambda: messages.markers(frame),
            "/swarm/sizes": lambda: messages.sizes(frame),
        }
        for team, name in enumerate(TEAM_NAMES):
            makers[f"/swarm/{name}/poses"] = lambda team=team: messages.poses(frame, team)  # type: ignore[misc]
            makers[f"/{name}_ck_plot"] = lambda team=team: messages.floats(self._past.picture(team))  # type: ignore[misc]
            if frame.fields is not None:
                field = frame.fields[team]
                makers[f"/swarm/{name}/capture_field"] = lambda field=field: messages.capture_field(  # type: ignore[misc]
                    field, frame.tick
                )
        for topic, make in makers.items():
            if self._rosbridge.wanted(topic):
                self._rosbridge.publish(topic, make())

    def _tell_teams(self, frame: Frame) -> None:
        former, self._teams = self._teams, frame.teams
        for drone, team in enumerate(frame.teams.tolist()):
            if former is None or former[drone] != team:
                self._rosbridge.publish("/agent_team_status", messages.text(f"agent{drone} {TEAM_NAMES[team]}"))


class Past:
    """Where teams have been, as the controller remembers it: fading sums of the basis over their drones' places."""

    def __init__(self) -> None:
        tau = GameConfig().memory.controller
        self._decay = np.exp(-CONTROL_PERIOD / tau) if tau is not None else 1.0
        self._sums = np.zeros((2, _MODES, _MODES))
        self._weights = np.zeros(2)

    def add(self, frame: Frame) -> None:
        """Remember a moment; one in a control period."""
        if frame.tick % 3:
            return
        k = np.pi * np.arange(_MODES)
        for team in range(2):
            places = np.asarray(frame.positions, np.float64)[frame.teams == team]
            basis = np.cos(k[:, None] * places[:, 0]) @ np.cos(k[:, None] * places[:, 1]).T
            self._sums[team] = self._decay * self._sums[team] + basis
            self._weights[team] = self._decay * self._weights[team] + len(places)

    def picture(self, team: int) -> NDArray[Any]:
        """Return the density that they make (G, G), by the modes that the controller compares."""
        mean = self._sums[team] / max(self._weights[team], 1e-12)
        return np.asarray(reconstruct(mean, GRID_CELLS))


def coarse(values: NDArray[np.float64], cells: int) -> NDArray[np.float64]:
    """Return an image (n, n) as a density (cells, cells) with 1 as its largest value: each cell's mean.

    Raises
    ------
    ProtocolError
        If it is no square of as many values as cells, or a multiple of these, or none is above zero.
    """
    side = round(len(values) ** 0.5)
    if side == 1:
        return np.ones((cells, cells))
    if side * side != len(values) or side % cells:
        raise ProtocolError(
            f"data must be a square image, row after row from the bottom, of {cells} cells a side or a multiple of it, "
            f"got {len(values)} values"
        )
    if not np.isfinite(values).all() or (values < 0.0).any():
        raise ProtocolError("data must be finite numbers, none below 0")
    part = side // cells
    means = values.reshape(cells, part, cells, part).mean(axis=(1, 3))
    largest = means.max()
    return means / largest if largest > 0.0 else np.ones((cells, cells))


def _floats(message: Message) -> NDArray[np.float64]:
    """Return the numbers of a message's `data`.

    Raises
    ------
    ProtocolError
        If they are none.
    """
    try:
        return np.asarray(message.get("data"), np.float64).reshape(-1)
    except (TypeError, ValueError) as error:
        raise ProtocolError("data must be a list of numbers") from error


def _occupancy(message: Message) -> NDArray[np.float64]:
    """Return the values of an OccupancyGrid; -1 is unknown, and as 0."""
    return np.maximum(_floats(message), 0.0)


def run_bridge(address: str, opponent: str | None, host: str, port: int) -> None:
    """Serve rosbridge for a table, until the process is told to end."""
    with contextlib.suppress(KeyboardInterrupt, asyncio.CancelledError):
        asyncio.run(Bridge(address, opponent, lambda line: print(line, flush=True)).run(host, port))  # noqa: T201
