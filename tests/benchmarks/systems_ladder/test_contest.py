from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks.systems_ladder.contest import (
    ADVERSARY,
    Contest,
    best_players,
    choose_systems,
    load_entrant,
    pilot,
    rules_of_track,
    scripts_for,
    trained_for,
)
from benchmarks.systems_ladder.findings import solve, standings, wins
from swarm_pz.config import GameConfig
from swarm_pz.errors import CommandError, KindError
from swarm_pz.evaluation.ledger import PlayedGame
from swarm_pz.evaluation.tournament import TournamentConfig

SHORT = TournamentConfig(games=4, game=GameConfig(drones_per_team=2, time_limit=20.0))
FIELD = (ADVERSARY, "direct/scatter", "direct/tighten")


def played(contest, results):
    """Fill a contest with games: (entrant, outcome, seconds, commands) by number, against the adversary."""
    for entrant, games in results.items():
        one, other = sorted((entrant, ADVERSARY))
        for number, (outcome, seconds, sent) in enumerate(games):
            flipped = {"win": "loss", "loss": "win", "draw": "draw"}[outcome]
            contest.games[one, other, number] = PlayedGame(
                one=one,
                other=other,
                number=number,
                outcome=outcome if entrant == one else flipped,
                share=0.5,
                seconds=seconds,
                fingerprint=f"{entrant} {number}",
                sent=(sent, 1) if entrant == one else (1, sent),
            )
    return contest


@pytest.fixture
def contest(tmp_path):
    made = Contest(FIELD, SHORT, tmp_path, against=ADVERSARY)
    return played(
        made,
        {
            "direct/scatter": [("draw", 20.0, 20), ("win", 10.0, 5), ("loss", 5.0, 5), ("draw", 20.0, 20)],
            "direct/tighten": [("win", 8.0, 4), ("win", 12.0, 6), ("win", 10.0, 5), ("draw", 20.0, 10)],
        },
    )


def test_scripts_of_a_system_answer_its_commands_and_nobody_learned_is_among_them():
    assert scripts_for("direct", GameConfig()) == ["hem_in", "hold", "scatter", "tighten"]
    ergodic = scripts_for("ergodic", GameConfig())
    assert {"ring", "uniform"} <= set(ergodic) and not {"champion", "planner", "hold", "tighten"} & set(ergodic)


def test_entrants_are_called_by_system_and_player():
    assert load_entrant("direct/hold", GameConfig()).answers == "accelerations"
    with pytest.raises(CommandError, match="an entrant is called SYSTEM/PLAYER, as ergodic/uniform, got 'ring'"):
        load_entrant("ring", GameConfig())
    with pytest.raises(KindError, match="ring"):
        load_entrant("direct/ring", GameConfig())
    with pytest.raises(CommandError, match=r"there is no control system 'ergodig'; did you mean 'ergodic'"):
        choose_systems(["ergodig"])
    assert choose_systems(["direct", "direct"]) == ("direct",)
    assert trained_for("direct", GameConfig(drones_per_team=3)) is None, "it does not fit"


def test_tracks_differ_in_the_least_airspeed_alone():
    game = GameConfig(time_limit=7.0)
    assert rules_of_track("hovering", game) == game
    assert rules_of_track("fixed_wing", game) == GameConfig.preset("fixed_wing").replace(time_limit=7.0)


def test_the_pilot_chooses_who_wins_most_and_then_who_wins_soonest(contest):
    assert best_players(contest) == ["direct/tighten"]
    played(contest, {"direct/scatter": [("win", 8.0, 4), ("win", 11.0, 6), ("win", 10.0, 5), ("draw", 20.0, 10)]})
    assert best_players(contest) == ["direct/scatter"]
    # A game that is lost early does not make the wins sooner.
    lost_late, lost_early = (
        [("win", won, 4), ("loss", lost, 4), ("draw", 20.0, 4), ("draw", 20.0, 4)]
        for won, lost in ((10.0, 19.0), (11.0, 5.0))
    )
    played(contest, {"direct/scatter": lost_early, "direct/tighten": lost_late})
    assert best_players(contest) == ["direct/tighten"]


def test_in_the_pilot_scripts_and_the_trained_policy_play_the_adversary_on_other_seeds(tmp_path):
    made = pilot(["direct"], SHORT.replace(game=GameConfig()), tmp_path)
    assert set(made.players) == {
        ADVERSARY,
        *(f"direct/{one}" for one in ("hem_in", "hold", "scatter", "tighten", "trained")),
    }
    assert made.config.seed != SHORT.seed
    assert all(ADVERSARY in pair for pair in made.pairings())


def test_standings_count_games_lengths_and_new_commands(contest):
    first, second = standings(contest)
    assert (first["entrant"], second["entrant"]) == ("direct/tighten", "direct/scatter")
    assert (first["wins"], first["draws"], first["losses"], first["games"]) == (3, 1, 0, 4)
    assert first["win_rate_ci95"][0] < 0.75 < first["win_rate_ci95"][1]
    assert second["length"]["mean"] == pytest.approx((20 + 10 + 5 + 20) / 4)
    assert second["time_to_win"]["mean"] == pytest.approx((20 + 10 + 20 + 20) / 4)
    assert first["commands_a_minute"]["mean"] == pytest.approx(30.0)
    assert (first["system"], first["player"], first["takes"]) == ("direct", "tighten", "accelerations")


def test_a_forfeit_is_a_game_lost_whose_length_and_commands_do_not_count(contest):
    before = {row["entrant"]: row for row in standings(contest)}
    for entrant, number in (("direct/scatter", 2), ("direct/tighten", 0)):  # lost, and won by the other's forfeit
        key = entrant, ADVERSARY, number
        contest.games[key] = dataclasses.replace(contest.games[key], forfeit="it raised", seconds=0.1, sent=(99, 99))
    rows = {row["entrant"]: row for row in standings(contest)}
    scatter, tighten = rows["direct/scatter"], rows["direct/tighten"]
    assert (scatter["forfeits"], tighten["forfeits"]) == (1, 0)
    for name in ("wins", "draws", "losses", "games"):
        assert (scatter[name], tighten[name]) == (before["direct/scatter"][name], before["direct/tighten"][name])
    assert scatter["length"]["mean"] == pytest.approx((20 + 10 + 20) / 3)
    assert tighten["commands_a_minute"]["mean"] == pytest.approx(30.0)


def test_wins_count_no_draws_and_on_the_diagonal_half_of_what_is_decided(tmp_path):
    made = Contest(FIELD[:2], SHORT, tmp_path)
    assert made.pairings() == [("direct/scatter",) * 2, ("direct/scatter", ADVERSARY), (ADVERSARY,) * 2]
    draw = ("draw", 20.0, 1)
    played(made, {"direct/scatter": [draw, ("win", 10.0, 1), ("loss", 5.0, 1), draw], ADVERSARY: [draw] * 4})
    for number, outcome in enumerate(("win", "loss", "win", "draw")):
        game = dataclasses.replace(made.games[ADVERSARY, ADVERSARY, number], one="direct/scatter", outcome=outcome)
        made.games["direct/scatter", "direct/scatter", number] = dataclasses.replace(game, other="direct/scatter")
    np.testing.assert_allclose(wins(made, ["direct/scatter", ADVERSARY]), [[3 / 8, 1 / 4], [1 / 4, 0.0]])


def test_the_game_of_entrants_is_solved_by_wins_less_losses_and_by_wins_that_nobody_can_deny():
    # Rock, paper and scissors, of which half is drawn; and one who loses to all.
    cycle = 0.5 * np.array([[0, 1, 0, 2], [0, 0, 1, 2], [1, 0, 0, 2], [0, 0, 0, 0]])
    found = solve(cycle)
    assert found["mixture"] == pytest.approx([1 / 3] * 3 + [0.0], abs=1e-3)
    assert found["safest"] == pytest.approx([1 / 3] * 3 + [0.0], abs=1e-3)
    assert (found["guaranteed"], found["wins"]) == pytest.approx((1 / 6, 1 / 6), abs=1e-3)
    # Who draws against all guarantees nothing, and is unbeaten; a mixture with wins may be beaten and win more.
    parked = solve(np.array([[0.0, 0.0, 0.0], [0.0, 0.4, 0.5], [0.0, 0.5, 0.3]]))
    assert parked["guaranteed"] == 0.0
