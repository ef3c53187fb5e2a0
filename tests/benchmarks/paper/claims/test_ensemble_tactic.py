from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import ensemble_tactic
from swarm_pz.config import GameConfig
from swarm_pz.spaces.densities import ring
from tests.benchmarks.paper.given import SEED, game, results
from tests.benchmarks.paper.test_players import LAST_ALONE

SMALL = {"GAMES": 2}
"""What makes the figure quick."""


@pytest.mark.parametrize(
    ("wins", "shown"), [((20, 20), 1), ((28, 40), 1), ((40, 28), 1), ((40, 40), 1), ((40, 0), 0), ((0, 0), None)]
)
def test_a_tactic_wins_where_it_surely_wins_more_than_half_under_all_rules(monkeypatch, wins, shown):
    asked, players, framed = [], [], []

    def play(policy, opponent, numbers, *, seed, config):
        place = len(asked) // len(ensemble_tactic.TACTICS)
        named = [*ensemble_tactic.TACTICS][len(asked) % len(ensemble_tactic.TACTICS)]
        asked.append((opponent, [*numbers], seed, config))
        players.append(policy.act(LAST_ALONE, np.arange(2)))
        won = {ensemble_tactic.SAID: wins[place], ensemble_tactic.ALONE: 0}.get(named, 50)
        # The last drone is alone for the longest in the game of pair 7.
        sizes = [[10, 15, *[19] * (30 if number == 7 else 3), 20] for number in range(50)]
        return [game(2 * number, outcome, sizes=sizes[number]) for number, outcome in enumerate(results(won, 50))]

    def frames(policy, opponent, of, seed, config):
        framed.append((opponent, of.pair, seed, config))
        return ["moments"]

    monkeypatch.setattr(ensemble_tactic, "play_games", play)
    monkeypatch.setattr(ensemble_tactic.ensemble_moments, "frames", frames)
    finding = ensemble_tactic.measure(SEED)
    assert finding.parts == {"paper": wins[0] == 40, "released": wins[1] == 40}
    assert finding.supported == (wins == (40, 40))
    rules = [GameConfig.preset("paper"), GameConfig.preset("released")]
    for name, won in zip(("paper", "released"), wins, strict=True):
        assert finding.statistic[f"win_rate_gained_by_tracking_{name}"] == pytest.approx(won / 50)
        assert finding.statistic[f"win_rate_{name}"] == won / 50
        assert finding.statistic[f"loss_rate_{name}"] == (50 - won) / 50
    assert asked == [("uniform", [*range(0, 100, 2)], SEED, config) for config in rules for _ in range(6)]
    if shown is None:
        assert finding.series["shown"] is None
    else:
        assert finding.series["shown"] == {"rules": ("paper", "released")[shown], "pair": 7, "frames": ["moments"]}
        assert framed[-1] == ("uniform", 7, SEED, rules[shown])
    said, alone, *widths, ours = players[:6]
    assert not np.allclose(said[0], said[1]) and np.allclose(alone[0], alone[1])
    np.testing.assert_array_equal(said[0], alone[0])
    # Discs are of the widths that they are called by, a ring is one.
    middle = [np.count_nonzero(each[0] > 0.5) for each in (widths[0], said, *widths[1:])]
    assert middle == sorted(middle) and middle[0] < middle[-1]
    assert ours[0][4, 4] < ours[0][4, 7] and ring(np.array(0.25)) == 1.0


def test_the_picture_stands_without_a_won_game():
    from matplotlib.figure import Figure as Canvas

    rows = [{"policy": name, "games": 2, "win": 0, "draw": 1, "loss": 1, "win_ci95": (0.0, 0.6)} for name in "ab"]
    canvas = Canvas(figsize=ensemble_tactic.FIGURE.size, layout="constrained")
    ensemble_tactic.draw(canvas, {"played": {"paper": rows, "released": rows}, "shown": None})
    canvas.draw_without_rendering()
