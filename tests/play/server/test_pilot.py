"""The thread in which control systems choose: for the right team, and not for ever."""

import asyncio
import threading

import pytest

from swarm_pz.config import TEAM_NAMES, GameConfig
from swarm_pz.errors import FlightError
from swarm_pz.play.game import LiveGame, TableConfig
from swarm_pz.play.server import pilot
from swarm_pz.play.server.pilot import Pilot
from tests.systems_of_tests import Magnet, install


def flying(team, monkeypatch, solve):
    """Let a magnet fly one team, the other being flown by the ergodic controller, for one control period."""
    install(monkeypatch, Magnet)
    monkeypatch.setattr(Magnet, "solve", solve)
    game = GameConfig(drones_per_team=2, controllers=("ergodic", "magnet") if team else ("magnet", "ergodic"))

    async def fly():
        own = Pilot(game)
        try:
            for one in range(2):
                await own.fly(LiveGame(TableConfig(game=game), 0), one)
        finally:
            own.close()

    asyncio.run(fly())


@pytest.mark.parametrize("team", [0, 1])
def test_each_team_whose_system_is_pythons_is_flown_in_the_pilots_thread(team, monkeypatch):
    solve, threads = Magnet.solve, []

    def noted(self, flight, config):
        threads.append(threading.current_thread().name)
        return solve(self, flight, config)

    flying(team, monkeypatch, noted)
    assert threads == ["pilot"]


@pytest.mark.parametrize("team", [0, 1])
def test_who_does_not_answer_is_named_with_its_team(team, monkeypatch):
    gate = threading.Event()
    monkeypatch.setattr(pilot, "SOLVE_S", 0.05)
    told = f"magnet, which flies {TEAM_NAMES[team]}, did not answer within 0.05 s"
    with pytest.raises(FlightError, match=told) as caught:
        flying(team, monkeypatch, lambda *_: gate.wait(30.0))
    gate.set()
    assert (caught.value.team, caught.value.system) == (team, "magnet")
