"""A seat that a ROS program plays: a client of the game server's own protocol."""

from __future__ import annotations

import asyncio
import contextlib
import time
from typing import TYPE_CHECKING

from websockets import Subprotocol
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from swarm_pz.config import TEAM_NAMES, GameConfig
from swarm_pz.errors import ProtocolError
from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, TARGET, decode_frame, decode_target
from swarm_pz.play.protocol import Side
from swarm_pz.play.ros.commands import Maker

if TYPE_CHECKING:
    from swarm_pz.play.ros.bridge import Bridge

_COMMAND_S = 0.1
"""Least seconds between two commands to the server; of commands that come sooner, only the latest waits."""
_NUMBER_BYTES = 32
"""Room for the number in a command's message; the server ends a connection after too long a message."""
_ACKNOWLEDGED = 4
"""Frames per acknowledgement."""
_ENDS = {"red": "red has won", "blue": "blue has won", "draw": "a draw", "stopped": "it was stopped"}


class Seat:
    """A seat, from its connection to the server to its end; it passes what it receives on to its bridge."""

    def __init__(self, address: str, side: Side, bridge: Bridge) -> None:
        self.side: Side = side
        self.room: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        """The code of its room, once it is known; cancelled if there will be none."""
        self.ended = False
        self._address, self._bridge = address, bridge
        self._takes: protocol.Commands | None = None
        self._cells = GameConfig().command_cells
        self._unread: Maker | None = None
        """The latest command that came before the seat's kind of commands was known."""
        self._waiting: protocol.CommandMessage | None = None
        self._number, self._next_s, self._frames = 0, 0.0, 0
        self._out: list[protocol.ClientMessage] = []
        self._wake = asyncio.Event()
        self._phase, self._is_ready = "", True

    # --- what its player says ---------------------------------------------------------------------

    def ready(self) -> None:
        """Set the player ready for the first or the next game."""
        if self._phase in ("waiting", "over") and not self._is_ready:
            self._is_ready = True
            self._say(protocol.Ready())

    def command(self, maker: Maker) -> None:
        """Queue a command, or raise ProtocolError if the seat does not take it; the latest waits for a game."""
        if self._takes is None:
            self._unread = maker
            return
        command = maker(self._takes, self._cells)
        size = len(protocol.encode(command))
        if size > protocol.MAX_MESSAGE_BYTES - _NUMBER_BYTES:
            raise ProtocolError(f"a command may have {protocol.MAX_MESSAGE_BYTES} bytes at the table, got {size}")
        self._waiting = command
        self._wake.set()

    def leave(self) -> None:
        """Give the seat up."""
        self._say(protocol.Leave())

    def _say(self, message: protocol.ClientMessage) -> None:
        self._out.append(message)
        self._wake.set()

    # --- its connection ---------------------------------------------------------------------------

    async def play(self, beside: Seat | None, opponent: str | None, settings: protocol.Settings) -> None:
        """Take the seat, in the room of `beside` or a new one, and pass on messages until the connection ends."""
        try:
            first: protocol.ClientMessage = protocol.Create(seat=self.side, opponent=opponent, settings=settings)
            if beside is not None:
                await asyncio.wait([beside.room])
                if beside.room.cancelled():
                    raise ProtocolError(f"{beside.side} has found no room")
                first = protocol.Join(beside.room.result(), self.side)
            self._out = [protocol.Hello(), first, protocol.Ready(), *self._out]
            self._wake.set()
            address, spoken = f"ws://{self._address}/socket", [Subprotocol(protocol.SUBPROTOCOL)]
            async with connect(address, subprotocols=spoken, max_size=None, close_timeout=1) as socket:
                writer = asyncio.create_task(self._write(socket))
                try:
                    async for data in socket:
                        self._take(data)
                finally:
                    writer.cancel()
            self._tell("the table has ended the connection", is_fault=True)
        except (ConnectionClosed, OSError, ProtocolError) as error:
            self._tell(f"has no seat at the table: {error}", is_fault=True)
        finally:
            self.ended = True
            self.room.cancel()

    async def _write(self, socket: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await self._wake.wait()
                self._wake.clear()
                while self._out:
                    message = self._out.pop(0)
                    await socket.send(protocol.encode(message))
                    if isinstance(message, protocol.Leave):
                        await socket.close()
                await self._send_command(socket)

    async def _send_command(self, socket: ClientConnection) -> None:
        if self._waiting is None or self._phase not in ("starting", "playing"):
            return
        early_s = self._next_s - time.monotonic()
        if early_s > 0.0:
            asyncio.get_running_loop().call_later(early_s, self._wake.set)
            return
        command, self._waiting = self._waiting, None
        self._number += 1
        self._next_s = time.monotonic() + _COMMAND_S
        command.number = self._number
        await socket.send(protocol.encode(command))

    # --- what the table says ----------------------------------------------------------------------

    def _tell(self, text: str, *, is_fault: bool = False) -> None:
        self._bridge.report(self, text, is_fault)

    def _take(self, data: str | bytes) -> None:
        if isinstance(data, str):
            self._hear(protocol.decode_server(data))
        elif data[0] == FRAME:
            frame = decode_frame(data)
            self._frames += 1
            if self._frames % _ACKNOWLEDGED == 0:
                self._say(protocol.Acknowledge(frame.sequence))
            self._bridge.show(self, frame)
        elif data[0] == TARGET and TEAM_NAMES[(target := decode_target(data)).team] == self.side:
            self._bridge.show_target(self, target)

    def _hear(self, message: protocol.ServerMessage) -> None:
        match message:
            case protocol.Welcome():
                self._cells = message.command_cells
            case protocol.Seated():
                self._sit(message)
            case protocol.RoomState():
                if message.phase == "over" != self._phase:
                    self._tell(f"the game is over: {_ENDS[message.outcome or 'stopped']}")
                self._phase = message.phase
                self._is_ready = self._is_ready and message.phase != "playing"
                self._wake.set()
            case protocol.Refused():
                self._tell(f"{message.about or 'a message'} is refused: {message.reason}", is_fault=True)
                if message.about in ("create", "join"):
                    self.leave()
            case protocol.Notice():
                self._tell(message.text)

    def _sit(self, message: protocol.Seated) -> None:
        self._takes = message.commands
        if not self.room.done():
            self.room.set_result(message.room)
            self._tell(f"plays in room {message.room}, flown by {message.commands.system}")
        unread, self._unread = self._unread, None
        if unread is not None:
            try:
                self.command(unread)
            except ProtocolError as error:
                self._tell(str(error), is_fault=True)
