"""Every figure of a report is that of its own games."""

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
        names = [trial.name for trial in track.trials] or ["learned 0", "siege 1 2"]
        for policy in range(policies):
            for name in names:
                for number in range(track.games):
                    how = outcome_of(policy, track.name, name, number)
                    found.append(Line(track.name, policy, name, number, how, SHARES[how], 1.0, f"{number}", ""))
    return found


def of(protocol, outcome_of, policies=1):
    return figures(Results(games(protocol, outcome_of, policies), protocol))


def test_a_winner_of_all_has_one_and_a_drawer_of_all_has_no_median(tiny):
    said = of(tiny, lambda *_: "win")
    assert (said["score"], said["score_ci95"], said["interval_over"]) == (1.0, [1.0, 1.0], "games")
    assert said["uniform"]["won_share"] == said["uniform"]["median_seconds"] == 1.0
    assert said["profile"]["share"] == [1.0] * 20
    said = of(tiny, lambda *_: "draw")["uniform"]
    assert said["median_seconds"] is None and said["restricted_mean_seconds"] == tiny.game.time_limit


def test_every_figure_is_of_its_own_games(tiny):
    """Uniform coverage is beaten half of the time, after 2 s; of the attacks one wins all, and the other nothing."""

    def change(one):
        if one.track == "uniform":
            twice = one.number in (2, 3)  # a pair that played the same game twice
            wins = one.policy == 0 or one.number < 2
            fields = {"outcome": "win" if wins else "draw", "seconds": 2.0 if wins else 1.0, "share": 0.75}
            return one._replace(**fields, fingerprint="same" if twice else one.fingerprint)
        if one.track == "robust":
            loses = one.opponent.startswith("siege") == bool(one.policy)
            return one._replace(outcome="loss" if loses else "win", forfeit="late" if loses and one.number else "")
        return one._replace(outcome="draw" if one.track == "field" else "win")

    lines = [change(one) for one in games(tiny, lambda *_: "win", policies=2)]
    said = figures(Results(lines, tiny))
    uniform, (learned, searched) = said["tracks"]["uniform"]["opponents"][0], said["tracks"]["robust"]["opponents"]
    counts = ("games", "wins", "draws", "losses", "forfeits", "mean_share")
    assert [uniform[name] for name in counts] == [8, 6, 2, 0, 0, 0.75]
    assert uniform["points"] == [1.0, 0.833333]
    assert [searched[name] for name in counts] == [8, 4, 0, 4, 3, 1.0]
    assert (learned["points"], searched["points"]) == ([0.0, 1.0], [1.0, 0.0])
    scores = {name: track["score"] for name, track in said["tracks"].items()}
    assert scores == {"uniform": 0.916667, "field": 0.5, "held-out": 1.0, "systems": 1.0, "robust": 0.5}
    assert said["score"] == pytest.approx(np.mean(list(scores.values())), abs=1e-4)
    assert [said["tracks"][name]["score_ci95"] for name in ("uniform", "field")] == [[0.833333, 1.0], [0.5, 0.5]]
    soon = said["uniform"]
    assert (soon["games"], soon["won"], soon["won_share"], soon["median_seconds"]) == (6, 5, 0.833333, 2.0)
    assert soon["restricted_mean_seconds"] == pytest.approx((5 * 2.0 + tiny.game.time_limit) / 6, abs=1e-4)
    for name in ("won_share", "restricted_mean_seconds"):
        low, high = soon[f"{name}_ci95"]
        assert low < soon[name] < high
    assert soon["curve"]["not_won"][0] == 1.0 and soon["curve"]["not_won"][-1] == pytest.approx(1 / 6, abs=1e-4)
    profile = said["profile"]
    assert profile["score_above"][:2] == [0.0, 0.05] and profile["share"][0] == pytest.approx(10 / 12, abs=1e-4)
    assert all(low <= high for low, high in zip(profile["low"], profile["high"], strict=True))
    forfeits = sum(bool(one.forfeit) for one in lines)
    assert forfeits_of(said) == (forfeits, len(lines), "late")
    assert figures(Results(lines, tiny)) == said


def test_robust_is_the_worse_attack_and_a_fifth_of_the_score(tiny):
    def outcome(policy, track, name, number):
        return "loss" if name.startswith("siege") else "draw" if track == "robust" else "win"

    said = of(tiny, outcome)
    assert said["tracks"]["robust"]["score"] == 0.0 and said["score"] == pytest.approx(0.8)


def test_an_interval_is_over_training_seeds_if_there_are_several_or_else_over_pairs_of_games(tiny):
    said = of(tiny, lambda policy, *_: "win" if policy else "loss", policies=2)
    assert said["interval_over"] == "training seeds"
    assert said["score_ci95"][0] < 0.5 < said["score_ci95"][1]
    one = of(tiny, lambda policy, track, name, number: "win" if number < 2 else "loss")
    assert one["tracks"]["uniform"]["score_ci95"] == [0.0, 1.0], "of two pairs"


def test_a_winner_of_all_improves_on_a_loser_of_all(tiny):
    best, worst = (Results(games(tiny, lambda *_, how=how: how), tiny) for how in ("win", "loss"))
    assert improvement(best, worst) == {"probability": 1.0, "ci95": [1.0, 1.0]}
    assert improvement(best, best)["probability"] == 0.5


@pytest.mark.parametrize("spoil", [lambda lines: lines[1:], lambda lines: [*lines, lines[0]], lambda lines: []])
def test_games_that_are_missing_or_too_many_are_refused(tiny, spoil):
    with pytest.raises(ResultsError, match="missing, or too many"):
        Results(spoil(games(tiny, lambda *_: "win")), tiny)
