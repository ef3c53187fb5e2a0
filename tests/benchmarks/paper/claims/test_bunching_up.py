from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import bunching_up
from benchmarks.paper.players import Fixed
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.rollout import Rollout
from tests.benchmarks.paper.given import SEED

SMALL = {"GAMES": 2, "SIGMAS": (0.1, 0.3, None), "WATCHED": 8.0}
"""What makes the figure quick."""


@pytest.mark.parametrize(
    ("compact", "spread", "holds"),
    [
        ((30, 0), (5, 2), True),
        ((2, 30), (5, 2), True),  # the better way to aim counts
        ((30, 0), (0, 28), False),  # more, not surely
        ((6, 6), (0, 0), False),  # more than one in ten, not surely
        ((0, 0), (0, 0), False),
    ],
)
def test_to_bunch_up_is_a_risk_where_compact_teams_are_surely_lost_whole_and_more_often_than_spread_ones(
    monkeypatch, compact, spread, holds
):
    played = []

    class Unplayed:
        def __init__(self, aimer, holder, numbers, *, seed, config):
            assert ([*numbers], seed, config) == ([*range(0, 100, 2)], SEED, GameConfig())
            self.aimer, self.command = aimer, holder.act(None, np.zeros(1))[0]

        def play(self, seconds, *, after_control_period):
            assert seconds == 60.0 and after_control_period.rollout is self
            played.append((self.command, self.aimer))

    class Told:
        def __init__(self, rollout):
            self.rollout, self.spread = rollout, np.full(50, 0.1)

        def whole_within(self, seconds):
            assert seconds == 5.0
            sigma = bunching_up.SIGMAS[(len(played) - 1) // 2]
            by_way = compact if sigma and sigma <= 0.15 else spread if not sigma or sigma >= 0.25 else (25, 25)
            return np.arange(50) < by_way[("chase", "ring").index(self.rollout.aimer)]

    monkeypatch.setattr(bunching_up, "Rollout", Unplayed)

    def place(rollout, density, seed):
        assert seed == SEED
        np.testing.assert_array_equal(density, rollout.command)

    monkeypatch.setattr(bunching_up, "place_blue", place)
    monkeypatch.setattr(bunching_up, "Losses", Told)
    finding = bunching_up.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic == {
        "all_at_once_compact": pytest.approx(max(compact) / 50),
        "all_at_once_spread": pytest.approx(max(spread) / 50),
        "difference": pytest.approx((max(compact) - max(spread)) / 50),
    }
    assert [aimer for _, aimer in played] == ["chase", "ring"] * 8
    for (command, _), sigma in zip(played[::2], bunching_up.SIGMAS, strict=True):
        np.testing.assert_array_equal(command, bunching_up.disc(sigma, 10))
    assert finding.series["rows"][0]["lost"] == [*compact] and finding.series["rows"][-1]["lost"] == [*spread]


def test_blue_starts_in_its_disc_and_red_where_it_would_have():
    numbers, command = [0, 2], bunching_up.disc(0.05, 10)
    rollout, other = (Rollout("chase", Fixed(command), numbers, seed=SEED) for _ in range(2))
    bunching_up.place_blue(rollout, command, SEED)
    found, before = rollout.simulator.positions, other.simulator.positions
    np.testing.assert_array_equal(found[:, :10], before[:, :10])
    assert np.abs(found[:, 10:] - 0.5).max() <= 0.2 and not np.array_equal(found[0, 10:], found[1, 10:])
    bunching_up.place_blue(other, command, SEED)
    np.testing.assert_array_equal(found, other.simulator.positions)
    assert rollout.batch.running.all() and (rollout.simulator.teams[:, 10:] == 1).all()


def test_blue_starts_on_the_side_of_the_square_that_it_holds():
    command = np.zeros((10, 10))
    command[1, 8] = 1.0  # y = 0.1 to 0.2, x = 0.8 to 0.9
    rollout = Rollout("chase", Fixed(command), [0], seed=SEED)
    bunching_up.place_blue(rollout, command, SEED)
    x, y = rollout.simulator.positions[0, 10:].T
    assert (x >= 0.8).all() and (x <= 0.9).all() and (y >= 0.1).all() and (y <= 0.2).all()


def test_discs_are_as_wide_as_they_are_called_and_none_is_the_whole_square():
    command = bunching_up.disc(0.1, 10)
    assert command.max() == 1.0
    assert command[4, 7] / command[4, 4] == pytest.approx(np.exp(-(0.25**2 - 0.05**2) / (2 * 0.1**2)))
    np.testing.assert_array_equal(bunching_up.disc(None, 10), np.ones((10, 10)))


def test_every_disc_but_those_between_is_of_a_team_close_together_or_spread():
    assert [*map(bunching_up.is_compact, (0.05, 0.15, 0.2, 0.25, None))] == [True, True, False, False, False]
    assert [*map(bunching_up.is_spread, (0.05, 0.15, 0.2, 0.25, None))] == [False, False, False, True, True]


def test_the_share_is_that_of_the_better_way_to_aim_over_all_discs_of_a_kind():
    lost = np.zeros((4, 2, 2))
    lost[:, 0, 0] = 1  # the one disc always falls to the first way
    lost[:3, :, 1] = 1  # both fall to the second in three of four
    assert bunching_up.better_share(lost) == 0.75
