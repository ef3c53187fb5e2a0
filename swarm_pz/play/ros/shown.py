"""What subscribers are shown of the game that a rosbridge's clients play."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, GRID_CELLS, TEAM_NAMES, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.play.frames import Frame, Target
from swarm_pz.play.ros import messages
from swarm_pz.play.ros.connection import Client
from swarm_pz.play.ros.rosbridge import Message, Rosbridge
from swarm_pz.simulator.ergodicity import reconstruct

_Maker = Callable[[], Message]


class Shown:
    """What subscribers are shown of one game: each moment once, in the order of time.

    Parameters
    ----------
    rosbridge : Rosbridge
        Publishes it.
    game : GameConfig
        Of the table.
    """

    def __init__(self, rosbridge: Rosbridge, game: GameConfig) -> None:
        self._rosbridge, self._game = rosbridge, game
        self._tick = -1
        self._teams: NDArray[np.int8] | None = None
        self._past = Past(game)

    def show(self, frame: Frame) -> None:
        """Publish what a frame tells, as far as anybody wants it."""
        if frame.tick == self._tick:
            return
        if frame.tick < self._tick:
            self._teams, self._past = None, Past(self._game)
        self._tick = frame.tick
        self._tell_teams(frame)
        self._past.add(frame)
        for topic, make in self._makers(frame).items():
            if self._rosbridge.wanted(topic):
                self._rosbridge.publish(topic, make())

    def show_target(self, target: Target, but: Client | None) -> None:
        """Publish a team's target to all but one."""
        topic = f"/{TEAM_NAMES[target.team]}_team_target_dist"
        if self._rosbridge.wanted(topic):
            self._rosbridge.publish(topic, messages.target(target.picture, max(self._tick, 0)), but)

    def _makers(self, frame: Frame) -> dict[str, _Maker]:
        make = functools.partial
        makers: dict[str, _Maker] = {
            "/clock": make(messages.clock, frame.tick),
            "/tf": make(messages.transforms, frame),
            "/agent/visual": make(messages.markers, frame),
            "/swarm/sizes": make(messages.sizes, frame),
        }
        for team, name in enumerate(TEAM_NAMES):
            makers[f"/swarm/{name}/poses"] = make(messages.poses, frame, team)
            makers[f"/{name}_ck_plot"] = make(self._picture, team)
            if frame.fields is not None:
                makers[f"/swarm/{name}/capture_field"] = make(messages.capture_field, frame.fields[team], frame.tick)
        return makers

    def _picture(self, team: int) -> Message:
        return messages.floats(self._past.picture(team))

    def _tell_teams(self, frame: Frame) -> None:
        former, self._teams = self._teams, frame.teams
        for drone, team in enumerate(frame.teams.tolist()):
            if former is None or former[drone] != team:
                self._rosbridge.publish("/agent_team_status", messages.text(f"agent{drone} {TEAM_NAMES[team]}"))


class Past:
    """Where teams have been, as the controller remembers it: fading sums of the basis over their drones' places.

    Parameters
    ----------
    game : GameConfig
    """

    def __init__(self, game: GameConfig) -> None:
        tau, self._modes = game.memory.controller, game.controller.modes
        self._decay = np.exp(-CONTROL_PERIOD / tau) if tau is not None else 1.0
        self._sums = np.zeros((2, self._modes, self._modes))
        self._weights = np.zeros(2)

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
