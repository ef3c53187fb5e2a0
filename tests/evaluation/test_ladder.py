"""A ladder's figures are those of its games, and its page and picture show them in their places."""

from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.evaluation import ladder
from swarm_pz.evaluation.ledger import GAMES, PlayedGame
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig


def line(one, other, number, outcome, **more):
    fields = {"share": 0.5, "seconds": 8.0, "fingerprint": f"{one}{other}{number}"} | more
    return PlayedGame(one=one, other=other, number=number, outcome=outcome, **fields)


PLAYERS = {
    "a": SimpleNamespace(reset=print, plan=print),  # sees the simulator
    "b": SimpleNamespace(digest="0"),
    "c": SimpleNamespace(),
}
LINES = [
    line("a", "b", 0, "win", seconds=3.0, thinking_ms=(1.0, 2.0)),
    line("a", "b", 1, "win", seconds=5.0, thinking_ms=(3.0, 4.0)),
    line("a", "c", 0, "win", seconds=0.0, forfeit="c: no luck"),
    line("a", "c", 1, "draw", seconds=7.0, thinking_ms=(5.0, 6.0)),
    line("b", "c", 0, "win", fingerprint="same", thinking_ms=(8.0, 9.0)),
    line("b", "c", 1, "loss", fingerprint="same", thinking_ms=(0.0, 0.0)),
]


@pytest.fixture
def report(tmp_path, monkeypatch):
    """The figures of a tournament of three."""
    monkeypatch.setattr("swarm_pz.evaluation.ratings._RESAMPLES", 60)
    config = TournamentConfig(games=2, seed=5, budget_ms=70.0, game=GameConfig(drones_per_team=2))
    tournament = Tournament(tuple(PLAYERS), config, tmp_path, lambda name, game: PLAYERS[name], "swarm-pz tournament")
    tournament.games = {game.key: game for game in LINES}
    assert not (tmp_path / GAMES).exists()
    return ladder.make_ladder(tournament)


def test_the_figures_of_a_tournament_are_those_of_its_lines(report):
    keys = ("player", "kind", "games", "wins", "draws", "losses", "forfeits", "median_seconds", "thinking_ms")
    keys += ("mixture_share", "points_against_mixture")
    assert [tuple(entry[key] for key in keys) for entry in report["players"]] == [
        ("a", "planned", 4, 3, 1, 0, 0, 5.0, 3.0, 1.0, 0.5),
        ("c", "scripted", 3, 0.5, 1, 1.5, 1, 7.5, 7.5, 0.0, 0.25),
        ("b", "learned", 3, 0.5, 0, 2.5, 0, 5.0, 4.0, 0.0, 0.0),
    ]
    assert (report["seed"], report["budget_ms"], report["games_per_pairing"], report["anchor"]) == (5, 70.0, 2, None)
    assert report["payoffs"] == [[None, 0.75, 1.0], [0.25, None, 0.5], [0.0, 0.5, None]]
    assert np.mean([entry["rating"] for entry in report["players"]]) == pytest.approx(1000.0, abs=0.1)
    for entry in report["players"]:
        low, high = entry["rating_ci95"]
        assert low < entry["rating"] < high
