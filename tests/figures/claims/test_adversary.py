from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.evaluation import intervals
from swarm_pz.evaluation.match import MatchResult
from swarm_pz.figures.claims import adversary
from tests.figures.given import SEED, game, results

SMALL = {"GAMES": 2, "scripts": lambda: ["noise", "ring"]}
"""What makes the figure quick."""


def adversaries(monkeypatch, wins):
    """Let scripts win so many of the 60 games of each set of rules; return what was asked for."""
    asked = []

    def play(name, opponent, **options):
        rules = options["config"]
        asked.append((name, opponent, rules, options["games"], options["seed"]))
        count = wins[rules == GameConfig.preset("released")][name]
        # Won from the same starts on both sides, so that intervals are as wide as pairs make them.
        outcomes = np.repeat(results(count // 2, 30), 2)
        return MatchResult(
            policy=name, opponent=opponent, seed=SEED, config=rules, limit_s=300.0,
            games=[game(number, str(outcome)) for number, outcome in enumerate(outcomes)],
        )  # fmt: skip

    monkeypatch.setattr(adversary, "play_match", play)
    monkeypatch.setattr(adversary, "scripts", lambda: ["a", "b", "c"])
    return asked


WEAK, CLOSE, STRONG = {"a": 4, "b": 12, "c": 50}, {"a": 26, "b": 28, "c": 30}, {"a": 40, "b": 50, "c": 10}


@pytest.mark.parametrize(
    ("paper", "released", "holds"),
    [(WEAK, WEAK, True), (CLOSE, WEAK, False), (WEAK, CLOSE, False), (WEAK, STRONG, False), (STRONG, WEAK, False)],
)
def test_uniform_coverage_is_hard_where_the_median_is_surely_below_half_under_all_rules(
    monkeypatch, paper, released, holds
):
    asked = adversaries(monkeypatch, (paper, released))
    finding = adversary.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic == {
        "median_win_rate_paper": pytest.approx(np.median([*paper.values()]) / 60),
        "median_win_rate_released": pytest.approx(np.median([*released.values()]) / 60),
    }
    assert asked == [
        (name, "uniform", GameConfig.preset(preset), 60, SEED) for preset in ("paper", "released") for name in "abc"
    ]
    assert [row["wins"] for row in finding.series["released"]] == [*released.values()]
    # A pair is drawn with both of its games.
    won = [[[count / 2 > pair] * 2 for count in paper.values()] for pair in range(30)]
    _, *ends = intervals.bootstrap(np.array(won, float), adversary.median_win_rate)
    assert finding.interval["median_win_rate_paper"] == pytest.approx(tuple(map(float, ends)))


def test_the_median_win_rate_is_over_players():
    wins = np.zeros((4, 3, 2))
    wins[:, 1] = 1.0
    wins[:2, 2] = 1.0
    assert adversary.median_win_rate(wins) == 0.5


def test_every_script_but_uniform_coverage_is_judged():
    assert {"restless", "blind_ring", "ring", "noise"} <= set(adversary.scripts())
    assert not {"uniform", "champion", "planner"} & set(adversary.scripts())
