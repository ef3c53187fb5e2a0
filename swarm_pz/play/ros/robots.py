"""Robots of a lab: their measured poses, and their setpoints, in metres in the lab's frame."""

from __future__ import annotations

import asyncio
import contextlib
import math
import re
import reprlib
import time
from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import ProtocolError
from swarm_pz.play.robots import RobotsConfig
from swarm_pz.play.ros.messages import COLOURS, Message, array
from swarm_pz.play.server.robots import PATH, Orders, Sight, Stop

POSES, STATES, STOP = "/robots/poses", "/robots/states", "/robots/stop"
INPUTS = {
    POSES: "geometry_msgs/PoseArray",
    STATES: "trajectory_msgs/MultiDOFJointTrajectory",
    STOP: "std_msgs/Empty",
}
"""Topics that the lab's programs publish, with their types."""
SETPOINTS, LIGHTS, STOPPED = "/robots/setpoints", "/robots/colours", "/robots/stopped"
TOPICS = {
    SETPOINTS: "trajectory_msgs/MultiDOFJointTrajectory",
    LIGHTS: "std_msgs/UInt8MultiArray",
    STOPPED: "std_msgs/Bool",
}
"""Topics that the lab's programs read, with their types."""
_MOST = 100
"""Most robots of a lab: with many more, setpoints would not be ready in time."""
_PERIOD_S = 1.0 / TICKS_PER_SECOND
_NOISE = 0.05
"""Metres of noise by which poses may differ without being jumps."""
_SLOWLY, _CLIMB = 0.5, 0.25
"""Largest speeds at which robots fly to their starts, and to their altitudes, in m/s."""
_GAIN, _BRAKE = 2.0, 0.8
"""Speed there per remaining distance, in 1/s; share of its speed that a stopping setpoint keeps each period."""
_ORDERED_S, _AGAIN_S = 0.5, 1.0
"""Seconds for which orders of a running game are valid; seconds between attempts to reach the server."""
_BRAKING, _ROUNDS = 1.0, 4
"""Deceleration of setpoints before walls and each other, in m/s^2; number of passes over all pairs."""
_ASIDE = 0.5
"""Sideways share of the braking: robots that meet on the way to their starts also turn right."""
_HARDEST = 5.0
"""Largest acceleration that is published, in m/s^2."""

Floats = NDArray[np.float64]


class Robots:
    """Robots by number. `say` is called with lines for the log; times are in seconds of one clock."""

    def __init__(self, config: RobotsConfig, say: Callable[[str], None]) -> None:
        self.config, self.count, self.is_stopped, self._say = config, 0, False, say
        self._corner = np.array(config.corner)
        self.positions, self.velocities, self._last = (np.zeros((_MOST, 3)) for _ in range(3))
        self._seen_s, self._last_s, self._stamps = (np.full(_MOST, -math.inf) for _ in range(3))
        self.setpoints, self.speeds, self.accelerations = (np.zeros((_MOST, 3)) for _ in range(3))
        self.states, self._is_flown, self._in_game = ["lost"] * _MOST, np.zeros(_MOST, bool), 1
        self.rest()

    # --- poses ------------------------------------------------------------------------------------

    def hear(self, topic: str, message: Message, now: float) -> None:
        """Handle a message of one of `INPUTS`; raise ProtocolError if it is invalid."""
        if topic == STOP:
            self.is_stopped = True
            self._say("robots: EMERGENCY STOP; restart swarm-pz to fly again")
            return
        stamp = _seconds(message.get("header"))
        for number, place, velocity in _poses(message) if topic == POSES else _states(message):
            if number >= _MOST:
                raise ProtocolError(f"a robot's number must be below {_MOST}, got {number}")
            if place is not None:
                self._see(number, place, velocity, stamp, now)

    def _see(self, number: int, place: Floats, velocity: Floats | None, stamp: float, now: float) -> None:
        """Accept a pose, unless it is a jump; a lost robot is found when two poses in a row agree."""
        is_lost = self.states[number] == "lost"
        known, known_s = (self._last, self._last_s) if is_lost else (self.positions, self._seen_s)
        elapsed = now - known_s[number]
        way = self.config.max_speed * min(elapsed, self.config.late) + _NOISE
        is_near = elapsed <= self.config.lost and np.linalg.norm(place - known[number]) <= way
        self._last[number], self._last_s[number] = place, now
        if not is_near:
            return
        if is_lost:
            velocity = np.zeros(3) if velocity is None else velocity
        elif velocity is None:
            between = stamp - self._stamps[number]
            between = between if 0.0 < between <= self.config.lost else elapsed
            velocity = (place - known[number]) / max(between, 1e-3)
        self.positions[number], self.velocities[number] = place, velocity
        self._seen_s[number], self._stamps[number] = now, stamp
        self.count = max(self.count, number + 1)

    def look(self, now: float) -> None:
        """Update the states of all robots, and report those that change."""
        config, is_inside = self.config, self._are_inside(self.config.altitudes[0])
        for number in range(self.count):
            age = now - self._seen_s[number]
            held = "late" if age > config.late else "seen"
            state = "lost" if age > config.lost else held if is_inside[number] else "outside"
            if state != self.states[number]:
                self._say(f"robots: {number} is {state}, was {self.states[number]}")
            self.states[number] = state

    def sight(self) -> Sight:
        """Return positions and velocities in map widths and seconds, or None for robots that have failed."""
        places, speeds = (self.positions[:, :2] - self._corner), self.velocities[:, :2]
        rows = (np.column_stack([places, speeds]) / self.config.scale)[: self.count].tolist()
        return Sight([tuple(row) if self.states[n] in ("seen", "late") else None for n, row in enumerate(rows)])

    # --- setpoints --------------------------------------------------------------------------------

    def order(self, orders: Orders, now: float) -> None:
        """Set the orders of a game."""
        self._orders, self._ordered_s = orders, now
        self._in_game = max(self._in_game, len(orders.teams))

    def rest(self) -> None:
        """Forget the orders of the game."""
        self.order(Orders("over", [], [], []), -math.inf)

    def step(self, now: float) -> None:
        """Advance the setpoints by a period: they follow the game's drones, within the lab's limits.

        Before a game, robots within the fence take off. A lost robot flies on only if it is found in the air.
        """
        self.look(now)
        config, orders, count = self.config, self._orders, self.count
        states, is_flown, positions = np.array(self.states[:count]), self._is_flown[:count], self.positions[:count]
        former, is_free = self.setpoints[:count].copy(), states == "seen"
        begun, speeds = self.speeds[:count].copy(), self.speeds[:count].copy()
        led = np.flatnonzero(is_free[: len(orders.teams)])
        if orders.phase == "over" or (orders.phase == "playing" and now - self._ordered_s > _ORDERED_S):
            led = led[:0]
        is_flown[led] = True
        if orders.phase == "starting":
            is_flown[: len(orders.teams)] |= self._are_inside(-math.inf)[:count][: len(orders.teams)]
        is_flown &= states != "lost"
        stops = np.ones(count, bool)
        stops[led] = False
        speeds[stops, :2] *= _BRAKE
        if orders.phase == "playing":
            speeds[led, :2] += _PERIOD_S * config.scale * np.array(orders.accelerations)[led].reshape(-1, 2)
        else:
            starts = self._corner + config.scale * np.array(orders.starts)[led].reshape(-1, 2)
            speeds[led, :2] = _shortened(_GAIN * (starts - former[led, :2]), _SLOWLY)
        lowest, highest = config.altitudes
        altitudes = lowest + (highest - lowest) * np.minimum(np.arange(count) / max(self._in_game - 1, 1), 1.0)
        speeds[:, 2] = np.clip(_GAIN * (altitudes - former[:, 2]), -_CLIMB, _CLIMB) * (states != "late")
        known = np.flatnonzero(np.isfinite(self._seen_s[:count]))  # numbers may have gaps
        for _ in range(_ROUNDS):
            limited = _shortened(speeds[known], config.max_speed)[:, :2]
            speeds[known, :2] = self._braked(former[known, :2], positions[known, :2], limited, is_free[known])
        free = former + speeds * _PERIOD_S
        places = positions + _shortened(free - positions, config.leash)
        places[~is_free, :2] = free[~is_free, :2]
        places[:, :2] = np.clip(places[:, :2], self._corner, self._corner + config.scale)
        places = former + _shortened(places - former, config.max_speed * _PERIOD_S)
        self.setpoints[:count] = np.where(is_flown[:, None], places, positions)
        self.speeds[:count] = is_flown[:, None] * (places - former) / _PERIOD_S
        self.accelerations[:count] = _shortened((self.speeds[:count] - begun) / _PERIOD_S, _HARDEST)

    def _are_inside(self, lowest: float) -> NDArray[np.bool_]:
        """Return which robots (_MOST,) are within the fence around the map, from a lowest altitude up."""
        low = np.array([*self.config.corner, lowest]) - self.config.fence
        high = np.array([*(self._corner + self.config.scale), self.config.altitudes[1]]) + self.config.fence
        return np.asarray(np.all((self.positions >= low) & (self.positions <= high), axis=1), np.bool_)

    def _braked(self, places: Floats, positions: Floats, speeds: Floats, is_free: NDArray[np.bool_]) -> Floats:
        """Return velocities (N, 2) at which setpoints stop before walls, and setpoints and robots before others."""
        gaps = np.minimum(_distances(places), _distances(positions)) - self.config.separation
        away = places[:, None] - places[None, :]
        numbers = np.arange(len(places))
        away[..., 0] += 1e-6 * np.sign(numbers[:, None] - numbers[None, :])  # separates those at one place
        away /= np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-9)
        closing = -((speeds[:, None] - speeds[None, :]) * away).sum(axis=-1)
        share = is_free[:, None] / np.maximum(is_free[:, None] + is_free[None, :].astype(float), 1.0)
        excess = np.maximum(closing - _safe(gaps, 2.0 * _BRAKING), 0.0) * share
        aside = np.stack([-away[..., 1], away[..., 0]], axis=-1) * (_ASIDE if self._orders.phase == "starting" else 0.0)
        speeds = speeds + (excess[..., None] * (away + aside)).sum(axis=1)
        low, high = places - self._corner, self._corner + self.config.scale - places
        return np.asarray(np.clip(speeds, -_safe(low, _BRAKING), _safe(high, _BRAKING)), np.float64)

    def messages(self, seconds: float) -> Iterator[tuple[str, Message]]:
        """Yield topics and messages for the lab's programs at a wall-clock time.

        Robots that are not flown have no setpoints; after an emergency stop, no robot has any.
        """
        yield STOPPED, {"data": self.is_stopped}
        stamp = {"sec": int(seconds), "nanosec": int(seconds % 1.0 * 1e9)}
        flown = [] if self.is_stopped else np.flatnonzero(self._is_flown[: self.count]).tolist()
        none, level = _xyz(np.zeros(3)), {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
        point = {
            "transforms": [{"translation": _xyz(self.setpoints[n]), "rotation": level} for n in flown],
            "velocities": [{"linear": _xyz(self.speeds[n]), "angular": none} for n in flown],
            "accelerations": [{"linear": _xyz(self.accelerations[n]), "angular": none} for n in flown],
            "time_from_start": {"sec": 0, "nanosec": 0},
        }
        header, names = {"stamp": stamp, "frame_id": self.config.frame}, [f"agent{n}" for n in flown]
        yield SETPOINTS, {"header": header, "joint_names": names, "points": [point]}
        teams = [*self._orders.teams, *[-1] * self.count][: self.count]
        is_lit = [t >= 0 and s in ("seen", "late") for t, s in zip(teams, self.states, strict=False)]
        lights = [round(255 * c) if lit else 0 for t, lit in zip(teams, is_lit, strict=True) for c in COLOURS[t]]
        yield LIGHTS, array(lights, "red, green and blue of each robot")


class Flight:
    """Flies robots for the server at an address; `publish` is called with topics and messages."""

    def __init__(self, robots: Robots, address: str, token: str, publish: Callable[[str, Message], None]) -> None:
        self.robots, self._publish = robots, publish
        self._address = f"ws://{address}{PATH}?token={token}"

    async def run(self) -> None:
        """Fly until cancelled."""
        await asyncio.gather(self._fly(), self._listen())

    async def _fly(self) -> None:
        due = time.monotonic()
        while True:
            due = max(due + _PERIOD_S, time.monotonic() - _PERIOD_S)
            await asyncio.sleep(due - time.monotonic())
            self.robots.step(time.monotonic())
            for topic, message in self.robots.messages(time.time()):
                self._publish(topic, message)

    async def _listen(self) -> None:
        while True:
            with contextlib.suppress(OSError, WebSocketException, msgspec.DecodeError):
                async with connect(self._address, max_size=None) as socket:
                    sender = asyncio.create_task(self._send(socket))
                    try:
                        async for data in socket:
                            self.robots.order(msgspec.json.decode(data, type=Orders), time.monotonic())
                    finally:
                        sender.cancel()
            self.robots.rest()
            await asyncio.sleep(_AGAIN_S)

    async def _send(self, socket: ClientConnection) -> None:
        with contextlib.suppress(WebSocketException):
            while True:
                await asyncio.sleep(_PERIOD_S)
                message = Stop() if self.robots.is_stopped else self.robots.sight()
                await socket.send(msgspec.json.encode(message).decode())


def _shortened(ways: Floats, most: float) -> Floats:
    """Return vectors (N, ...) no longer than `most`."""
    lengths = np.linalg.norm(ways, axis=-1, keepdims=True)
    return np.asarray(ways * np.minimum(1.0, most / np.maximum(lengths, 1e-12)))


def _distances(places: Floats) -> Floats:
    """Return distances (N, N), with infinity on the diagonal."""
    distances = np.linalg.norm(places[:, None] - places[None, :], axis=-1)
    np.fill_diagonal(distances, np.inf)
    return np.asarray(distances)


def _safe(gaps: Floats, braking: float) -> Floats:
    """Return speeds from which robots stop within gaps; negative gaps have negative speeds, which lead away."""
    return np.where(gaps > 0.0, np.sqrt(2.0 * braking * np.maximum(gaps, 0.0)), _GAIN * gaps)


def _poses(message: Message) -> Iterator[tuple[int, Floats | None, None]]:
    poses = message.get("poses")
    if not isinstance(poses, list):
        raise ProtocolError("poses must be a list with a pose for each robot, by number")
    for number, pose in enumerate(poses):
        yield number, _vector(pose, "position"), None


def _states(message: Message) -> Iterator[tuple[int, Floats | None, Floats | None]]:
    names, points = message.get("joint_names"), message.get("points")
    point = points[-1] if isinstance(points, list) and points and isinstance(points[-1], dict) else {}
    transforms, velocities = point.get("transforms"), point.get("velocities")
    if not isinstance(names, list) or not isinstance(transforms, list) or len(names) != len(transforms):
        raise ProtocolError("states must have joint_names, and in their last point a transform for each of them")
    if not isinstance(velocities, list) or len(velocities) != len(names):
        velocities = [{"linear": None}] * len(names)
    for name, transform, velocity in zip(names, transforms, velocities, strict=True):
        match = re.fullmatch(r"\D*(\d{1,9})", name) if isinstance(name, str) else None
        if match is None:
            raise ProtocolError(f"a robot's name must end with its number, as agent3 does, got {reprlib.repr(name)}")
        yield int(match[1]), _vector(transform, "translation"), _vector(velocity, "linear")


def _vector(parent: Any, key: str) -> Floats | None:
    """Return x, y and z; None if they are unknown (NaN, which is null in JSON)."""
    if not isinstance(parent, dict) or key not in parent:
        raise ProtocolError(f"each robot must have {key} with x, y and z")
    child = parent[key] if isinstance(parent[key], dict) else {}
    numbers: list[Any] = [child.get(axis) for axis in "xyz"]
    known = [float(one) for one in numbers if type(one) in (int, float) and abs(one) < 1e6]
    return np.array(known) if len(known) == 3 else None


def _xyz(vector: Floats) -> Message:
    return dict(zip("xyz", vector.tolist(), strict=True))


def _seconds(header: Any) -> float:
    """Return the stamp of a header; 0 if it has none."""
    stamp = header.get("stamp") if isinstance(header, dict) else None
    stamp = stamp if isinstance(stamp, dict) else {}
    whole, rest = stamp.get("sec", stamp.get("secs")), stamp.get("nanosec", stamp.get("nsecs"))
    known = [one for one in (whole, rest) if type(one) is int and abs(one) < 2**63]
    return known[0] + known[1] * 1e-9 if len(known) == 2 else 0.0
