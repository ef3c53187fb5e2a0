"""Commands rendered from what clients send."""

from __future__ import annotations

from typing import NamedTuple

from swarm_pz.play import protocol
from swarm_pz.play.commands import Command, CommandReader
from swarm_pz.play.server.views import target_message
from swarm_pz.play.strokes import Mapping, Stroke, attraction_of, density_of
from swarm_pz.simulator.commands import make_target


class RenderedCommand(NamedTuple):
    """A command, and the message that shows its target."""

    command: Command
    target: bytes


def is_rendered_at_once(source: protocol.CommandMessage, reader: CommandReader, team: int) -> bool:
    """Return true if rendering a command is so fast that a game may wait for it."""
    return source.density is not None and reader.systems[team].takes == "density"


def render(source: protocol.CommandMessage, reader: CommandReader, mapping: Mapping, team: int) -> RenderedCommand:
    """Render a command for a team; any thread may do it.

    Raises CommandError if it cannot be drawn or read, or cannot fly the team.
    """
    system, number = reader.systems[team], source.number
    if source.strokes is not None:
        strokes = [Stroke(brush=s.brush, width=s.width, points=tuple(s.points)) for s in source.strokes]
        is_images = system.takes == "attraction"
        drawn = (attraction_of if is_images else density_of)(strokes, reader.cells, mapping)
        command = reader.read(team, number, drawn, "attraction" if is_images else "density")
    elif source.density is not None:
        command = reader.read(team, number, source.density, "density")
    else:
        command = reader.read(team, number, source.command, system.takes)
    return RenderedCommand(command, target_of(command, reader))


def target_of(command: Command, reader: CommandReader) -> bytes:
    """Return the message that shows a command to its side."""
    _, coefficients = make_target(reader.picture(command), reader.modes)
    return target_message(command.team, command.number, coefficients)
