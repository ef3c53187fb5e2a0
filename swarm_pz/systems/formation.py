"""Formations: a shape, or drawn points, with a slot for every drone.

Slots are assigned with the least sum of squared distances (Kuhn, "The Hungarian method for the assignment
problem", 1955; see `swarm_pz.kernels.assignment`), and drones hold their slots by a PD law.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.base import Range
from swarm_pz.config.system import ControlSystem, Flight
from swarm_pz.config.values import check_values, describe
from swarm_pz.errors import CommandError, nearest
from swarm_pz.kernels.assignment import assign
from swarm_pz.spaces.densities import density_at
from swarm_pz.systems.shapes import SHAPES, unit_slots

_DRAWN = len(SHAPES)
"""The shape number of drawn points."""
_NUMBERS = 5
"""Numbers of a formation without drawn points: shape, x, y, size, turn."""
_LARGEST = 0.5
"""The largest size, in map widths."""
_USUAL = {"centre": (0.5, 0.5), "size": 0.25, "turn": 0.0}
"""Defaults of a mapping."""
_FEW_POINTS = 64
"""Drawn points that fit into a command, even in small games."""
_PERCENT = (20, 50, 80)
"""Coordinates of named formations, along either axis."""


@dataclass(frozen=True, kw_only=True)
class Formation(ControlSystem):
    """Each drone flies to its slot of a formation.

    A command is `[shape, x, y, size, turn, count, points...]`. The whole part of the first number is an index into
    `SHAPES`; one beyond the last means `count` drawn points. The first five alone are a command, too. Sizes are
    in map widths, turns in radians.

    Attributes
    ----------
    stiffness : float
        Acceleration per map width to the slot, 1/s².
    damping : float
        Acceleration against the velocity, 1/s.
    margin : float
        Slots come no nearer to the walls than this, in map widths.
    """

    name: ClassVar[str] = "formation"
    takes: ClassVar[str] = "formation"
    shares: ClassVar[str] = "its position"
    shapes: ClassVar[tuple[str, ...]] = SHAPES

    stiffness: Annotated[float, Range(0.0, 1e4)] = 4.0
    damping: Annotated[float, Range(0.0, 1e3)] = 4.0
    margin: Annotated[float, Range(0.0, 0.5)] = 0.02

    # --- commands -----------------------------------------------------------------------------

    def space(self, config: GameConfig) -> spaces.Box:
        """Return the formations, with room for as many drawn points as there are drones."""
        room = _room(config)
        first = self.learner_space(config)
        low = np.concatenate([first.low, [0.0], np.full(2 * room, -1.0)])
        high = np.concatenate([first.high, [room], np.full(2 * room, 1.0)])
        high[0] = _DRAWN + 1
        return spaces.Box(low.astype(np.float32), high.astype(np.float32))

    def learner_space(self, config: GameConfig) -> spaces.Box:
        """Return the formations without drawn points: shape, x, y, size and turn."""
        low = np.array([0.0, 0.0, 0.0, 0.0, -math.pi], np.float32)
        return spaces.Box(low, np.array([_DRAWN, 1.0, 1.0, _LARGEST, math.pi], np.float32))

    def default(self, config: GameConfig) -> NDArray[np.float64]:
        """Return a grid over the whole square."""
        return self.parse({"shape": "grid", "size": 0.4}, config)

    def parse(self, command: Any, config: GameConfig, name: str = "command") -> NDArray[np.float64]:
        """Return one formation as an array.

        Parameters
        ----------
        command : mapping or array_like
            `{"shape": "ring", "centre": (x, y), "size": s, "turn": t}`, or with `"points"`, (P, 2), in place of
            the shape, each number in [-1, 1]: (0, 0) is the centre, and 1 is `size` away from it. Only the shape or
            the points are required. Or an array as `parse_all` reads it.

        Raises
        ------
        CommandError
            If it is not a formation.
        """
        if isinstance(command, Mapping):
            return self._parse_mapping(command, config, name)
        long = self.space(config).shape[0]
        try:
            shape = np.shape(command)
        except ValueError:
            shape = ()
        if shape not in ((_NUMBERS,), (long,)):
            raise CommandError(
                f"{name} must be a formation: 5 numbers [shape, x, y, size, turn], {long} with drawn points, or a "
                f'mapping such as {{"shape": "ring", "centre": (0.5, 0.5), "size": 0.25, "turn": 0}}, got '
                f"{f'shape {shape}' if shape else describe(command)}"
            )
        space = self.learner_space(config) if shape == (_NUMBERS,) else self.space(config)
        values = check_values(command, shape, space.low, space.high, name)
        return np.asarray(_spell_out(values[None], long)[0])

    def parse_all(self, commands: ArrayLike, count: int, config: GameConfig, name: str) -> NDArray[np.float64]:
        """Parse arrays (n, 5), or (n, *shape) with drawn points."""
        try:
            is_short = np.shape(commands) == (count, _NUMBERS)
        except ValueError:
            is_short = False
        space = self.learner_space(config) if is_short else self.space(config)
        values = check_values(commands, (count, *space.shape), space.low, space.high, name)
        return _spell_out(values, self.space(config).shape[0])

    def _parse_mapping(self, mapping: Mapping[Any, Any], config: GameConfig, name: str) -> NDArray[np.float64]:
        known = {"shape", "points", *_USUAL}
        for key in mapping:
            if key not in known:
                raise CommandError(f"{name}: a formation has no {key!r}; {nearest(str(key), known)}")
        if ("shape" in mapping) == ("points" in mapping):
            raise CommandError(f"{name}: a formation has either a shape or points, got {sorted(mapping)}")
        fields: dict[str, Any] = {**_USUAL, **mapping}
        command = np.zeros(self.space(config).shape)
        command[1:3] = check_values(fields["centre"], (2,), 0.0, 1.0, f"{name}'s centre")
        command[3] = check_values(fields["size"], (), 0.0, _LARGEST, f"{name}'s size")
        command[4] = math.remainder(float(check_values(fields["turn"], (), -1e6, 1e6, f"{name}'s turn")), 2 * math.pi)
        if "shape" in mapping:
            shape = fields["shape"]
            if not isinstance(shape, str) or shape not in SHAPES:
                raise CommandError(f"{name}: there is no shape {shape!r}; {nearest(str(shape), SHAPES)}")
            command[0] = SHAPES.index(shape)
            return command
        points, room = mapping["points"], _room(config)
        count = len(points) if hasattr(points, "__len__") else 0
        if not 1 <= count <= room:
            raise CommandError(f"{name}'s points must be 1 to {room} pairs (x, y), got {describe(points)}")
        values = check_values(points, (count, 2), -1.0, 1.0, f"{name}'s points")
        command[0], command[_NUMBERS], command[_NUMBERS + 1 : _NUMBERS + 1 + 2 * count] = _DRAWN, count, values.ravel()
        return command

    def check_sizes(
        self, commands: NDArray[np.float64], sizes: NDArray[np.int64], config: GameConfig, name: str
    ) -> None:
        """Refuse drawn formations with fewer points than the team has drones."""
        counts = np.where(commands[:, 0] >= _DRAWN, np.floor(commands[:, _NUMBERS]), np.inf)
        for count, size in zip(counts.tolist(), sizes.tolist(), strict=True):
            if count < size:
                raise CommandError(
                    f"{name}: a drawn formation needs a point for each drone of the team, that is {size}, got "
                    f"{count:.0f} points: draw more of them, or choose a shape, which has as many slots as it needs"
                )

    def to_densities(self, commands: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64]:
        """Return densities of the slots of a team of the larger starting size."""
        drones = max(config.team_sizes)
        slots = np.stack([self.slots(command, drones) for command in commands])
        return density_at(slots, config.command_cells)

    def named(self, config: GameConfig) -> Mapping[str, NDArray[np.float64]]:
        """Return each shape at nine places: `ring_20_20` and so on."""
        return {
            f"{shape}_{x}_{y}": self.parse({"shape": shape, "centre": (x / 100, y / 100)}, config)
            for shape in SHAPES
            for x in _PERCENT
            for y in _PERCENT
        }

    # --- flight -------------------------------------------------------------------------------

    def slots(self, command: NDArray[np.float64], drones: int) -> NDArray[np.float64]:
        """Return the slots (drones, 2) of a formation, in map widths, inside the margin."""
        shape = min(int(command[0]), _DRAWN)
        if shape < _DRAWN:
            unit = unit_slots(SHAPES[shape], drones)
        else:
            points = max(int(command[_NUMBERS]), 1)
            turns = np.arange(drones)
            places = turns * points // drones if drones <= points else turns % points
            unit = command[_NUMBERS + 1 :].reshape(-1, 2)[places]
        size, turn = float(command[3]), float(command[4])
        along, across = size * math.cos(turn), size * math.sin(turn)
        slots = np.empty((drones, 2))
        slots[:, 0] = command[1] + (along * unit[:, 0] - across * unit[:, 1])
        slots[:, 1] = command[2] + (across * unit[:, 0] + along * unit[:, 1])
        return np.clip(slots, self.margin, 1.0 - self.margin, out=slots)

    def solve(self, flight: Flight, config: GameConfig) -> NDArray[np.float64]:
        """Pull every drone to its slot, u = stiffness (slot - p) / speed factor - damping v.

        Each drone assigns a slot to every drone that it hears, itself included, and flies to its own. Drones that hear
        the same drones share one assignment.
        """
        slots = np.zeros(flight.positions.shape)
        for game, members, drones in _crews(flight):
            places = flight.positions[game, members].astype(np.float64)
            offered = self.slots(flight.commands[game], len(members))
            x, y = (places[:, None, axis] - offered[None, :, axis] for axis in range(2))
            taken = np.empty(len(members), np.int64)
            assign(x * x + y * y, taken)
            slots[game, drones] = offered[taken[np.searchsorted(members, drones)]]
        pull = self.stiffness / float(config.dynamics.speed_factor) * (slots - flight.positions)
        return np.where(flight.own[:, :, None], pull - self.damping * flight.velocities.astype(np.float64), 0.0)


def _crews(flight: Flight) -> Iterator[tuple[int, NDArray[np.int64], NDArray[np.int64]]]:
    """Yield game, members and drones: the drones of a game that hear exactly the members."""
    for game, (own, heard) in enumerate(zip(flight.own, flight.heard, strict=True)):
        flown = np.flatnonzero(own)
        rows = heard[flown]
        if (rows == own).all():
            if len(flown):
                yield game, flown, flown
            continue
        hearers: dict[bytes, list[int]] = {}
        for drone, row in zip(flown.tolist(), rows, strict=True):
            hearers.setdefault(row.tobytes(), []).append(drone)
        for row, drones in hearers.items():
            yield game, np.flatnonzero(np.frombuffer(row, np.bool_)), np.array(drones)


def _room(config: GameConfig) -> int:
    """Return the number of drawn points that fit into a command."""
    return max(_FEW_POINTS, config.num_drones)


def _spell_out(commands: NDArray[np.float64], long: int) -> NDArray[np.float64]:
    """Return commands (n, 5 or long) as (n, long); five numbers draw no points."""
    if commands.shape[1] == long:
        return commands
    full = np.zeros((len(commands), long))
    full[:, :_NUMBERS] = commands
    np.minimum(full[:, 0], np.nextafter(_DRAWN, 0.0), out=full[:, 0])
    return full
