"""The search for patterns that beat a policy."""

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError, Stopped
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.rollout import FaultError
from swarm_pz.evaluation.workers import SerialExecutor
from swarm_pz.policies.pattern import KINDS, PatternPlayer, points_of
from swarm_pz.training import search as searches
from swarm_pz.training.search import Target, search, search_against, worth

GAME = GameConfig(time_limit=40.0, drones_per_team=4)
RING = Target("ring", GAME)
LAP, SPOT = (np.array([list(KINDS[kind].values())]) for kind in ("lap", "spot"))


def test_patterns_are_worth_their_share_of_the_drones_whoever_plays_beside_them():
    both = np.concatenate([LAP, SPOT])
    for numbers, share in zip(both, worth(0, RING, both, 6, 5), strict=True):
        games = play_match(PatternPlayer(numbers[None], GAME), "ring", games=6, seed=5, config=GAME).games
        assert share == np.mean([one.share for one in games])


def test_a_search_that_is_stopped_says_so():
    stops, shown = iter([False] * 7), []
    options = {"games": 2, "generations": 1, "candidates": 4, "seed": 3, "pool": SerialExecutor()}
    with pytest.raises(Stopped, match="begins again"):
        search_against(RING, should_stop=lambda: next(stops, True), **options)
    assert len(search_against(RING, show=lambda *done: shown.append(done), **options)) == 3
    rounds = len(KINDS) + 2  # a generation from each of the two best kinds
    assert shown == [(number, rounds) for number in range(1, rounds + 1)]


@pytest.mark.parametrize("place", [0, 1])
def test_a_policy_that_fails_loses_to_whatever_attacks_it(place, monkeypatch):
    def fail(rollout):
        raise FaultError(place, "broke")

    monkeypatch.setattr(searches.Rollout, "play", fail)
    if place:
        assert worth(0, RING, LAP, 2, 0).tolist() == [1.0]
    else:
        with pytest.raises(PolicyError, match="broke"):
            worth(0, RING, LAP, 2, 0)


def test_a_search_finds_what_is_best_and_the_same_twice():
    def score(numbers):
        return -((points_of(numbers) - 0.7) ** 2).sum(axis=1)

    found = [search(score, generations=40, candidates=12, seed=seed) for seed in (3, 3, 4)]
    assert found[0] == found[1] != found[2] and len(found[0]) == 3
    numbers = np.array([list(map(float, name.partition(":")[2].split())) for name in found[0]])
    assert score(numbers).tolist() == sorted(score(numbers), reverse=True) and score(numbers)[0] > -0.1
