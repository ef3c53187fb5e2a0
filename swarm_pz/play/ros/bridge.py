"""A rosbridge server, whose clients play in seats of the game server like any other player.

It runs in a process of its own, which ends with the game server, and connects to the server's socket, as every program
does. So messages of a megabyte, or clients that never read, disturb nobody's game.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import reprlib
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import CommandError, ProtocolError
from swarm_pz.evaluation.processes import prepare_process
from swarm_pz.play.frames import Frame, Target
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import SIDES, Side
from swarm_pz.play.robots import Lab
from swarm_pz.play.ros import commands, messages, robots
from swarm_pz.play.ros.commands import Maker
from swarm_pz.play.ros.messages import LOG, TOPICS, Message, log
from swarm_pz.play.ros.rosbridge import Client, Origins, Rosbridge
from swarm_pz.play.ros.seat import Seat
from swarm_pz.play.server.room_settings import settings_of

_ALONE_S = 60.0
"""Seconds after which seats are given up if all clients have gone."""


def _say(line: str) -> None:
    print(line, flush=True)  # noqa: T201


class Bridge(Rosbridge):
    """A rosbridge whose clients play in one room of the game server at an address (host and port).

    `opponent`, a policy, plays against the first client; without one, the game waits for a second player. With `lab`,
    a lab's settings and the server's token, its robots fly the games. `say` is called with lines for the terminal.
    """

    def __init__(
        self,
        opponent: str | None,
        table: TableConfig,
        origins: Origins,
        lab: Lab | None,
        address: str,
        say: Callable[[str], None] = _say,
        alone_s: float = _ALONE_S,
    ) -> None:
        topics = (TOPICS, commands.INPUTS) if lab is None else (TOPICS | robots.TOPICS, commands.INPUTS | robots.INPUTS)
        super().__init__(*topics, every=frozenset({"/agent_team_status", LOG}))
        self._flight: robots.Flight | None = None
        if lab is not None:
            config, token = lab
            self._flight = robots.Flight(robots.Robots(config, self._log), address, token, self.publish)
        self._address, self._opponent, self._say, self._alone_s = address, opponent, say, alone_s
        self._origins, self._settings = origins, settings_of(table)
        self._is_weak = table.mapping != "paper"
        """True if these rules need more contrast than the tablet's images have."""
        self._tick = -1
        self._teams: list[int] | None = None
        self._altitudes: NDArray[np.floating[Any]] | None = None
        """Altitudes of the last keyframe: other frames leave them out, and they never change within a game."""
        self._seats: dict[Side, Seat] = {}
        self._owners: dict[Side, Client] = {}
        """The client that last took or commanded each side."""
        self._present: set[Client] = set()
        """Connected clients that have published a message."""
        self._ending: asyncio.TimerHandle | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def run(self, listening: socket.socket) -> None:
        """Serve until cancelled."""
        host, port = listening.getsockname()[:2]
        self._say(f"rosbridge is at ws://{f'[{host}]' if ':' in host else host}:{port}")
        flights = [self._flight.run()] if self._flight is not None else []
        await asyncio.gather(self.serve_at(listening, self._origins), *flights)

    # --- messages from clients --------------------------------------------------------------------

    def heard(self, client: Client, topic: str, message: Message) -> None:
        """Handle a message; topics that are not known here are ignored."""
        self._present.add(client)
        if self._ending is not None:
            self._ending.cancel()
            self._ending = None
        if self._flight is not None and topic in robots.INPUTS:
            self._flight.robots.hear(topic, message, time.monotonic())
            return
        own = [side for side, owner in self._owners.items() if owner is client]
        if topic == commands.TABLET:
            self._command(client, message.get("team"), commands.density(message, self._is_weak))
        elif topic == commands.CLEAR:
            for side in own:
                self._command(client, side, commands.clear)
        elif topic == commands.ATTRACTOR:
            for side in own or ["red"]:  # which this topic moves in its original software
                self._command(client, side, commands.attractor(message))
        for side in SIDES:
            if topic == f"/{side}_connection_service":
                self._sit(client, side)
            for name, (_, reader) in commands.READERS.items():
                if topic == f"/swarm/{side}/{name}":
                    self._command(client, side, reader(message))

    def left(self, client: Client) -> None:
        """If the last client has gone, keep the seats for a while: it may come back."""
        self._present.discard(client)
        if not self._present and self._ending is None:
            self._ending = asyncio.get_running_loop().call_later(self._alone_s, self._leave)

    # --- seats ------------------------------------------------------------------------------------

    def _sit(self, client: Client, side: Side) -> None:
        seat, other = self._seat(side), self._seat("blue" if side == "red" else "red")
        if seat is None and other is not None and self._opponent is not None:
            raise ProtocolError(f"{side} is played by the policy {self._opponent}")
        self._owners[side] = client
        if seat is not None:
            seat.ready()
            return
        seat = self._seats[side] = Seat(self._address, side, self)
        task = asyncio.create_task(seat.play(other, self._opponent, self._settings))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _command(self, client: Client, team: object, maker: Maker) -> None:
        if team not in TEAM_NAMES:
            raise ProtocolError(f"team must be red or blue, got {reprlib.repr(team)}")
        side = cast("Side", team)
        seat = self._seat(side)
        if seat is None:
            raise ProtocolError(f"nobody has taken {side}: publish on {side}_connection_service first")
        self._owners[side] = client
        seat.command(maker)

    def _seat(self, side: Side) -> Seat | None:
        seat = self._seats.get(side)
        return None if seat is None or seat.ended else seat

    def _leave(self) -> None:
        self._ending = None
        for seat in self._seats.values():
            seat.leave()
        self._seats.clear()
        self._owners.clear()

    # --- messages from seats ----------------------------------------------------------------------

    def show(self, seat: Seat, frame: Frame) -> None:
        """Publish a frame of the first seat; the other seat's frames show the same game."""
        if seat is next((one for one in self._seats.values() if not one.ended), None):
            self.publish_frame(frame)

    def publish_frame(self, frame: Frame) -> None:
        """Publish a frame on every topic that has subscribers, once."""
        if frame.altitudes is not None:
            self._altitudes = frame.altitudes
        if frame.tick == self._tick:
            return
        if frame.tick < self._tick:  # another game has begun
            self._teams = None
            self._altitudes = frame.altitudes
        if self._altitudes is not None and len(self._altitudes) == len(frame.teams):
            frame = replace(frame, altitudes=self._altitudes)
        self._tick, former, self._teams = frame.tick, self._teams, frame.teams.tolist()
        for drone, team in enumerate(self._teams):
            if former is None or former[drone] != team:
                self.publish("/agent_team_status", messages.team_status(drone, team))
        for topic, make in messages.makers_of(frame).items():
            if self.wanted(topic):
                self.publish(topic, make())

    def show_target(self, seat: Seat, target: Target) -> None:
        """Publish a target to all but the opponent."""
        other = self._owners.get("blue" if seat.side == "red" else "red")
        hidden = other if other is not self._owners.get(seat.side) else None
        if self.wanted(topic := f"/{seat.side}_team_target_dist"):
            self.publish(topic, messages.target(target.picture, max(self._tick, 0)), but=hidden)

    def report(self, seat: Seat, text: str, is_fault: bool) -> None:
        """Publish a report on a seat in the log."""
        self._log(f"{seat.side}: {text}", is_fault)

    def _log(self, line: str, is_fault: bool = True) -> None:
        self._say(f"rosbridge: {line}")
        self.publish(LOG, log(line, time.time(), is_fault))


# --- its process ----------------------------------------------------------------------------------


def listen(host: str, port: int) -> socket.socket:
    """Return a listening socket for a rosbridge; raise CommandError if it cannot listen there."""
    try:
        return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        raise CommandError(
            f"cannot listen for ROS programs at {host}, port {port}: {os.strerror(error.errno or 0)}; is another "
            "rosbridge running? Try another --rosbridge"
        ) from error


@contextlib.contextmanager
def rosbridge(
    listening: socket.socket, opponent: str | None, table: TableConfig, origins: Origins, lab: Lab | None, address: str
) -> Iterator[None]:
    """Serve ROS programs at a socket in this context; see `Bridge`. `address` is the game server's host and port."""
    arguments = (listening, opponent, table, origins, lab, address)
    process = multiprocessing.get_context("spawn").Process(target=_serve, args=arguments, daemon=True)
    process.start()
    listening.close()
    try:
        yield
    finally:
        process.kill()
        process.join()


def _serve(listening: socket.socket, *arguments: Any) -> None:
    prepare_process()
    if hasattr(os, "nice"):
        os.nice(5)  # reading a large message takes a tenth of a second; the game's ticks come first
    asyncio.run(Bridge(*arguments).run(listening))
