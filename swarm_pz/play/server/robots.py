"""Robots that fly this server's games: the bridge to the lab sends their poses, and receives orders."""

from __future__ import annotations

import asyncio
import math
import secrets
import time
from collections.abc import Callable
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray
from starlette.websockets import WebSocket, WebSocketDisconnect

from swarm_pz.play.game import SPEED_LIMIT, LiveGame, TableConfig
from swarm_pz.play.robots import RobotsConfig
from swarm_pz.play.server.connection import RefusedError

PATH = "/robots"
"""Where the bridge connects, with the token."""
_GONE_S = 1.0
"""Seconds without poses from the bridge after which a game is stopped."""
_NEAR = 0.1
"""Map widths between a robot and its start below which a game may begin."""
_ROUNDS = 300
_LOOK_S, _REMIND_S, _PATIENCE_S = 0.1, 10.0, 30.0
"""Seconds between two checks of robots' places, and between two notices about robots that are not near; and until
all need only be seen, since they may block each other."""


class Sight(msgspec.Struct, tag=True):
    """Robots' positions and velocities by number, in map widths and seconds; None for a lost robot."""

    poses: list[tuple[float, float, float, float] | None]


class Stop(msgspec.Struct, tag=True):
    """Emergency stop."""


class Orders(msgspec.Struct):
    """Starts and accelerations of a game's drones, in map widths and seconds."""

    phase: Literal["starting", "playing", "over"]
    teams: list[int]
    starts: list[list[float]]
    accelerations: list[list[float]]


_decoder = msgspec.json.Decoder(Sight | Stop)


class Robots:
    """The robots of a lab, which fly one game at a time; `token` lets the bridge in."""

    def __init__(self, lab: RobotsConfig) -> None:
        self._lab = lab
        self._starts = np.zeros((0, 2), np.float32)
        self.token = secrets.token_hex(16)
        self._game: LiveGame | None = None
        self._sight, self._seen_s = Sight([]), -math.inf
        self._is_stopped = False
        self._orders = b""
        self._wake = asyncio.Event()

    async def serve(self, socket: WebSocket) -> None:
        """Take the bridge's messages, and send it orders, until it goes."""
        await socket.accept()
        writer = asyncio.create_task(self._write(socket))
        try:
            while True:
                message = _decoder.decode(await socket.receive_text())
                if isinstance(message, Stop):
                    self._is_stopped = True
                else:
                    self._sight, self._seen_s = message, time.monotonic()
        except (WebSocketDisconnect, msgspec.DecodeError):
            pass
        finally:
            writer.cancel()

    async def _write(self, socket: WebSocket) -> None:
        self._wake.set()  # an earlier bridge may have taken the orders
        while True:
            await self._wake.wait()
            self._wake.clear()
            if self._orders:
                await socket.send_text(self._orders.decode())

    def slowed(self, config: TableConfig) -> TableConfig:
        """Return a room's configuration, no faster than the lab's robots fly."""
        return config.replace(speed=min(config.speed, self._lab.speed))

    # --- games ------------------------------------------------------------------------------------

    def begin(self, game: LiveGame) -> None:
        """Lead the robots to the start of a game; RefusedError if they cannot fly it."""
        if self._game is not None:
            raise RefusedError("full", "the robots fly another game; wait for its end")
        self._check()
        self._game = game
        self._starts = apart(game.simulator.positions[0], self._lab.separation / self._lab.scale)
        self.order(game, "starting")

    def end(self, game: LiveGame) -> None:
        """Let the robots of a game rest."""
        if self._game is game:
            self._game = None
            self.order(game, "over")

    async def gather(self, game: LiveGame, notice: Callable[[str], None]) -> None:
        """Wait until all robots are near their starts; after some time, until all are seen.

        Raises RefusedError after an emergency stop.
        """
        reminded_s, began_s = -math.inf, time.monotonic()
        while away := np.flatnonzero((distances := self._distances(game)) > _NEAR).tolist():
            self._check()
            if time.monotonic() - began_s > _PATIENCE_S and np.isfinite(distances).all():
                break
            if time.monotonic() - reminded_s > _REMIND_S:
                reminded_s = time.monotonic()
                notice(f"the game waits until robots {', '.join(map(str, away))} are at their starts")
            await asyncio.sleep(_LOOK_S)

    def _distances(self, game: LiveGame) -> NDArray[np.float32]:
        """Return the distances of a game's robots from their starts, in map widths; infinity for lost ones."""
        away = self._poses(game)[:, :2] - self._starts
        return np.asarray(np.nan_to_num(np.hypot(away[:, 0], away[:, 1]), nan=math.inf))

    def see(self, game: LiveGame) -> NDArray[np.float32]:
        """Return the robots' poses as `LiveGame.place` takes them; RefusedError if the game cannot go on."""
        self._check()
        if time.monotonic() - self._seen_s > _GONE_S:
            raise RefusedError("not_valid", f"no poses have come for {_GONE_S:g} s: is the bridge to the robots there?")
        return self._poses(game)

    def _poses(self, game: LiveGame) -> NDArray[np.float32]:
        poses = np.full((game.config.game.num_drones, 4), np.nan, np.float32)
        for drone, pose in enumerate(self._sight.poses[: len(poses)]):
            if pose is not None:
                poses[drone] = pose
        poses[:, :2] = np.clip(poses[:, :2], 0.0, 1.0)
        poses[:, 2:] = np.clip(poses[:, 2:] / _speed(game), -SPEED_LIMIT, SPEED_LIMIT)
        return poses

    def order(self, game: LiveGame, phase: Literal["starting", "playing", "over"] = "playing") -> None:
        """Send the bridge orders for the drones of a game."""
        games, speed = game.simulator.games, _speed(game) * game.config.speed
        orders = Orders(
            phase,
            games.teams[0].tolist(),
            self._starts.tolist(),
            (games.accelerations[0] * np.float32(speed)).tolist(),
        )
        self._orders = msgspec.json.encode(orders)
        self._wake.set()

    def _check(self) -> None:
        if self._is_stopped:
            raise RefusedError("not_valid", "an emergency stop was made: restart swarm-pz to fly again")


def apart(places: NDArray[np.float32], least: float) -> NDArray[np.float32]:
    """Return places (N, 2) on the map, moved until they are at least `least` apart, if there is room for that."""
    places = places.copy()
    for _ in range(_ROUNDS):
        away = places[:, None] - places[None, :]
        distances = np.hypot(away[..., 0], away[..., 1]) + 1e-6
        np.fill_diagonal(distances, np.inf)
        gaps = np.maximum(1.05 * least / distances - 1.0, 0.0)
        if not gaps.any():
            break
        places = np.clip(places + 0.4 * (gaps[..., None] * away).sum(axis=1), 0.0, 1.0)
    return places


def _speed(game: LiveGame) -> float:
    """Return the speed of a drone of velocity 1, in map widths per real second."""
    return game.config.game.dynamics.speed_factor * game.config.speed
