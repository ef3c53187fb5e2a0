"""A recorded game as an MCAP file of standard ROS 2 messages, for the tools that laboratories have."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import OutputError, require_extra
from swarm_pz.files import check_file, draft_of, explain
from swarm_pz.play.frames import Frame
from swarm_pz.play.recordings.format import CapturedLine, Recording
from swarm_pz.play.recordings.playback import Playback
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
    playback = Playback(recording)
    captured = iter([*recording.of(CapturedLine), None])
    next_capture = next(captured)
    is_first = True
    for frame in recording.frames():
        if is_first:
            for drone, team in enumerate(frame.teams.tolist()):
                yield frame.tick, "/agent_team_status", messages.text(f"agent{drone} {TEAM_NAMES[team]}")
            is_first = False
        while next_capture is not None and next_capture.tick <= frame.tick:
            told_of = f"agent{next_capture.drone} {TEAM_NAMES[next_capture.team]}"
            yield next_capture.tick, "/agent_team_status", messages.text(told_of)
            next_capture = next(captured)
        yield from _of_frame(frame)
        playback.seek(frame.tick)
        yield from _of_simulation(playback, frame.tick)


def _of_frame(frame: Frame) -> Iterator[Told]:
    yield frame.tick, "/clock", messages.clock(frame.tick)
    yield frame.tick, "/tf", messages.transforms(frame)
    yield frame.tick, "/agent/visual", messages.markers(frame)
    yield frame.tick, "/swarm/sizes", messages.sizes(frame)
    for team, name in enumerate(TEAM_NAMES):
        yield frame.tick, f"/swarm/{name}/poses", messages.poses(frame, team)


def _of_simulation(playback: Playback, tick: int) -> Iterator[Told]:
    simulator = playback.game.simulator
    fields = capture_fields(simulator)
    for team, name in enumerate(TEAM_NAMES):
        yield tick, f"/swarm/{name}/capture_field", messages.capture_field(fields[team], tick)
        yield tick, f"/{name}_team_target_dist", messages.target(simulator.targets[0, team], tick)


def write(recording: Path, path: Path, progress: Callable[[float, float], None] | None = None) -> int:
    """Write a recorded game as MCAP and return the number of messages.

    Parameters
    ----------
    recording : Path
    path : Path
        Where to; replaced when all is written.
    progress : callable, optional
        Called with the seconds of game written so far, and all of them.

    Raises
    ------
    MissingExtraError
        If the extra `lab` is not installed.
    RecordingError
        If it is no recorded game.
    OutputError
        If the file cannot be written.
    """
    writer_of = require_extra("mcap_ros2.writer", "lab").Writer
    if path.suffix != ".mcap":
        raise OutputError(f"an MCAP file's name ends with .mcap, got {path}")
    check_file(path)
    read = Recording.read(recording)
    try:
        with draft_of(path) as draft, draft.open("wb") as file:
            return _write(read, writer_of(file), progress)
    except OSError as error:
        raise OutputError(f"cannot write {str(path)!r}: {explain(error)}") from error


def _write(recording: Recording, writer: Any, progress: Callable[[float, float], None] | None) -> int:
    schemas: dict[str, Any] = {}
    header, count, last = recording.header, 0, recording.last_tick / TICKS_PER_SECOND
    writer.add_metadata(
        "swarm-pz",
        {
            "recording": recording.name,
            "red": header.red.policy or header.red.kind,
            "blue": header.blue.policy or header.blue.kind,
            "rules_hash": recording.config.game.rules_hash,
        },
    )
    for tick, topic, message in told(recording):
        kind = messages.TOPICS[topic]
        if kind not in schemas:
            schemas[kind] = writer.register_msgdef(full_name(kind), definition(kind))
        nanoseconds = tick * 1_000_000_000 // TICKS_PER_SECOND
        writer.write_message(topic, schemas[kind], message, log_time=nanoseconds, sequence=count)
        count += 1
        if progress is not None and topic == "/clock":
            progress(tick / TICKS_PER_SECOND, last)
    writer.finish()
    return count
