from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import ResultsError
from swarm_pz.policies.scripted import ring
from swarm_pz.standard.games import siege_of
from swarm_pz.standard.siege import HIGH, LOW, search, siege


def asked(tactic, seed=0):
    config = GameConfig()
    with np.errstate(all="raise"):
        batch = BatchEnv(config, 2)
        batch.reset([seed, seed + 1])
        policy = tactic(config)
        policy.reset([1, 2], np.arange(2))
        return batch.ask(policy, np.zeros(2, np.int64), np.arange(2))


def test_the_ring_is_one_of_the_family():
    np.testing.assert_allclose(asked(siege((1, 0, 0.25, 0.08, 0, 10, 0, 0))), asked(ring), atol=1e-12)


@pytest.mark.parametrize("numbers", [LOW, HIGH])
def test_the_corners_of_the_family_are_densities(numbers):
    densities = asked(siege(numbers))
    assert densities.max() == 1.0 and densities.min() >= 0.0


@pytest.mark.parametrize(
    "name", ["siege", "siege 1 2", "siege a b c d e f g h", "siege 9 9 9 9 9 9 9 9", "siege nan 0 0 0.1 0 5 0 0"]
)
def test_a_name_that_is_no_tactic_is_refused(name):
    with pytest.raises(ResultsError, match="names no tactic of the search"):
        siege_of(name)


def test_a_search_finds_what_is_best_and_the_same_twice():
    def score(names):
        return [-sum((float(word) - 0.5) ** 2 for word in name.split()[3:5]) for name in names]

    found = [search(score, prefix="siege", generations=12, candidates=12, seed=3) for _ in range(2)]
    assert found[0] == found[1]
    assert score(found)[0] > -0.2
    siege_of(found[0])
