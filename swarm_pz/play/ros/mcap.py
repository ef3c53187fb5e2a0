"""A recorded game as an MCAP file of standard ROS 2 messages, for robotics tools."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from mcap.writer import Writer

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import OutputError
from swarm_pz.files import draft_of
from swarm_pz.play.protocol import CapturedMessage
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.ros import messages
from swarm_pz.play.ros.definitions import definition, full_name, serialise
from swarm_pz.play.server.views import capture_fields


def messages_of(recording: Recording) -> Iterator[tuple[int, str, messages.Message]]:
    """Yield the ticks, topics and messages of a recorded game, in the order of its ticks.

    Drones are those of the recorded frames. Targets and capture fields are simulated again from the commands, so on
    another kind of processor they may differ after some seconds.
    """
    playback, captured = Playback(recording), recording.of(CapturedMessage)
    for number, frame in enumerate(recording.frames()):
        for drone, team in enumerate(frame.teams.tolist() if number == 0 else ()):
            yield frame.tick, "/agent_team_status", messages.team_status(drone, team)
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

    `progress` is called with the seconds of game written so far, and all of them. Raises OutputError if the file cannot
    be written.
    """
    if path.suffix != ".mcap":
        raise OutputError(f"an MCAP file's name ends with .mcap, got {path}")
    types, count = {topic: kind for topic, kind in messages.TOPICS.items() if topic != messages.LOG}, 0
    with draft_of(path) as draft, draft.open("wb") as file:
        writer: Any = Writer(file)
        writer.start(profile="ros2")
        writer.add_metadata(
            "swarm-pz",
            {
                "recording": recording.name,
                "red": recording.header.red.policy or recording.header.red.kind,
                "blue": recording.header.blue.policy or recording.header.blue.kind,
                "rules_hash": recording.config.game.rules_hash,
            },
        )
        schemas = {
            kind: writer.register_schema(full_name(kind), "ros2msg", definition(kind).encode())
            for kind in dict.fromkeys(types.values())
        }
        channels = {topic: writer.register_channel(topic, "cdr", schemas[kind]) for topic, kind in types.items()}
        for tick, topic, message in messages_of(recording):
            time, data = messages.nanoseconds_of(tick), serialise(types[topic], message)
            writer.add_message(channels[topic], time, data, publish_time=time, sequence=count)
            count += 1
            if progress is not None and topic == "/clock":
                progress(tick / TICKS_PER_SECOND, recording.last_tick / TICKS_PER_SECOND)
        writer.finish()
    return count
