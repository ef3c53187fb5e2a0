"""A ladder's figures are those of its games, and its page and picture show them in their places."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from swarm_pz.config import GameConfig
from swarm_pz.evaluation import ladder
from swarm_pz.evaluation.ledger import GAMES, PlayedGame
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig

ENTRIES = [
    {
        "player": "planner", "kind": "planned", "rating": 1500.4, "rating_ci95": [1450.2, 1600.6], "games": 12,
        "wins": 9, "draws": 2, "losses": 1, "forfeits": 0, "median_seconds": 61.4, "thinking_ms": 12.34,
    },
    {
        "player": "ring", "kind": "scripted", "rating": 1000.0, "rating_ci95": [1000.0, 1000.0], "games": 12,
        "wins": 4, "draws": 3, "losses": 5, "forfeits": 7, "median_seconds": None, "thinking_ms": None,
    },
]  # fmt: skip
LADDER = {
    "seed": 3, "games_per_pairing": 12, "anchor": "ring", "players": ENTRIES, "payoffs": [[None, 0.875], [0.125, None]],
    "rules_hash": "0123456789abcdef", "versions": {"swarm-pz": "9.8.7"}, "command": "swarm-pz tournament planner ring",
    "intransitivity": {
        "cyclic_share": 0.25, "cyclic_share_of_a_ladder": 0.05, "cycles": 2, "decided_triples": 9,
        "strongest_cycle": ["a", "b", "c"],
    },
}  # fmt: skip


def test_the_page_says_everything_in_its_place():
    page = ladder.to_markdown(LADDER, "drawn.png")
    assert [line for line in page.splitlines() if line.startswith("| ") and "player" not in line] == [
        "| 1 | `planner` | planned | 1500 | 1450 to 1601 | 9 | 2 | 1 | 0 | 61 | 12.3 |",
        "| 2 | `ring` | scripted | 1000 | 1000 to 1000 | 4 | 3 | 5 | 7 | - | - |",
    ]
    for words in (
        "2 players, each against every other in 12 games", "seed 3", "`ring` is 1000", "`0123456789abcdef`", "9.8.7",
        "swarm-pz tournament planner ring", "(drawn.png)", "25 %", "give 5 %", "2 of 9 triples", "`a` beats `b`",
    ):  # fmt: skip
        assert words in page, words
    other = LADDER["intransitivity"] | {"strongest_cycle": []}
    page = ladder.to_markdown(LADDER | {"anchor": None, "intransitivity": other}, "drawn.png")
    assert "the mean is 1000" in page and page.endswith("results are cycles.\n")


def test_the_picture_shows_intervals_and_shares_where_they_belong(tmp_path, monkeypatch):
    drawn, save = [], Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda one, *given, **how: drawn.append(one) or save(one, *given, **how))
    ladder.plot(LADDER, tmp_path / "new" / "ladder.png")
    assert (tmp_path / "new" / "ladder.png").stat().st_size > 1000
    left, right = drawn[0].axes[:2]
    np.testing.assert_allclose(left.collections[0].get_segments()[0], [[1450.2, 0], [1600.6, 0]])
    for labels in (left.get_yticklabels(), right.get_xticklabels()):
        assert [label.get_text() for label in labels] == ["planner*", "ring"]
    above, below = left.transData.transform([(1000, 0), (1000, 1)])[:, 1]
    assert above > below, "the best is at the top"
    assert {text.get_position(): text.get_text() for text in right.texts} == {(1, 0): "88", (0, 1): "12"}
    np.testing.assert_array_equal(right.images[0].get_array().filled(np.nan), [[np.nan, 0.875], [0.125, np.nan]])
    assert "sees the simulator" in right.get_title()


def line(one, other, number, outcome, **more):
    given = {"share": 0.5, "seconds": 8.0, "fingerprint": f"{one}{other}{number}"} | more
    return PlayedGame(one=one, other=other, number=number, outcome=outcome, **given)


class Seer:
    def reset(self, seeds, rows):
        pass

    def plan(self, simulator, teams, rows):
        pass


def test_the_figures_of_a_tournament_are_those_of_its_lines(tmp_path, monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.ratings._RESAMPLES", 60)
    players = {"a": Seer(), "b": SimpleNamespace(digest="0"), "c": SimpleNamespace()}
    config = TournamentConfig(games=2, seed=5, budget_ms=70.0, game=GameConfig(drones_per_team=2))
    tournament = Tournament(tuple(players), config, tmp_path, lambda name, game: players[name])
    games = [
        line("a", "b", 0, "win", seconds=3.0, thinking_ms=(1.0, 2.0)),
        line("a", "b", 1, "win", seconds=5.0, thinking_ms=(3.0, 4.0)),
        line("a", "c", 0, "win", seconds=0.0, forfeit="c: no luck"),
        line("a", "c", 1, "draw", seconds=7.0, thinking_ms=(5.0, 6.0)),
        line("b", "c", 0, "win", fingerprint="same", thinking_ms=(8.0, 9.0)),
        line("b", "c", 1, "loss", fingerprint="same", thinking_ms=(0.0, 0.0)),
    ]
    tournament.games = {game.key: game for game in games}
    found = ladder.make_ladder(tournament)
    keys = ("player", "kind", "games", "wins", "draws", "losses", "forfeits", "median_seconds", "thinking_ms")
    assert [tuple(entry[key] for key in keys) for entry in found["players"]] == [
        ("a", "planned", 4, 3, 1, 0, 0, 5.0, 3.0),
        ("c", "scripted", 3, 0.5, 1, 1.5, 1, 7.5, 7.5),
        ("b", "learned", 3, 0.5, 0, 2.5, 0, 5.0, 4.0),
    ]
    assert (found["seed"], found["budget_ms"], found["games_per_pairing"], found["anchor"]) == (5, 70.0, 2, None)
    assert found["payoffs"] == [[None, 0.75, 1.0], [0.25, None, 0.5], [0.0, 0.5, None]]
    assert found["config_hash"] == config.game.hash
    assert np.mean([entry["rating"] for entry in found["players"]]) == pytest.approx(1000.0, abs=0.1)
    for entry in found["players"]:
        low, high = entry["rating_ci95"]
        assert low < entry["rating"] < high
    assert not (tmp_path / GAMES).exists()
