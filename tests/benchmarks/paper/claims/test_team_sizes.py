from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import team_sizes
from swarm_pz.config import GameConfig
from tests.benchmarks.paper.given import SEED, game

SMALL = {"GAMES": 3, "SHOWN": 2}
"""What makes the figure quick."""
LATE, EARLY = [10, 12, 9, 11, 8, 9, 8, 9, 11, 15, 20], [10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20]
CALM, RISING = [0, 9, 12, 15, 18, 21, 24, 27, 30, 31, 32], [0, 1, 2, 3, 4, 5, 6, 7, 8, 19, 30]


@pytest.mark.parametrize(
    ("rates", "sizes", "totals", "holds"),
    [
        ([0.3] * 60, [LATE], [CALM], (True, True, True)),
        ([0.15, 0.35] * 30, [LATE], [CALM], (True, True, True)),
        ([0.1, 0.31] * 30, [LATE], [CALM], (False, True, True)),  # above, not surely
        ([0.1] * 60, [LATE], [CALM], (False, True, True)),
        ([0.3] * 60, [LATE], [RISING], (True, False, True)),
        ([0.3] * 60, [LATE], [CALM, RISING], (True, False, True)),
        ([0.3] * 60, [EARLY], [CALM], (True, True, False)),
        ([0.3] * 60, [EARLY, LATE], [CALM], (True, True, False)),  # the median between both: not surely
    ],
)
def test_sizes_change_rapidly_and_settle_late_where_all_three_intervals_say_so(
    monkeypatch, rates, sizes, totals, holds
):
    asked = []

    def play(policy, opponent, numbers, *, seed, config, after_step):
        asked.append((policy, opponent, [*numbers], seed, config))
        after_step.totals[:] = [totals[number % len(totals)] for number in range(60)]
        seconds = np.random.default_rng(0).permutation(60) + 10.0
        return [
            game(2 * number, seconds=float(length), captures=rate * length, sizes=sizes[number % len(sizes)])
            for number, (length, rate) in enumerate(zip(seconds, rates, strict=True))
        ]

    monkeypatch.setattr(team_sizes, "play_games", play)
    finding = team_sizes.measure(SEED)
    assert tuple(finding.parts.values()) == holds
    assert finding.supported == all(holds)
    assert finding.statistic["captures_a_second"] == pytest.approx(np.mean(rates))
    assert finding.statistic["mean_seconds"] == pytest.approx(39.5)
    assert "shorter than the 185 s" in finding.seen
    assert f"they {'' if holds[1] else 'do not '}surely become rarer" in finding.seen
    assert f"of the game, {'' if holds[2] else 'not '}surely late." in finding.seen
    assert asked == [("ring", "uniform", [*range(0, 120, 2)], SEED, GameConfig())]
    shown = finding.series["seconds"]
    assert len(shown) == 20 and shown[finding.series["bold"]] == sorted(shown)[10]


def test_games_that_are_drawn_are_not_asked_when_they_were_settled(monkeypatch):
    def play(*given, after_step, **options):
        after_step.totals[:] = [CALM, RISING]
        return [game(0, sizes=LATE), game(2, "draw", sizes=EARLY, seconds=300.0)]

    monkeypatch.setattr(team_sizes, "GAMES", 2)
    monkeypatch.setattr(team_sizes, "play_games", play)
    finding = team_sizes.measure(SEED)
    assert finding.statistic["captures_at_the_end_over_middle"] == pytest.approx((2 / 2) / (18 / 6))
    assert finding.statistic["lead_taken_after_share_of_game"] == pytest.approx(0.8)
    assert finding.statistic["mean_seconds"] == pytest.approx(155.0)
    assert ", as long as the 185 s" in finding.seen and finding.series["outcomes"] == ["win", "draw"]


def test_where_nobody_wins_nothing_settles(monkeypatch):
    monkeypatch.setattr(team_sizes, "GAMES", 2)
    monkeypatch.setattr(team_sizes, "play_games", lambda *given, **options: [game(0, "draw"), game(2, "draw")])
    finding = team_sizes.measure(SEED)
    assert finding.parts == {"sizes change rapidly": True, team_sizes.CALM: False, team_sizes.LATE: False}
    assert not finding.supported and "lead_taken_after_share_of_game" not in finding.statistic
