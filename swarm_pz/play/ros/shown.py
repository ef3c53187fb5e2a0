"""What subscribers are shown of the game that a rosbridge's clients play."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, GRID_CELLS, TEAM_NAMES, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.play.frames import Frame, Target
from swarm_pz.play.ros import messages
from swarm_pz.play.ros.connection import Client
from swarm_pz.play.ros.rosbridge import Rosbridge
from swarm_pz.simulator.ergodicity import reconstruct


class Shown:
    """What subscribers are shown of one game: each moment once, in the order of time."""

    def __init__(self, rosbridge: Rosbridge, game: GameConfig) -> None:
        self._rosbridge, self._game = rosbridge, game
        self._forget()

    def _forget(self) -> None:
        self._tick, self._past = -1, Past(self._game)
        self._teams: list[int] | None = None

    def show(self, frame: Frame) -> None:
        """Publish what a frame tells, as far as anybody wants it."""
        if frame.tick == self._tick:
            return
        if frame.tick < self._tick:  # another game has begun
            self._forget()
        self._tick, former, self._teams = frame.tick, self._teams, frame.teams.tolist()
        for drone, team in enumerate(self._teams):
            if former is None or former[drone] != team:
                self._rosbridge.publish("/agent_team_status", messages.team_status(drone, team))
        self._past.add(frame)
        plots = {f"/{name}_ck_plot": partial(self._plot, team) for team, name in enumerate(TEAM_NAMES)}
        for topic, make in (messages.makers_of(frame) | plots).items():
            if self._rosbridge.wanted(topic):
                self._rosbridge.publish(topic, make())

    def _plot(self, team: int) -> messages.Message:
        return messages.floats(self._past.picture(team))

    def show_target(self, target: Target, but: Client | None) -> None:
        """Publish a team's target to all but one."""
        topic = f"/{TEAM_NAMES[target.team]}_team_target_dist"
        if self._rosbridge.wanted(topic):
            self._rosbridge.publish(topic, messages.target(target.picture, max(self._tick, 0)), but)


class Past:
    """Where teams have been, as the controller remembers it: fading sums of the basis over their drones' places."""

    def __init__(self, game: GameConfig) -> None:
        tau, self._modes = game.memory.controller, game.controller.modes
        self._decay = np.exp(-CONTROL_PERIOD / tau) if tau is not None else 1.0
        self._sums, self._weights = np.zeros((2, self._modes, self._modes)), np.zeros(2)

    def add(self, frame: Frame) -> None:
        """Remember a moment; one in a control period."""
        if frame.tick % TICKS_PER_CONTROL_PERIOD:
            return
        k = np.pi * np.arange(self._modes)
        for team in range(2):
            places = np.asarray(frame.positions, np.float64)[frame.teams == team]
            basis = np.cos(k[:, None] * places[:, 0]) @ np.cos(k[:, None] * places[:, 1]).T
            self._sums[team] = self._decay * self._sums[team] + basis
            self._weights[team] = self._decay * self._weights[team] + len(places)

    def picture(self, team: int) -> NDArray[Any]:
        """Return the density that they make (G, G), by the modes that the controller compares."""
        return np.asarray(reconstruct(self._sums[team] / max(self._weights[team], 1e-12), GRID_CELLS))
