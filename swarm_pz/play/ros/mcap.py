"""A recorded game as an MCAP file of standard ROS 2 messages, for the tools that laboratories have."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import OutputError, require_extra
from swarm_pz.files import check_file, draft_of, explain
from swarm_pz.play.protocol import CapturedMessage
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.ros import messages
from swarm_pz.play.ros.definitions import definition, full_name
from swarm_pz.play.server.views import capture_fields

Told = tuple[int, str, messages.Message]
"""Tick, topic and message."""


def told(recording: Recording) -> Iterator[Told]:
    """Yield what a recorded game told, in the order of its ticks.

    Drones are those of the recorded frames; targets and capture fields are simulated again from the commands, which
    on another kind of processor may lead elsewhere after some seconds.
    """
    playback, captured, is_first = Playback(recording), recording.of(CapturedMessage), True
    for frame in recording.frames():
        if is_first:
            for drone, team in enumerate(frame.teams.tolist()):
                yield frame.tick, "/agent_team_status", messages.team_status(drone, team)
        is_first = False
        while captured and captured[0].tick <= frame.tick:
            line = captured.pop(0)
            yield line.tick, "/agent_team_status", messages.team_status(line.drone, line.team)
        playback.seek(frame.tick)
        simulator = playback.game.simulator
        whole = replace(frame, fields=capture_fields(simulator), altitudes=simulator.altitudes[0])
        for topic, make in messages.makers_of(whole).items():
            yield frame.tick, topic, make()
        for team, name in enumerate(TEAM_NAMES):
            target = messages.target(simulator.targets[0, team], frame.tick)
            yield frame.tick, f"/{name}_team_target_dist", target


def write(recording: Recording, path: Path, progress: Callable[[float, float], None] | None = None) -> int:
    """Write a recorded game as MCAP, replacing `path` when all is written; return the number of messages.

    `progress` is called with the seconds of game written so far, and all of them. Raises MissingExtraError,
    and OutputError if the file cannot be written.
    """
    writer_of = require_extra("mcap_ros2.writer", "lab").Writer
    if path.suffix != ".mcap":
        raise OutputError(f"an MCAP file's name ends with .mcap, got {path}")
    check_file(path)
    schemas, count = {}, 0
    try:
        with draft_of(path) as draft, draft.open("wb") as file:
            writer = writer_of(file)
            writer.add_metadata(
                "swarm-pz",
                {
                    "recording": recording.name,
                    "red": recording.header.red.policy or recording.header.red.kind,
                    "blue": recording.header.blue.policy or recording.header.blue.kind,
                    "rules_hash": recording.config.game.rules_hash,
                },
            )
            for tick, topic, message in told(recording):
                kind = messages.TOPICS[topic]
                if kind not in schemas:
                    schemas[kind] = writer.register_msgdef(full_name(kind), definition(kind))
                time = messages.nanoseconds_of(tick)
                writer.write_message(topic, schemas[kind], message, log_time=time, sequence=count)
                count += 1
                if progress is not None and topic == "/clock":
                    progress(tick / TICKS_PER_SECOND, recording.last_tick / TICKS_PER_SECOND)
            writer.finish()
    except OSError as error:
        raise OutputError(f"cannot write {str(path)!r}: {explain(error)}") from error
    return count
