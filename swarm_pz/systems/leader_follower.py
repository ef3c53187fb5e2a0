"""Leaders and followers: the player sends leaders to places, and the rest follow by consensus.

Second-order consensus (Ren and Beard, "Distributed Consensus in Multi-vehicle Cooperative Control", 2008; its
first-order form: Olfati-Saber and Murray, "Consensus problems in networks of agents with switching topology and
time-delays", IEEE TAC 2004), with leaders that do not take part in it, so that followers gather between them (Ji et
al., "Containment control in mobile networks", IEEE TAC 2008), and with separation as in Tanner, Jadbabaie and Pappas,
"Stable flocking of mobile agents" (CDC 2003).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.base import Range, Share
from swarm_pz.config.system import ControlSystem, Flight
from swarm_pz.config.values import describe
from swarm_pz.errors import CommandError
from swarm_pz.spaces.densities import density_at

Gain = Annotated[float, Range(0.0, 1e4)]
Array = NDArray[np.float64]

_APART = 0.25
"""Distance of several leaders from the place that they surround, in map widths."""
_CLOSE = 1e-6
"""Least distance, in map widths, so that pushes stay finite."""
_PERCENT = (10, 30, 50, 70, 90)
"""Coordinates of named places, along either axis."""


@dataclass(frozen=True, kw_only=True)
class LeaderFollower(ControlSystem):
    """Leaders fly to the command's places, one each; the other drones follow the drones that they hear.

    Attributes
    ----------
    leaders : int
        Places k of a command.
    appoint : {"nearest", "lowest"}
        Who leads: for each place in turn the nearest free drone, or the drones with the lowest numbers. Each drone
        appoints leaders among those that it hears, anew at each solve, so a captured leader is replaced at once.
    foresight : float
        Distances count from where a drone will be after this many seconds, so that a leader keeps its place.
    stiffness, damping : float
        Of leaders: acceleration per map width to the place, 1/s², and against the velocity, 1/s.
    cohesion, alignment : float
        Of followers: acceleration per map width to the mean place of the others, and per difference to
        their mean velocity.
    leadership : float
        Weight of the leaders in these means; the other followers have the rest.
    separation : float
        Acceleration away from a drone at distance 0, falling to 0 at the radius.
    separation_radius : float
        Map widths.
    margin : float
        Leaders come no nearer to the walls than this, in map widths.
    """

    name: ClassVar[str] = "leader_follower"
    takes: ClassVar[str] = "leaders"
    turns: ClassVar[str] = "places"
    shares: ClassVar[str] = "its position and velocity"

    leaders: Annotated[int, Range(1, 100)] = 2
    appoint: Literal["nearest", "lowest"] = "nearest"
    foresight: Annotated[float, Range(0.0, 10.0)] = 0.5
    stiffness: Gain = 4.0
    damping: Gain = 4.0
    cohesion: Gain = 4.0
    alignment: Gain = 4.0
    leadership: Share = 0.5
    separation: Gain = 2.0
    separation_radius: Annotated[float, Range(1e-3, 2.0)] = 0.1
    margin: Annotated[float, Range(0.0, 0.5)] = 0.02

    # --- commands -----------------------------------------------------------------------------

    def space(self, config: GameConfig) -> spaces.Box:
        """Return the places (k, 2) of the leaders, in map widths."""
        return spaces.Box(0.0, 1.0, (self.leaders, 2), np.float32)

    def default(self, config: GameConfig) -> Array:
        """Return places around the middle; the middle itself for a single leader."""
        return self._around(0.5, 0.5)

    def parse(self, command: Any, config: GameConfig, name: str = "command") -> Array:
        """Return one command as an array.

        Parameters
        ----------
        command : array_like (k, 2), or mapping
            Places, or `{leader: (x, y)}` with a place for each of the leaders 0 to k - 1.

        Raises
        ------
        CommandError
            If a leader has no place, a place no leader, or one lies outside the square.
        """
        if isinstance(command, Mapping):
            command = self._in_order(command, name)
        count = len(command) if hasattr(command, "__len__") else None
        if count is not None and count != self.leaders:
            raise CommandError(
                f"{name} must be {self.leaders} places (x, y), one for each leader, got {describe(command)}; "
                f"LeaderFollower(leaders=...) says how many leaders there are"
            )
        return super().parse(command, config, name)

    def _in_order(self, mapping: Mapping[Any, Any], name: str) -> list[Any]:
        expected = f"{name} must have a place for each of the leaders 0 to {self.leaders - 1}"
        places: dict[int, Any] = {}
        for key, place in mapping.items():
            number = int(key) if isinstance(key, str) and key.isdecimal() and len(key) < 9 else key  # JSON's keys
            if not isinstance(number, (int, np.integer)) or not 0 <= number < self.leaders:
                raise CommandError(f"{expected}, got one for {key!r}: that leader does not exist")
            places[int(number)] = place
        missing = [leader for leader in range(self.leaders) if leader not in places]
        if missing:
            raise CommandError(f"{expected}, got none for {', '.join(map(str, missing))}")
        return [places[leader] for leader in range(self.leaders)]

    def to_densities(self, commands: Array, config: GameConfig) -> Array:
        """Return where the leaders are sent."""
        return density_at(commands, config.command_cells)

    def named(self, config: GameConfig) -> Mapping[str, Array]:
        """Return all leaders at one of 25 places, `at_10_10` and so on, and around it, `around_10_10` and so on."""
        grid = {f"{x}_{y}": (x / 100, y / 100) for x in _PERCENT for y in _PERCENT}
        named = {f"at_{place}": np.tile(middle, (self.leaders, 1)) for place, middle in grid.items()}
        if self.leaders > 1:
            named |= {f"around_{place}": self._around(*middle) for place, middle in grid.items()}
        return named

    def _around(self, x: float, y: float) -> Array:
        """Return places on a circle, as far as it lies in the square."""
        radius = _APART if self.leaders > 1 else 0.0
        angles = [2 * math.pi * leader / self.leaders for leader in range(self.leaders)]
        circle = np.array([(x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in angles])
        return np.asarray(np.clip(circle, 0.0, 1.0))

    # --- flight -------------------------------------------------------------------------------

    def solve(self, flight: Flight, config: GameConfig) -> Array:
        """Steer leaders to their places, and the others after them; docs/control_systems.md has the equations."""
        factor = float(config.dynamics.speed_factor)
        own = flight.own[:, :, None]
        positions = np.where(own, flight.positions, 0.0).astype(np.float64)
        velocities = np.where(own, flight.velocities, 0.0).astype(np.float64)
        ranks = self._ranks(flight, positions + self.foresight * factor * velocities)
        own_rank = np.diagonal(ranks, axis1=1, axis2=2)
        places = np.clip(flight.commands, self.margin, 1.0 - self.margin)
        goals = np.take_along_axis(places, np.maximum(own_rank, 0)[:, :, None], axis=1)
        led = self.stiffness / factor * (goals - positions) - self.damping * velocities
        following = self._follow(ranks, flight.heard, positions, velocities, factor)
        keeping_apart = self._keep_apart(ranks, flight.heard, positions)
        return np.asarray(np.where(own_rank[:, :, None] >= 0, led, following) + keeping_apart)

    def _ranks(self, flight: Flight, expected: Array) -> NDArray[np.int64]:
        """Return the place (n, N, N) `[i, j]` to which drone i sees drone j lead, -1 for none."""
        heard = flight.heard
        if self.appoint == "lowest":
            order = np.cumsum(heard, axis=2) - 1
            return np.asarray(np.where(heard & (order < self.leaders), order, -1))
        ranks = np.full(heard.shape, -1)
        for leader in range(self.leaders):
            away = expected - flight.commands[:, leader, None, :]
            distance = away[:, :, 0] * away[:, :, 0] + away[:, :, 1] * away[:, :, 1]
            free = np.where(heard & (ranks < 0), distance[:, None, :], np.inf)
            best = free.argmin(axis=2)[:, :, None]
            exists = np.isfinite(np.take_along_axis(free, best, axis=2))
            chosen = np.where(exists, leader, np.take_along_axis(ranks, best, axis=2))
            np.put_along_axis(ranks, best, chosen, axis=2)
        return ranks

    def _follow(
        self, ranks: NDArray[np.int64], heard: NDArray[np.bool_], positions: Array, velocities: Array, factor: float
    ) -> Array:
        """Return the consensus (n, N, 2) of each drone with those that it hears, itself left out."""
        others = heard & ~np.eye(heard.shape[1], dtype=np.bool_)
        leading, following = others & (ranks >= 0), others & (ranks < 0)
        leaders, followers = leading.sum(axis=2), following.sum(axis=2)
        share = np.where(followers == 0, 1.0, self.leadership)
        weights = leading * (share / np.maximum(leaders, 1))[:, :, None]
        weights += following * ((1.0 - share) / np.maximum(followers, 1))[:, :, None]
        total = np.empty_like(positions)
        for axis in range(2):
            place, velocity = positions[:, :, axis], velocities[:, :, axis]
            pull = self.cohesion / factor * (place[:, None, :] - place[:, :, None])
            pull += self.alignment * (velocity[:, None, :] - velocity[:, :, None])
            total[:, :, axis] = (weights * pull).sum(axis=2)
        return total

    def _keep_apart(self, ranks: NDArray[np.int64], heard: NDArray[np.bool_], positions: Array) -> Array:
        """Return the push (n, N, 2) away from near drones; only leaders push leaders."""
        leads = np.diagonal(ranks, axis1=1, axis2=2) >= 0
        counts = heard & (~leads[:, :, None] | (ranks >= 0))
        x, y = (positions[:, :, None, axis] - positions[:, None, :, axis] for axis in range(2))
        distance = np.sqrt(x * x + y * y)
        strength = self.separation * np.maximum(0.0, 1.0 - distance / self.separation_radius)
        strength = np.where(counts, strength / np.maximum(distance, _CLOSE), 0.0)
        return np.stack([(strength * x).sum(axis=2), (strength * y).sum(axis=2)], axis=2)
