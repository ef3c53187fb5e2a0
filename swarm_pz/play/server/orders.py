"""From what a client asks for to a command that can be followed; any thread may do it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from swarm_pz.errors import CommandError
from swarm_pz.play import protocol
from swarm_pz.play.commands import Command, CommandReader
from swarm_pz.play.server.views import target_message
from swarm_pz.play.strokes import Mapping, Stroke, attraction_of, density_of
from swarm_pz.simulator.commands import make_target


class Order(Protocol):
    """A message, or a part of one, that holds a command in one of its forms."""

    @property
    def strokes(self) -> list[protocol.StrokeMessage] | None:
        """A drawing."""

    @property
    def density(self) -> list[list[float]] | None:
        """A density."""

    @property
    def command(self) -> protocol.Form | None:
        """What the control system takes."""


class Made(NamedTuple):
    """A command, and what its side is shown of it."""

    command: Command
    target: bytes


def is_made_at_once(order: Order, reader: CommandReader, team: int) -> bool:
    """Whether a command is made within the moment that a game may wait for it."""
    return order.density is not None and reader.systems[team].takes == "density"


def make(order: Order, reader: CommandReader, mapping: Mapping, team: int, number: int = 0, sender: str = "") -> Made:
    """Make a command.

    Parameters
    ----------
    order : Order
        Holds exactly one of its forms.
    reader : CommandReader
        Of the game that it is for.
    mapping : str
        From strokes to a density.
    team, number : int
    sender : str

    Raises
    ------
    CommandError
        If it cannot be drawn or read, or cannot fly the team.
    """
    system = reader.systems[team]
    if order.strokes is not None:
        strokes = [Stroke(brush=s.brush, width=s.width, points=tuple(s.points)) for s in order.strokes]
        is_images = system.takes == "attraction"
        drawn = (attraction_of if is_images else density_of)(strokes, reader.cells, mapping)
        command = reader.read(team, number, drawn, "attraction" if is_images else "density", sender)
    elif order.density is not None:
        command = reader.read(team, number, order.density, "density", sender)
    elif order.command is not None:
        command = reader.read(team, number, order.command, system.takes, sender)
    else:
        raise CommandError("a command must hold strokes, a density, or what the seat's control system takes")
    return Made(command, target_of(command, reader))


def target_of(command: Command, reader: CommandReader) -> bytes:
    """Return a command as its side is shown it."""
    _, coefficients = make_target(reader.picture(command), reader.modes)
    return target_message(command.team, command.number, coefficients)
