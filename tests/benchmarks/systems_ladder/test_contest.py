from __future__ import annotations

import dataclasses

import pytest

from benchmarks.systems_ladder.contest import (
    ADVERSARY,
    Contest,
    best_scripts,
    choose_systems,
    load_entrant,
    pilot,
    scripts_for,
    trained_for,
)
from benchmarks.systems_ladder.findings import compare, payoffs, standings
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


def test_the_pilot_chooses_who_takes_most_points_and_then_who_wins_soonest(contest):
    assert best_scripts(contest) == {"direct": "direct/tighten"}
    played(contest, {"direct/scatter": [("win", 8.0, 4), ("win", 11.0, 6), ("win", 10.0, 5), ("draw", 20.0, 10)]})
    assert best_scripts(contest) == {"direct": "direct/scatter"}
    # A game that is lost early does not make the wins sooner.
    lost_late, lost_early = (
        [("win", won, 4), ("loss", lost, 4), ("draw", 20.0, 4), ("draw", 20.0, 4)]
        for won, lost in ((10.0, 19.0), (11.0, 5.0))
    )
    played(contest, {"direct/scatter": lost_early, "direct/tighten": lost_late})
    assert best_scripts(contest) == {"direct": "direct/tighten"}


def test_the_pilot_plays_the_adversary_on_other_seeds(tmp_path):
    made = pilot(["direct"], SHORT, tmp_path)
    assert made.config.seed != SHORT.seed
    assert all(ADVERSARY in pair for pair in made.pairings()) and len(made.pairings()) == 4


def test_standings_count_games_lengths_and_new_commands(contest):
    first, second = standings(contest)
    assert (first["entrant"], second["entrant"]) == ("direct/tighten", "direct/scatter")
    assert (first["wins"], first["draws"], first["losses"], first["games"]) == (3, 1, 0, 4)
    assert first["win_rate_ci95"][0] < 0.75 < first["win_rate_ci95"][1]
    assert second["length"]["mean"] == pytest.approx((20 + 10 + 5 + 20) / 4)
    assert second["time_to_win"]["mean"] == pytest.approx((20 + 10 + 20 + 20) / 4)
    assert first["commands_a_minute"]["mean"] == pytest.approx(30.0)
    assert first["won_after_s"] == [8.0, 10.0, 12.0]
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


def test_two_are_compared_on_the_same_starts(contest):
    found = compare(contest, "direct/tighten", "direct/scatter")
    assert found["more_often"]["mean"] == pytest.approx(0.5)
    assert found["sooner"]["mean"] == pytest.approx(17.5 - 12.5)
    back = compare(contest, "direct/scatter", "direct/tighten")
    assert back["more_often"]["mean"] == pytest.approx(-0.5)


def test_payoffs_are_shares_of_points_in_the_order_asked_for(contest):
    shares = payoffs(contest, ["direct/tighten", ADVERSARY])
    assert shares == [[None, 0.875], [0.125, None]]
