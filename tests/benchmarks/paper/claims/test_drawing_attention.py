from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import drawing_attention
from swarm_pz.config import GameConfig, ObservationConfig
from tests.benchmarks.paper.given import SEED

SMALL = {"GAMES": 2, "SECONDS": 4, "DRAWING": (0, 3)}
"""What makes the figure quick."""


class Counter:
    """Answers with a density that says when it was asked."""

    observation = ObservationConfig()

    def __init__(self):
        self.asked = []

    def reset(self, seeds, rows):
        self.asked = []

    def act(self, observations, rows):
        self.asked.append(len(rows))
        return np.full((len(rows), 2, 2), float(observations[0]))


@pytest.mark.parametrize(
    ("seconds", "sent"), [(0, [0, 1, 2, 3, 4, 5, 6]), (1, [1, 0, 1, 2, 3, 4, 5]), (3, [1, 1, 1, 0, 0, 0, 3])]
)
def test_what_is_sent_answers_what_was_seen_when_it_was_begun_and_stays_until_the_next_is_drawn(seconds, sent):
    # Before anything is drawn, uniform coverage: ones.
    tactic = Counter()
    drawer = drawing_attention.Drawer(tactic, seconds)
    for _ in range(2):  # the next games begin anew
        drawer.reset([0, 1], np.arange(2))
        found = [drawer.act(np.full(2, step), np.arange(2))[0, 0, 0] for step in range(len(sent))]
        assert found == sent
        assert len(tactic.asked) == -(-len(sent) // max(seconds, 1)), "it looks only when it begins"


def test_games_that_end_leave_the_others_their_drawings():
    drawer = drawing_attention.Drawer(Counter(), 2)
    drawer.reset([0, 1, 2], np.arange(3))
    rows = np.arange(3)
    for step in range(5):
        if step == 3:
            rows = np.array([2])
        found = drawer.act(np.full(len(rows), step), rows)
        assert found.shape == (len(rows), 2, 2)
    assert found[0, 0, 0] == 2


def test_who_commands_as_seldom_without_looking_away_answers_what_is_seen_then():
    drawer = drawing_attention.Drawer(Counter(), 3, "send")
    drawer.reset([0], np.arange(1))
    assert [drawer.act(np.full(1, step), np.arange(1))[0, 0, 0] for step in range(7)] == [0, 0, 0, 3, 3, 3, 6]


@pytest.mark.parametrize(
    ("more", "apart", "holds"),
    [((3.0, 3.0), 1.0, True), ((3.0, -0.5), 1.0, False), ((-3.0, 3.0), 1.0, False), ((0.4, 3.0), 9.0, False)],
)
def test_drawing_costs_drones_where_more_are_surely_lost_against_both(monkeypatch, more, apart, holds):
    asked = []

    def tally(seconds, opponent, seed, looks="begin"):
        asked.append((seconds, opponent, seed, looks))
        lost = np.full(100, 10.0)
        if seconds == drawing_attention.JUDGED:
            lost += 1.0
        if seconds == drawing_attention.JUDGED and looks == "begin":
            lost += (
                more[drawing_attention.OPPONENTS.index(opponent)] + apart * np.where(np.arange(100) % 2, 1, -1) - 1.0
            )
        return np.stack([lost, np.full(100, 30.0), np.full(100, 0.4)], axis=1)

    monkeypatch.setattr(drawing_attention, "tally", tally)
    finding = drawing_attention.measure(SEED)
    assert finding.supported == holds
    surely = [gain > 0.2 * apart for gain in more]
    assert finding.parts == dict(zip(("against ring", "against uniform"), surely, strict=True))
    for name, gain in zip(drawing_attention.OPPONENTS, more, strict=True):
        statistic = finding.statistic
        assert statistic[f"more_lost_a_minute_by_3_s_of_drawing_against_{name}"] == pytest.approx(2 * gain)
        assert statistic[f"more_lost_a_minute_by_looking_away_for_3_s_against_{name}"] == pytest.approx(2 * gain - 2)
        for looks, lost in (("begin", 10.0 + gain), ("send", 11.0)):
            drawn = finding.series[name][looks]
            at_once, judged = drawn["lost"][0], drawn["lost"][drawing_attention.DRAWING.index(3)]
            assert (
                at_once == [20.0] * 3 and judged[0] == pytest.approx(2 * lost) and judged[1] <= judged[0] <= judged[2]
            )
            assert drawn["share"] == [[0.4] * 3] * 6
    assert ("So it loses fewer." in finding.seen) == (min(more) < -0.2 * apart)
    assert len(asked) == len(set(asked)) == 22 and {seed for _, _, seed, _ in asked} == {SEED}


def test_of_games_the_drones_that_the_other_side_took_are_counted(monkeypatch):
    monkeypatch.setattr(drawing_attention, "GAMES", 3)
    monkeypatch.setattr(drawing_attention, "SECONDS", 12)
    played = []

    class Kept(drawing_attention.Rollout):
        def play(self, seconds):
            super().play(seconds)
            played.append(self)

    monkeypatch.setattr(drawing_attention, "Rollout", Kept)
    lost, seconds, share = drawing_attention.tally(3, "ring", SEED).T
    (rollout,) = played
    assert rollout.names() == ("drawer-3-begin", "ring") and rollout.config == GameConfig()
    taken = rollout.simulator.games.captures
    assert lost.tolist() == taken[:, 1].tolist() and (lost + taken[:, 0]).sum() > 0
    assert (20 * share).tolist() == pytest.approx((10 + taken[:, 0] - taken[:, 1]).tolist())
    assert seconds.tolist() == [12.0] * 3
