"""What ROS programs publish to command a swarm, as the commands that its seat takes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import ProtocolError
from swarm_pz.play.protocol import CommandMessage, Commands

Message = dict[str, Any]
Maker = Callable[[Commands, int], CommandMessage]
"""From what a seat takes, and the cells a side of its densities, to a command; raises ProtocolError."""

TABLET = "/tablet_comm"
CLEAR = "/clear_locs"
ATTRACTOR = "/flocking_command"
INPUTS: dict[str, str] = {
    **{f"/{team}_connection_service": "std_msgs/Empty" for team in TEAM_NAMES},
    TABLET: "ergodic_humanswarmcollab_sim/tablet",
    CLEAR: "std_msgs/Empty",
    **{f"/swarm/{team}/density": "std_msgs/Float32MultiArray" for team in TEAM_NAMES},
    **{f"/swarm/{team}/target": "nav_msgs/OccupancyGrid" for team in TEAM_NAMES},
    **{f"/swarm/{team}/attractors": "geometry_msgs/PoseArray" for team in TEAM_NAMES},
    **{f"/swarm/{team}/accelerations": "std_msgs/Float32MultiArray" for team in TEAM_NAMES},
    **{f"/swarm/{team}/command": "std_msgs/Float32MultiArray" for team in TEAM_NAMES},
}
"""What a table listens to, and the types; and `ATTRACTOR`, of any type with x, y and a weight."""
_TOPICS_OF = {"density": "density", "attractors": "attractors", "accelerations": "accelerations"}
"""For which kinds of commands there is a topic; the others come on `command`."""


def density(message: Message) -> Maker:
    """Read an image: Float32MultiArray, the tablet's message, or anything else with `data`."""
    return _density_of(_floats(message))


def occupancy(message: Message) -> Maker:
    """Read an OccupancyGrid; -1 is unknown, and as 0."""
    return _density_of(np.maximum(_floats(message), 0.0))


def _density_of(values: NDArray[np.float64]) -> Maker:
    def make(takes: Commands, cells: int) -> CommandMessage:
        if not takes.serves_densities:
            raise _mismatch("a density", takes)
        return CommandMessage(0, density=coarse(values, cells).tolist())

    return make


def attractors(message: Message) -> Maker:
    """Read a PoseArray: a place each, one after the other in time; z is its weight, and 0 the largest that there is."""
    poses = message.get("poses")
    if not isinstance(poses, list) or not poses:
        raise ProtocolError("poses must be a list of one pose or more")
    return _attractors_of([_row(_part(pose, "position"), "z") for pose in poses])


def attractor(message: Message) -> Maker:
    """Read one place, x and y, and its `migration_weight` or `weight`; without one it is the largest that there is."""
    name = next((name for name in ("migration_weight", "weight", "z") if name in message), "weight")
    return _attractors_of([_row(message, name)])


def _attractors_of(rows: list[list[float]]) -> Maker:
    def make(takes: Commands, _: int) -> CommandMessage:
        if takes.takes != "attractors" or takes.weights is None:
            raise _mismatch("an attractor", takes)
        largest = takes.weights[1]
        return CommandMessage(0, command=[[x, y, weight or largest] for x, y, weight in rows])

    return make


def accelerations(message: Message) -> Maker:
    """Read accelerations: x and y for each drone of the game, by its number."""
    values = _floats(message)

    def make(takes: Commands, _: int) -> CommandMessage:
        if takes.takes != "accelerations":
            raise _mismatch("accelerations", takes)
        return _shaped(values, takes)

    return make


def any_kind(message: Message) -> Maker:
    """Read a command of whatever kind the seat takes, as the numbers of its array form."""
    values = _floats(message)
    return lambda takes, cells: (
        _density_of(values)(takes, cells) if takes.takes == "density" else _shaped(values, takes)
    )


def clear(takes: Commands, cells: int) -> CommandMessage:
    """Make what is in force at the start: everywhere alike, of densities."""
    if takes.serves_densities:
        return CommandMessage(0, density=np.ones((cells, cells)).tolist())
    return CommandMessage(0, command=takes.default)


def coarse(values: NDArray[np.float64], cells: int) -> NDArray[np.float64]:
    """Return an image as a density (cells, cells) with 1 as its largest value: each cell's mean.

    Raises
    ------
    ProtocolError
        If it is no square of as many values as cells a side, or a multiple of these, or a value is none.
    """
    side = math.isqrt(len(values))
    if not side or side * side != len(values) or side % cells:
        raise ProtocolError(
            f"data must be a square image, row after row from the bottom, of {cells} cells a side or a multiple of it, "
            f"got {len(values)} values"
        )
    if not np.isfinite(values).all() or (values < 0.0).any():
        raise ProtocolError("data must be finite numbers, none below 0")
    largest = values.max()
    if largest == 0.0:
        return np.ones((cells, cells))
    part = side // cells
    means = (values / largest).reshape(cells, part, cells, part).mean(axis=(1, 3))
    return np.asarray(means / means.max())


def _shaped(values: NDArray[np.float64], takes: Commands) -> CommandMessage:
    shape = tuple(takes.shape)
    if len(values) != math.prod(shape):
        raise ProtocolError(
            f"data must be the numbers of a command of {takes.system}, {' x '.join(map(str, shape))}, "
            f"got {len(values)} values"
        )
    if not np.isfinite(values).all():
        raise ProtocolError("data must be finite numbers")
    return CommandMessage(0, command=values.reshape(shape).tolist())


def _mismatch(given: str, takes: Commands) -> ProtocolError:
    served = " or densities" if takes.serves_densities and takes.takes != "density" else ""
    topic = _TOPICS_OF.get(takes.takes, "command")
    return ProtocolError(
        f"{given} cannot fly this team: {takes.system} takes {takes.takes}{served}; publish on /swarm/TEAM/{topic}"
    )


def _floats(message: Message) -> NDArray[np.float64]:
    """Return the numbers of a message's `data`."""
    data = message.get("data")
    if not isinstance(data, list):
        raise ProtocolError(f"data must be a list of numbers, got {type(data).__name__}")
    if any(type(value) not in (int, float) for value in data):
        raise ProtocolError("data must be a list of numbers")
    try:
        return np.array(data, np.float64)
    except OverflowError as error:
        raise ProtocolError("data must be a list of numbers, got one that is too large") from error


def _part(message: object, name: str) -> Message:
    part = message.get(name) if isinstance(message, dict) else None
    if not isinstance(part, dict):
        raise ProtocolError(f"{name} must be an object")
    return part


def _row(message: Message, weight: str) -> list[float]:
    found = [message.get("x"), message.get("y"), message.get(weight, 0.0)]
    row = [float(value) for value in found if type(value) in (int, float) and abs(value) < 1e9]
    if len(row) != 3 or not all(map(math.isfinite, row)):
        raise ProtocolError(f"x, y and {weight} must be numbers")
    return row
