"""Conversion of ROS programs' messages into commands of a seat."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec
import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import ProtocolError
from swarm_pz.play.protocol import CommandMessage, Commands
from swarm_pz.play.ros.messages import Message

Maker = Callable[[Commands, int], CommandMessage]
"""Makes a command from what a seat takes and the cells a side of its densities; raises ProtocolError."""

TABLET = "/tablet_comm"
CLEAR = "/clear_locs"
ATTRACTOR = "/flocking_command"


def density(message: Message, is_weak: bool = False) -> Maker:
    """Read an image: Float32MultiArray, the tablet's message, or anything else with `data`; see `coarse`."""
    values, label = _floats(message), "a density"
    return _maker(label, "density", lambda _, cells: CommandMessage(0, density=coarse(values, cells, is_weak).tolist()))


def attractors(message: Message) -> Maker:
    """Read a PoseArray of attractors, in their order in time; z is the weight, where 0 means the largest one."""
    poses = message.get("poses")
    if not isinstance(poses, list) or not poses:
        raise ProtocolError("poses must be a list of one pose or more")
    places = [pose.get("position") if isinstance(pose, dict) else None for pose in poses]
    return _attractors_of([_row(place, "z") for place in places])


def attractor(message: Message) -> Maker:
    """Read one place, x and y, and its `migration_weight` or `weight`; 0, the default, means the largest."""
    return _attractors_of([_row(message, "migration_weight" if "migration_weight" in message else "weight")])


def _attractors_of(rows: list[list[float]]) -> Maker:
    def make(takes: Commands, _: int) -> CommandMessage:
        largest = float(np.broadcast_to(takes.high, takes.shape)[0, 2])
        return CommandMessage(0, command=[[x, y, weight or largest] for x, y, weight in rows])

    return _maker("an attractor", "attractors", make)


def any_kind(message: Message) -> Maker:
    """Read a command of the seat's kind, whatever it is, from the numbers of its array form."""
    values, image = _floats(message), density(message)
    return lambda takes, cells: image(takes, cells) if takes.takes == "density" else _shaped(values, takes)


def _maker(label: str, kind: str, make: Maker) -> Maker:
    """Return a maker of commands for seats that take this kind; for others it raises ProtocolError."""

    def checked(takes: Commands, cells: int) -> CommandMessage:
        if takes.serves_densities if kind == "density" else takes.takes == kind:
            return make(takes, cells)
        served = " or densities" if takes.serves_densities and takes.takes != "density" else ""
        topic = takes.takes if takes.takes in READERS else "command"
        raise ProtocolError(
            f"{label} cannot fly this team: {takes.system} takes {takes.takes}{served}; publish on /swarm/TEAM/{topic}"
        )

    return checked


def clear(takes: Commands, cells: int) -> CommandMessage:
    """Make the command that is in force at the start; for seats that take densities, the uniform one."""
    if takes.serves_densities:
        return CommandMessage(0, density=np.ones((cells, cells)).tolist())
    return CommandMessage(0, command=takes.default)


def coarse(values: NDArray[np.float64], cells: int, is_weak: bool = False) -> NDArray[np.float64]:
    """Return an image as a density (cells, cells): the mean of each cell, scaled to a maximum of 1.

    The contrast of a weak image is raised, so that drones follow it.

    Values are finite, as JSON has no others. Raises ProtocolError unless the image is a square, its side is a multiple
    of `cells`, and no value is negative.
    """
    side = math.isqrt(len(values))
    if not side or side * side != len(values) or side % cells:
        raise ProtocolError(
            f"data must be a square image, row after row from the bottom, of {cells} cells a side or a multiple of it, "
            f"got {len(values)} values"
        )
    if (values < 0.0).any():
        raise ProtocolError("data must be numbers, none below 0")
    largest = values.max()
    if largest == 0.0:
        return np.ones((cells, cells))
    part = side // cells
    means = (values / largest).reshape(cells, part, cells, part).mean(axis=(1, 3))
    above = means - means.min()
    if is_weak and above.max() > 1e-6:  # more than rounding
        means = (above / above.max()) ** 4
    return np.asarray(means / means.max())


def _shaped(values: NDArray[np.float64], takes: Commands) -> CommandMessage:
    shape = tuple(takes.shape)
    if len(values) != math.prod(shape):
        expected = f"the numbers of a command of {takes.system}, {' x '.join(map(str, shape))}"
        raise ProtocolError(f"data must be {expected}, got {len(values)} values")
    return CommandMessage(0, command=values.reshape(shape).tolist())


def _floats(message: Message) -> NDArray[np.float64]:
    """Return the numbers of a message's `data`."""
    try:
        return np.array(msgspec.convert(message.get("data"), list[float]), np.float64)
    except msgspec.ValidationError as error:
        raise ProtocolError(f"data must be a list of numbers: {error}") from error


def _row(place: object, weight: str) -> list[float]:
    numbers = place if isinstance(place, dict) else {}
    values = [numbers.get("x"), numbers.get("y"), numbers.get(weight, 0.0)]
    row = [float(value) for value in values if type(value) in (int, float) and abs(value) < 1e9]
    if len(row) != 3:  # NaN fails the comparison
        raise ProtocolError(f"x, y and {weight} must be numbers")
    return row


READERS: dict[str, tuple[str, Callable[[Message], Maker]]] = {
    "density": ("std_msgs/Float32MultiArray", density),
    "attractors": ("geometry_msgs/PoseArray", attractors),
    "command": ("std_msgs/Float32MultiArray", any_kind),
}
"""Type and reader of messages on /swarm/red/... and /swarm/blue/..., by the topic's last part."""
INPUTS: dict[str, str] = {
    **{f"/{team}_connection_service": "std_msgs/Empty" for team in TEAM_NAMES},
    TABLET: "ergodic_humanswarmcollab_sim/tablet",
    CLEAR: "std_msgs/Empty",
    **{f"/swarm/{team}/{name}": kind for name, (kind, _) in READERS.items() for team in TEAM_NAMES},
}
"""Topics that a server listens to, with their types; `ATTRACTOR` takes any type with x, y and a weight."""
