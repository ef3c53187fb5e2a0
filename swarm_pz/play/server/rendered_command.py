"""Commands rendered from what clients send; a thread renders drawings, so that no game waits."""

from __future__ import annotations

from typing import NamedTuple

from swarm_pz.config.registry import is_our_own
from swarm_pz.errors import CommandError
from swarm_pz.play import protocol
from swarm_pz.play.commands import Command, CommandReader
from swarm_pz.play.server.views import target_message
from swarm_pz.play.server.worker import HangingError, Worker
from swarm_pz.play.strokes import Mapping, Stroke, attraction_of, density_of
from swarm_pz.simulator.commands import make_target

RENDER_S = 5.0
"""Seconds that a command for another package's control system may take."""
CommandSource = protocol.CommandMessage | protocol.Response


class RenderedCommand(NamedTuple):
    """A command, and its target as its side sees it."""

    command: Command
    target: bytes


def is_rendered_at_once(source: CommandSource, reader: CommandReader, team: int) -> bool:
    """Return true if a command is rendered so fast that a game may wait for it."""
    return source.density is not None and reader.systems[team].takes == "density"


def render(
    source: CommandSource, reader: CommandReader, mapping: Mapping, team: int, number: int = 0, sender: str = ""
) -> RenderedCommand:
    """Render a command for a team; any thread may do it.

    Raises CommandError if it cannot be drawn or read, or cannot fly the team.
    """
    system = reader.systems[team]
    if source.strokes is not None:
        strokes = [Stroke(brush=s.brush, width=s.width, points=tuple(s.points)) for s in source.strokes]
        is_images = system.takes == "attraction"
        drawn = (attraction_of if is_images else density_of)(strokes, reader.cells, mapping)
        command = reader.read(team, number, drawn, "attraction" if is_images else "density", sender)
    elif source.density is not None:
        command = reader.read(team, number, source.density, "density", sender)
    else:
        command = reader.read(team, number, source.command, system.takes, sender)
    return RenderedCommand(command, target_of(command, reader))


def target_of(command: Command, reader: CommandReader) -> bytes:
    """Return the message that shows a command to its side."""
    _, coefficients = make_target(reader.picture(command), reader.modes)
    return target_message(command.team, command.number, coefficients)


class CommandWorker:
    """Renders commands one at a time, since each takes a core.

    If a control system of another package hangs, no other command is rendered for it until it comes back. swarm-pz's
    own systems have no limit: a machine may be busy, or have to compile something.
    """

    def __init__(self) -> None:
        self._worker = Worker("commands")

    async def render(
        self, source: CommandSource, reader: CommandReader, mapping: Mapping, team: int, number: int, sender: str = ""
    ) -> RenderedCommand:
        """Return a rendered command; errors as of `render`, and CommandError if it takes too long."""
        system = reader.systems[team].name
        limit_s = None if is_our_own(system) else RENDER_S
        given = source, reader, mapping, team, number, sender
        try:
            return await self._worker.do(render, *given, limit_s=limit_s, client=system)
        except HangingError as error:
            reason = f"{system} still reads another command: it takes no more until it is done"
            raise CommandError(reason) from error
        except TimeoutError as error:
            raise CommandError(f"{system} did not read that command within {RENDER_S:g} s") from error

    def close(self) -> None:
        """Let the thread end."""
        self._worker.close()
