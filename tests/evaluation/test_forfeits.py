"""Control systems that fail in the middle of games: whose side forfeits, and which games go on."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from swarm_pz import parallel_env, policies
from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError, FlightError
from swarm_pz.evaluation import play_match
from swarm_pz.evaluation.rollout import FaultError, GroundedError, Rollout
from swarm_pz.evaluation.tournament import TournamentConfig, play_block
from tests.systems_of_tests import Magnet, install


@dataclass(frozen=True, kw_only=True)
class Brittle(Magnet):
    """Fails once its team's first drone, of those that it flies, has flown to the right half."""

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
            if self.fault == "shape":
                return right[..., :1]
            right[fails] = np.nan
        return right


CONFIG = GameConfig(drones_per_team=2, time_limit=3.0, command_period=0.5)
FAULTS = {"raises": r"raised ZeroDivisionError\('fell over'\)", "shape": "of shape", "nan": "must be finite"}


@pytest.fixture(autouse=True)
def systems(monkeypatch):
    install(monkeypatch, Brittle)


def games_of(fault, pair=(0, 1)) -> GameConfig:
    chosen: list = ["ergodic", "ergodic"]
    for place in pair:
        chosen[place] = Brittle(fault=fault)
    return CONFIG.replace(controllers=tuple(chosen))


@pytest.mark.parametrize("fault", FAULTS)
def test_an_environment_raises_and_names_the_system(fault):
    env = parallel_env(games_of(fault, (1,)))
    env.reset(seed=0, options={"positions": [(0.1, 0.1), (0.1, 0.9), (0.9, 0.1), (0.9, 0.9)]})
    with pytest.raises(FlightError, match=rf"brittle, which flies blue, .*{FAULTS[fault]}"):
        env.step({agent: env.action_space(agent).low for agent in env.agents})


@pytest.mark.parametrize("place", [0, 1])
def test_the_side_that_it_flies_is_blamed_wherever_it_sits(place):
    config = games_of("nan", (place,))
    found = []
    for number in range(6):
        try:
            Rollout("uniform", "uniform", [number], config=config).play()
        except GroundedError as fault:
            found.append((fault.place, str(fault).partition(",")[0]))
    assert 0 < len(found) < 6 and set(found) == {(place, "brittle")}


@pytest.mark.parametrize("fault", FAULTS)
def test_in_a_match_the_game_is_lost_by_its_side_and_the_others_go_on(fault):
    played = play_match("ring", "uniform", games=12, config=games_of(fault, (0,)))
    failed = {(game.pair, game.side) for game in played.forfeits}
    assert 0 < len(failed) < 12, "teams begin in any corner, and fail at the right"
    for game in played.games:
        if game.forfeit:
            assert (game.outcome, game.share, game.seconds) == ("loss", 0.0, 0.0)
        else:
            assert game.seconds == pytest.approx(3.0) or game.outcome != "draw"
    assert len({game.fingerprint for game in played.forfeits}) == len(failed)
    mirrored = play_match("uniform", "ring", games=12, config=games_of(fault, (1,)))
    assert {(game.pair, game.side) for game in mirrored.forfeits} == failed, "players who change places take it along"
    assert all((game.outcome, game.share) == ("win", 1.0) for game in mirrored.forfeits)


SERVED = {
    "raises": (lambda: 1 / 0, "raised ZeroDivisionError"),
    "nan": (lambda: [[np.nan, 0.5]], "cannot serve densities: .* got nan"),
    "outside": (lambda: [[9.0, 0.5]], r"cannot serve densities: .* within \[0, 1\] .* got 9 there"),
}
"""What `from_densities` may do wrong: how, and what is said of it."""


@pytest.mark.parametrize("fault", SERVED)
@pytest.mark.parametrize("place", [0, 1])
def test_a_system_that_cannot_serve_a_density_later_on_forfeits(fault, place, monkeypatch):
    serve, said = SERVED[fault]
    monkeypatch.setattr(
        Brittle, "from_densities", lambda *given: [[0.4, 0.5]] * len(given[1]) if given[1].min() == 1 else serve()
    )
    played = play_match("ring", "ring", games=2, config=games_of("nan", (place,)))
    assert {game.outcome for game in played.forfeits} == {("loss", "win")[place]} and len(played.forfeits) == 2
    assert re.match(f"brittle, which flies (red|blue), {said}", played.forfeits[0].forfeit)


@pytest.mark.parametrize("fault", SERVED)
@pytest.mark.parametrize("make", [parallel_env, lambda config: play_match("ring", "ring", games=2, config=config)])
def test_a_system_that_cannot_serve_even_coverage_is_refused_when_games_are_made(fault, make, monkeypatch):
    monkeypatch.setattr(Brittle, "from_densities", lambda *_: SERVED[fault][0]())
    with pytest.raises(ConfigError, match="controllers: brittle cannot serve densities"):
        make(games_of("nan"))


def test_a_system_that_cannot_show_a_command_later_on_forfeits(monkeypatch):
    monkeypatch.setattr(
        Brittle,
        "to_densities",
        lambda _, commands, config: np.ones((len(commands), 3 if commands[0, 0] > 0.2 else 10, 10)),
    )
    played = play_match("ring", "uniform", games=4, config=games_of("nan", (0,)))
    assert len(played.forfeits) == 4
    assert "cannot show its commands as densities" in played.forfeits[0].forfeit


def test_the_games_that_go_on_are_those_of_a_match_without_faults():
    good = play_match("ring", "uniform", games=12, config=games_of("raises", (0,)))
    finished = []
    play_match("ring", "uniform", games=12, config=games_of("raises", (0,)), progress=lambda *how: finished.append(how))
    assert finished[-1][1] == 12 and max(finished)[0] <= 12
    for game in good.games:
        if not game.forfeit:
            number = 2 * game.pair + (game.side == "blue")
            alone = Rollout("ring", "uniform", [number], config=games_of("raises", (0,)))
            alone.play()
            assert alone.games() == [game]


def test_a_policy_at_fault_still_stops_a_match():
    class Broken:
        observation = policies.load("uniform").observation
        name = "broken"

        def reset(self, seeds, rows):
            pass

        def act(self, observations, rows):
            raise RuntimeError("no idea")

    with pytest.raises(FaultError, match="no idea"):
        play_match("uniform", Broken(), games=2, config=CONFIG)


def test_in_a_tournament_it_forfeits_as_a_policy_at_fault_does():
    config = TournamentConfig(games=12, game=games_of("raises", (0,)))
    games = play_block(policies.load, "ring", "uniform", range(12), config)
    forfeits = [game for game in games if game.forfeit]
    assert 0 < len(forfeits) < len(games) == 12
    assert all(game.outcome == "loss" and "ring: brittle, which flies" in game.forfeit for game in forfeits)


def test_a_command_line_says_what_was_forfeited_and_why(tmp_path, capsys):
    short = ["--game.drones-per-team", "2", "--game.time-limit", "3", "--game.command-period", "0.5"]
    file = tmp_path / "e.json"
    main(["evaluate", "ring", "--games", "12", *short, "--game.controllers", "brittle", "ergodic", "--json", str(file)])
    said = capsys.readouterr().out
    assert "of 12 games are forfeits: brittle, which flies" in said
    told = json.loads(file.read_text())["forfeits"]
    assert told and all("ZeroDivisionError" in one["reason"] and one["side"] in ("red", "blue") for one in told)
