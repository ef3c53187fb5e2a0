"""Each control system gets the player that wins most games against the field."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.systems_ladder import Contest, candidates, choose, standings
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.ledger import PlayedGame
from swarm_pz.evaluation.tournament import TournamentConfig

SHORT = TournamentConfig(games=2, game=GameConfig(drones_per_team=2, time_limit=1.0))


def played(one, other, number, outcome, seconds=10.0):
    return PlayedGame(
        one=one, other=other, number=number, outcome=outcome, share=0.5, seconds=seconds,
        fingerprint=f"{one}{other}{number}", forfeit="", sent=(1, 1), thinking_ms=(0.0, 0.0),
    )  # fmt: skip


def test_learned_policies_and_players_of_the_clock_are_candidates_and_readers_of_the_simulator_are_not():
    found = candidates("ergodic", GameConfig())
    assert {f"ergodic/{name}" for name in ("finisher", "veteran", "champion", "best_sequence", "trained")} <= {*found}
    assert not {"ergodic/planner", "ergodic/hold"} & {*found}
    assert "direct/hold" in candidates("direct", GameConfig())


@pytest.fixture
def contest(tmp_path):
    """Return a contest of three entrants with made-up games: halo wins more, and ring wins sooner."""
    names = ("direct/hold", "ergodic/halo", "ergodic/ring")
    made = Contest([(names[0], names[1]), (names[0], names[2])], SHORT, tmp_path)
    outcomes = {names[1]: ("loss", "loss"), names[2]: ("loss", "draw")}  # for direct/hold
    games = [
        played(names[0], other, number, outcome, seconds=9.0 if other.endswith("halo") else 1.0)
        for other, two in outcomes.items()
        for number, outcome in enumerate(two)
    ]
    made.games = {game.key: game for game in games}
    return made


def test_the_candidate_that_wins_most_is_chosen_and_not_the_one_that_wins_soonest(contest):
    rows = choose(contest, ["ergodic/ring", "ergodic/halo"])
    assert [one for one, _ in rows] == ["ergodic/halo", "ergodic/ring"]
    np.testing.assert_array_equal(rows[1][1], [1, 1, 0])


def test_the_table_counts_a_draw_as_no_win(tmp_path):
    made = Contest([("direct/hold", "ergodic/ring")], SHORT, tmp_path)
    made.games = {
        game.key: game for game in (played("direct/hold", "ergodic/ring", n, o) for n, o in enumerate(("loss", "draw")))
    }
    order, shares, rows = standings(made, "hovering")
    assert order == ["ergodic/ring", "direct/hold"] and shares.tolist() == [[0.0, 0.5], [0.0, 0.0]]
    assert [(row[1], row[3], row[4], row[6], *row[7:]) for row in rows] == [
        ("ergodic", "ring", "50.0", "100.0", "1", "1", "0"), ("direct", "hold", "0.0", "0.0", "0", "1", "1")
    ]  # fmt: skip
