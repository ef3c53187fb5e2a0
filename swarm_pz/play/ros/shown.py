"""Messages to subscribers about the game that a rosbridge's clients play."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import TEAM_NAMES
from swarm_pz.play.frames import Frame, Target
from swarm_pz.play.ros import messages
from swarm_pz.play.ros.connection import Client
from swarm_pz.play.ros.rosbridge import Rosbridge


class Shown:
    """Publishes one game: each moment once, in the order of time."""

    def __init__(self, rosbridge: Rosbridge) -> None:
        self._rosbridge, self._tick = rosbridge, -1
        self._teams: list[int] | None = None
        self._altitudes: NDArray[np.floating[Any]] | None = None
        """Of the last keyframe: other frames leave them out, and they never change within a game."""

    def show(self, frame: Frame) -> None:
        """Publish a frame on every topic that has subscribers."""
        if frame.altitudes is not None:
            self._altitudes = frame.altitudes
        if frame.tick == self._tick:
            return
        if frame.tick < self._tick:  # another game has begun
            self._teams = None
            self._altitudes = frame.altitudes
        if self._altitudes is not None and len(self._altitudes) == len(frame.teams):
            frame = replace(frame, altitudes=self._altitudes)
        self._tick, former, self._teams = frame.tick, self._teams, frame.teams.tolist()
        for drone, team in enumerate(self._teams):
            if former is None or former[drone] != team:
                self._rosbridge.publish("/agent_team_status", messages.team_status(drone, team))
        for topic, make in messages.makers_of(frame).items():
            if self._rosbridge.wanted(topic):
                self._rosbridge.publish(topic, make())

    def show_target(self, target: Target, but: Client | None) -> None:
        """Publish a team's target to all but one."""
        topic = f"/{TEAM_NAMES[target.team]}_team_target_dist"
        if self._rosbridge.wanted(topic):
            self._rosbridge.publish(topic, messages.target(target.picture, max(self._tick, 0)), but)
