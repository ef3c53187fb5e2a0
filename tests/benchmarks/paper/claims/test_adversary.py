from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import adversary
from swarm_pz.config import GameConfig
from swarm_pz.evaluation import intervals
from tests.benchmarks.paper.given import SEED, game, results

SMALL = {"PAIRS": 1, "NAIVE": ("chase", "noise")}
"""What makes the figure quick."""
WEAK, CLOSE, STRONG = (4, 12, 50), (26, 28, 30), (40, 50, 10)
"""Games of 60 that three tactics win."""
PARTS = tuple(f"`{rules}`, a command every {time}" for rules in ("paper", "released") for time in ("second", "3 s"))


@pytest.mark.parametrize(
    ("wins", "holds"),
    [((WEAK,) * 4, True)]
    + [(tuple(other if number == place else WEAK for number in range(4)), False)
       for place in range(4) for other in (CLOSE, STRONG)],
)  # fmt: skip
def test_uniform_coverage_is_a_challenge_where_the_median_is_surely_below_half_for_all_rules_and_cadences(
    monkeypatch, wins, holds
):
    asked = []

    def play(player, opponent, numbers, *, seed, config):
        assert (opponent, [*numbers], seed) == ("uniform", [*range(60)], SEED)
        asked.append((player.name, config))
        part, place = divmod(len(asked) - 1, 3)
        # Won from the same starts on both sides, so that intervals are as wide as pairs make them.
        outcomes = np.repeat(results(wins[part][place] // 2, 30), 2)
        return [game(number, str(outcome)) for number, outcome in enumerate(outcomes)]

    monkeypatch.setattr(adversary, "play_games", play)
    monkeypatch.setattr(adversary, "NAIVE", ("centre", "noise", "evade"))
    finding = adversary.measure(SEED)
    assert finding.supported == holds
    assert finding.parts == {part: won == WEAK for part, won in zip(PARTS, wins, strict=True)}
    assert [*finding.statistic.values()] == pytest.approx([np.median(won) / 60 for won in wins])
    rules = [GameConfig.preset(name) for name in ("paper", "paper", "released", "released")]
    assert asked == [
        (f"{name}, every {seconds} steps", config)
        for seconds, config in zip((1, 3, 1, 3), rules, strict=True)
        for name in ("centre", "noise", "evade")
    ]
    assert [row["win"] for row in finding.series[PARTS[3]]] == [*wins[3]]
    # A pair is drawn with both of its games.
    won = [[[count / 2 > pair] * 2 for count in wins[0]] for pair in range(30)]
    _, *ends = intervals.bootstrap(np.array(won, float), adversary.median_win_rate)
    assert finding.interval["median_win_rate_paper_every_1_s"] == pytest.approx(tuple(map(float, ends)))
    assert all(f"Rules {part}: " in finding.seen for part in PARTS)
    words = {WEAK: "a challenge", CLOSE: "not surely one", STRONG: "not surely one"}
    assert finding.seen.count("so uniform coverage is a challenge") == sum(finding.parts.values())
    assert all(f"so uniform coverage is {words[won]}" in finding.seen for won in wins)


def test_who_is_no_challenge_is_said_and_who_clearly_wins(monkeypatch):
    def play(player, *given, **options):
        won = {"centre": 50, "noise": 34, "evade": 48}[player.name.partition(",")[0]]
        return [game(number, str(outcome)) for number, outcome in enumerate(np.repeat(results(won // 2, 30), 2))]

    monkeypatch.setattr(adversary, "play_games", play)
    monkeypatch.setattr(adversary, "NAIVE", ("centre", "noise", "evade"))
    seen = adversary.measure(SEED).seen
    said = "so uniform coverage is none; `centre`, `evade` win clearly more than half."
    assert seen.count(said) == 4, "34 of 60 are more than half, not clearly"


def test_the_median_win_rate_is_over_players():
    wins = np.zeros((4, 3, 2))
    wins[:, 1] = 1.0
    wins[:2, 2] = 1.0
    assert adversary.median_win_rate(wins) == 0.5


def test_who_surrounds_is_not_naive():
    assert not {"halo", "lasso", "ring", "uniform", "restless", "wavefront"} & set(adversary.NAIVE)
    assert set(adversary.NAIVE) == {"centre", "chase", "corners", "evade", "noise"}
