"""If a control system fails during games, its side forfeits them, and the other games go on."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from swarm_pz import parallel_env
from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.evaluation import play_match
from swarm_pz.evaluation.rollout import play_games
from tests.systems_of_tests import Magnet, install


@dataclass(frozen=True, kw_only=True)
class Brittle(Magnet):
    """Fails once all drones that it flies in a game are right of x = 0.55."""

    name: ClassVar[str] = "brittle"
    fault: str = "raises"

    def default(self, config):
        return np.array([0.1, 0.5])

    def from_densities(self, densities, config):
        return np.broadcast_to([0.4, 0.5], (len(densities), 2)).copy()

    def to_densities(self, commands, config):
        return np.ones((len(commands), 10, 10))

    def solve(self, flight, config):
        right = super().solve(flight, config)
        fails = np.nanmin(flight.positions[:, :, 0], axis=1) > 0.55
        if fails.any():
            if self.fault == "raises":
                raise ZeroDivisionError("fell over")
            right[fails] = np.nan
        return right


CONFIG = GameConfig(drones_per_team=2, time_limit=3.0, command_period=0.5)


@pytest.fixture(autouse=True)
def systems(monkeypatch):
    install(monkeypatch, Brittle)


def flown(fault="raises", places=(0,)):
    """Return rules in which a failing system flies for the policy (0), its opponent (1) or both."""
    return CONFIG.replace(controllers=tuple(Brittle(fault=fault) if n in places else "ergodic" for n in range(2)))


@pytest.mark.parametrize("fault", ["raises", "nan"])
def test_in_a_match_its_side_loses_and_the_other_games_are_those_of_a_match_without_faults(fault):
    finished = []
    played = play_match("ring", "uniform", games=6, config=flown(fault), progress=lambda *done: finished.append(done))
    failed = {(game.pair, game.side) for game in played.forfeits}
    assert 0 < len(failed) < 6, "teams begin in any corner, and fail at the right"
    for number, game in enumerate(played.games):
        if game.forfeit:
            assert (game.outcome, game.share, game.seconds) == ("loss", 0.0, 0.0) and "brittle" in game.forfeit
        else:
            assert play_games("ring", "uniform", [number], seed=0, config=flown(fault)) == [game]
    assert len({game.fingerprint for game in played.forfeits}) == len(failed)
    assert finished[-1] == (6, 6) and max(finished) == (6, 6)
    mirrored = play_match("uniform", "ring", games=6, config=flown(fault, (1,)))
    assert {(game.pair, game.side) for game in mirrored.forfeits} == failed, "players who change places take it along"
    assert all((game.outcome, game.share) == ("win", 1.0) for game in mirrored.forfeits)


SERVED = {"raises": lambda: 1 / 0, "nan": lambda: [[np.nan, 0.5]]}
"""Faults of `from_densities`."""


@pytest.mark.parametrize(("fault", "place"), [("raises", 0), ("nan", 1)])
def test_a_system_that_cannot_serve_a_density_later_on_forfeits(fault, place, monkeypatch):
    even = lambda *given: [[0.4, 0.5]] * len(given[1]) if given[1].min() == 1 else SERVED[fault]()  # noqa: E731
    monkeypatch.setattr(Brittle, "from_densities", even)
    played = play_match("ring", "ring", games=2, config=flown("nan", (place,)))
    assert {game.outcome for game in played.forfeits} == {("loss", "win")[place]} and len(played.forfeits) == 2
    assert played.forfeits[0].forfeit.startswith("brittle, which flies ")
    monkeypatch.setattr(Brittle, "from_densities", lambda *_: SERVED[fault]())  # uniform coverage fails, too
    for make in (parallel_env, lambda config: play_match("ring", "ring", games=2, config=config)):
        with pytest.raises(ConfigError, match="brittle cannot serve densities"):
            make(flown("nan", (0, 1)))


def test_a_system_that_cannot_show_a_command_later_on_forfeits(monkeypatch):
    show = lambda _, commands, config: np.ones((len(commands), 3 if commands[0, 0] > 0.2 else 10, 10))  # noqa: E731
    monkeypatch.setattr(Brittle, "to_densities", show)
    played = play_match("ring", "uniform", games=2, config=flown("nan"))
    assert ["cannot show its commands" in game.forfeit for game in played.forfeits] == [True] * 2
