"""Every figure of a report is that of its own games."""

from dataclasses import replace

import numpy as np
import pytest

from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.intervals import over_runs
from swarm_pz.standard.figures import Results, figures, forfeits_of
from swarm_pz.standard.games import Line, all_tracks

SHARES = {"win": 1.0, "draw": 0.25, "loss": 0.0}


def games(protocol, outcome_of, policies=1):
    """Return a line for every game of a protocol; `outcome_of` gets policy, track, opponent and number."""
    lines = []
    for track in all_tracks(protocol):
        for policy in range(policies):
            names = [trial.name for trial in track.trials]
            if track.name in ("choice", "robust"):
                names = (
                    [f"itself {policy}", f"learned {policy}", "search 1 2"]
                    if track.name == "choice"
                    else ["search 1 2"]
                )
            for name in names:
                for number in range(track.games):
                    result = outcome_of(policy, track.name, name, number)
                    share = result if isinstance(result, float) else SHARES[result]
                    outcome = "draw" if isinstance(result, float) else result
                    lines.append(Line(track.name, policy, name, number, outcome, share, 1.0, ""))
    return lines


def of(protocol, outcome_of, policies=1):
    def searched_is_worst(policy, track, name, number):
        if track == "choice":
            return "loss" if name.startswith("search") else "win"
        return outcome_of(policy, track, name, number)

    return figures(Results(games(protocol, searched_is_worst, policies), protocol, policies))


def test_a_share_is_the_score_and_a_draw_is_no_loss(tiny):
    report = of(tiny, lambda *_: "draw")
    assert (report["score"], report["score_ci95"], report["interval_over"]) == (0.25, [0.25, 0.25], "games")
    assert {track["score"] for track in report["tracks"].values()} == {0.25}
    soon = report["uniform"]
    assert soon["median_seconds"] is None and soon["restricted_mean_seconds"] == tiny.game.time_limit
    assert of(tiny, lambda *_: "win")["uniform"]["median_seconds"] == 1.0


def test_every_figure_is_of_its_own_games(tiny):
    """Policy 1 loses to one opponent of `field` and half its games to its attacker, and late games score less."""

    def outcome(policy, track, name, number):
        if track == "field, late":
            return 0.5 if policy == 0 else 0.25
        if track == "field":
            return "loss" if policy == 1 and name == "ring" else "win"
        if track == "robust":
            return "loss" if policy == 1 and number % 2 else 0.5
        return "draw" if track == "systems" else "win"

    report = of(tiny, outcome, policies=2)
    field, robust = report["tracks"]["field"], report["tracks"]["robust"]
    assert {name: track["score"] for name, track in report["tracks"].items()} == {
        "uniform": 1.0, "field": 0.75, "generated": 1.0, "systems": 0.25, "robust": 0.375,
    }  # fmt: skip
    assert report["score"] == pytest.approx(np.mean([1.0, 0.75, 1.0, 0.25, 0.375]), abs=1e-5)
    assert field["worst"] == {"opponent": "ring", "score": 0.5} and field["late"] == 0.375
    rows = {one["opponent"]: one for one in field["opponents"]}
    assert rows["ring"]["scores"] == [1.0, 0.0] and rows["uniform"]["scores"] == [1.0, 1.0]
    assert [rows["ring"][name] for name in ("games", "wins", "draws", "losses", "forfeits")] == [8, 4, 0, 4, 0]
    assert robust["worst"]["opponent"] == "search 1 2" and robust["late"] is None
    first, second = report["attacks"]
    assert (first["worst"]["opponent"], first["worst"]["score"], second["worst"]["score"]) == ("search 1 2", 0.5, 0.25)
    assert first["itself"]["wins"] == tiny.robust.choice_games
    assert field["score_ci95"] == pytest.approx(over_runs([1.0, 0.5]), abs=1e-5)
    assert field["open_loop"]["gain"] == 0.25 and report["tracks"]["uniform"]["open_loop"] is None
    assert report["interval_over"] == "training runs"


def test_forfeits_are_counted_wherever_they_are(tiny):
    lines = [
        line._replace(forfeit="broke") if line.number == 0 and line.track in ("uniform", "robust") else line
        for line in games(tiny, lambda policy, track, name, number: 0.5)
    ]
    lines = [line._replace(share=0.0) if line.opponent.startswith("search") else line for line in lines]
    forfeited, count, reason = forfeits_of(figures(Results(lines, tiny, 1)))
    assert (forfeited, reason) == (2, "broke") and count == sum(not line.track.endswith("late") for line in lines)


def test_attacks_alone_are_a_report_too(tiny):
    report = of(tiny.attacks_alone(640), lambda *_: 0.5)
    assert list(report["tracks"]) == ["robust"] and report["score"] == 0.5 and report["uniform"] is None


def test_one_policys_interval_is_over_pairs_of_games(tiny):
    report = of(tiny, lambda policy, track, name, number: "win" if number < 2 else "loss")
    assert report["tracks"]["uniform"]["score_ci95"] == [0.0, 1.0], "of two pairs"


@pytest.mark.parametrize(
    "spoil",
    [
        lambda lines: lines[1:],
        lambda lines: [*lines, lines[0]],
        lambda lines: [line for line in lines if line.track != "robust"],
        lambda lines: [line for line in lines if line.track != "uniform"],
        lambda lines: [line._replace(opponent="learned 0") if line.track == "robust" else line for line in lines],
        lambda lines: [],
    ],
)
def test_games_that_are_missing_or_too_many_are_refused(tiny, spoil):
    lines = games(tiny, lambda policy, track, name, number: 0.0 if name.startswith("search") else 0.5)
    assert figures(Results(lines, tiny, 1))["tracks"]["robust"]["score"] == 0.0
    with pytest.raises(ResultsError, match="missing"):
        Results(spoil(lines), replace(tiny), 1)
