"""Every figure of a report is that of its own games."""

from dataclasses import replace

import numpy as np
import pytest

from swarm_pz.errors import ResultsError
from swarm_pz.standard.figures import Results, figures, forfeits_of, improvement
from swarm_pz.standard.games import Line, all_tracks

SHARES = {"win": 1.0, "draw": 0.5, "loss": 0.0}


def games(protocol, outcome_of, policies=1):
    """Return a line for every game of a protocol; `outcome_of` gets policy, track, opponent and number."""
    found = []
    for track in all_tracks(protocol):
        for policy in range(policies):
            each = protocol.robust.exploiters_each(policies)
            learned = [f"learned {each * policy + seed}" for seed in range(each)]
            for name in [trial.name for trial in track.trials] or [*learned, "siege 1 2"]:
                for number in range(track.games):
                    how = outcome_of(policy, track.name, name, number)
                    found.append(Line(track.name, policy, name, number, how, SHARES[how], 1.0, ""))
    return found


def of(protocol, outcome_of, policies=1):
    return figures(Results(games(protocol, outcome_of, policies), protocol, ("a", "b")[:policies]))


def test_a_winner_of_all_has_one_and_a_drawer_of_all_has_no_median(tiny):
    said = of(tiny, lambda *_: "win")
    assert (said["score"], said["score_ci95"], said["interval_over"]) == (1.0, [1.0, 1.0], "games")
    assert said["uniform"]["won_share"] == said["uniform"]["median_seconds"] == 1.0
    said = of(tiny, lambda *_: "draw")
    assert said["score"] == 0.0
    said = said["uniform"]
    assert said["median_seconds"] is None and said["restricted_mean_seconds"] == tiny.game.time_limit


def test_every_figure_is_of_its_own_games(tiny):
    """Uniform coverage is beaten half of the time, after 2 s; of the attacks one wins all, and the others nothing."""

    def change(one):
        if one.track == "uniform":
            wins = one.policy == 0 or one.number < 1
            fields = {"outcome": "win" if wins else "draw", "seconds": 2.0 if wins else 1.0, "share": 0.75}
            return one._replace(**fields)
        if one.track == "robust":
            loses = one.opponent in ("learned 1", "learned 2")  # the second of one policy, the first of the other
            return one._replace(outcome="loss" if loses else "win", forfeit="late" if loses and one.number else "")
        return one._replace(outcome="draw" if one.track == "field" and one.number else "win")

    lines = [change(one) for one in games(tiny, lambda *_: "win", policies=2)]
    said = figures(Results(lines, tiny, ("a", "b")))
    uniform, (first, second, siege) = said["tracks"]["uniform"]["opponents"][0], said["tracks"]["robust"]["opponents"]
    counts = ("games", "wins", "draws", "losses", "forfeits", "mean_share")
    assert [uniform[name] for name in counts] == [8, 5, 3, 0, 0, 0.75]
    assert uniform["scores"] == [1.0, 0.25]
    assert [first[name] for name in counts] == [8, 4, 0, 4, 3, 1.0]
    assert (first["scores"], second["scores"], siege["scores"]) == ([1.0, 0.0], [0.0, 1.0], [1.0, 1.0])
    scores = {name: track["score"] for name, track in said["tracks"].items()}
    assert scores == {"uniform": 0.625, "field": 0.25, "generated": 1.0, "systems": 1.0, "robust": 0.0}
    assert said["score"] == pytest.approx(np.mean(list(scores.values())), abs=1e-4)
    assert [said["tracks"][name]["score_ci95"] for name in ("uniform", "field")] == [[0.25, 1.0], [0.25, 0.25]]
    soon = said["uniform"]
    assert (soon["games"], soon["won"], soon["won_share"], soon["median_seconds"]) == (8, 5, 0.625, 2.0)
    assert soon["restricted_mean_seconds"] == pytest.approx((5 * 2.0 + 3 * tiny.game.time_limit) / 8, abs=1e-4)
    for name in ("won_share", "restricted_mean_seconds"):
        low, high = soon[f"{name}_ci95"]
        assert low < soon[name] < high
    assert soon["curve"]["not_won"][0] == 1.0 and soon["curve"]["not_won"][-1] == pytest.approx(3 / 8, abs=1e-4)
    forfeits = sum(bool(one.forfeit) for one in lines)
    assert forfeits_of(said) == (forfeits, len(lines), "late")
    assert figures(Results(lines[::-1], tiny, ("a", "b"))) == said


def test_the_worst_opponents_stand_beside_the_mean(tiny):
    """Of five opponents the worst quarter is two."""
    field = tiny.tracks[1]
    five = tuple(replace(field.trials[0], name=f"of {number}") for number in range(5))
    many = replace(tiny, tracks=(tiny.tracks[0], replace(field, trials=five), *tiny.tracks[2:]))

    def outcome(policy, track, name, number):
        return "win" if track != "field" or number < int(name[-1]) else "draw"

    field = of(many, outcome)["tracks"]["field"]
    assert field["score"] == 0.5 and field["worst"] == {"opponent": "of 0", "score": 0.0} and field["cvar"] == 0.125


def test_robust_is_the_worst_attack_and_a_fifth_of_the_score(tiny):
    def outcome(policy, track, name, number):
        return "draw" if name.startswith("siege") else "win"

    said = of(tiny, outcome)
    assert [tiny.robust.exploiters_each(policies) for policies in (1, 2, 3, 4, 9)] == [4, 2, 2, 1, 1]
    assert said["tracks"]["robust"]["score"] == 0.0 and said["score"] == pytest.approx(0.8)
    assert said["tracks"]["robust"]["worst"]["opponent"] == "siege"


def test_nobody_is_scored_against_itself_and_the_gain_is_over_the_clock_alone_against_the_same_opponents(tiny):
    """The clock alone wins half against uniform and all against ring; the second policy is ring."""
    ring = tiny.tracks[1].trials[0]
    lines = [
        line
        for line in games(tiny, lambda policy, track, name, number: "draw" if name == "ring" else "win", policies=2)
        if (line.track, line.policy, line.opponent) != ("field", 1, "ring")
    ]
    said = figures(Results(lines, tiny, ("a", ring.digest)))
    field = said["tracks"]["field"]
    assert said["left_out"] == [{"policy": 1, "track": "field", "opponent": "ring"}]
    assert field["score"] == np.mean([0.5, 1.0]) and field["opponents"][0]["scores"] == [0.0, None]
    assert field["open_loop"]["gain"] == np.mean([0.5 - 0.75, 1.0 - 0.5])
    assert said["tracks"]["uniform"]["open_loop"] is None
    with pytest.raises(ResultsError, match="missing, or too many"):
        Results(games(tiny, lambda *_: "win", policies=2), tiny, ("a", ring.digest))


def test_an_interval_is_over_training_seeds_if_there_are_several_or_else_over_pairs_of_games(tiny):
    said = of(tiny, lambda policy, *_: "win" if policy else "loss", policies=2)
    assert said["interval_over"] == "training seeds"
    assert said["score_ci95"][0] < 0.5 < said["score_ci95"][1]
    one = of(tiny, lambda policy, track, name, number: "win" if number < 2 else "loss")
    assert one["tracks"]["uniform"]["score_ci95"] == [0.0, 1.0], "of two pairs"


def test_a_winner_of_all_improves_on_a_loser_of_all(tiny):
    best, worst = (Results(games(tiny, lambda *_, how=how: how), tiny, ("a",)) for how in ("win", "loss"))
    assert improvement(best, worst) == {"probability": 1.0, "ci95": [1.0, 1.0]}
    assert improvement(best, best)["probability"] == 0.5


@pytest.mark.parametrize("spoil", [lambda lines: lines[1:], lambda lines: [*lines, lines[0]], lambda lines: []])
def test_games_that_are_missing_or_too_many_are_refused(tiny, spoil):
    with pytest.raises(ResultsError, match="missing, or too many"):
        Results(spoil(games(tiny, lambda *_: "win")), tiny, ("a",))
