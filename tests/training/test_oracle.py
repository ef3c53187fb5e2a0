"""A double oracle among patterns, and a learner that begins with its best responses."""

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError, Stopped
from swarm_pz.policies.pattern import KINDS
from swarm_pz.training import imitation, oracle
from swarm_pz.training.oracle import Population, double_oracle
from swarm_pz.training.selfplay import POPULATION, League
from tests.training.runs import LEAGUE, quiet, stop

GAME = GameConfig(time_limit=20.0, drones_per_team=3)


@pytest.fixture(autouse=True)
def few_games(monkeypatch):
    for name, value in {"_GAMES": 2, "_HALVINGS": ((6, 2), (3, 2))}.items():
        monkeypatch.setattr(oracle, name, value)
    for name, value in {"_LONG": 40, "_MET": 1, "_TRIED": 2, "_AGAINST": 2}.items():
        monkeypatch.setattr(imitation, name, value)


def test_a_population_grows_by_newcomers_that_have_played_everybody_and_goes_on_where_it_stopped(tmp_path):
    whole = double_oracle(tmp_path / "whole", 2, GAME, seed=3)
    n = len(KINDS) + 2 * oracle._KEPT
    assert whole.numbers.shape == (n, 13) and len(whole.values) == 2
    np.testing.assert_allclose(whole.shares + whole.shares.T, 1.0)
    path, asked = tmp_path / "stopped", iter([False, True])
    with pytest.raises(Stopped, match="round 1 of 2"):
        double_oracle(path, 2, GAME, seed=3, should_stop=lambda: next(asked))
    again = double_oracle(path, 2, GAME, seed=3)
    np.testing.assert_array_equal(again.shares, whole.shares)
    path.write_text(path.read_text()[:-20])
    with pytest.raises(CheckpointError, match="begins anew"):
        Population.read(path)


def test_the_best_of_the_candidates_join_by_their_last_games(monkeypatch):
    worth, joined = {}, []

    def play(ours, theirs, game, seed, threads):
        for numbers in ours:
            worth.setdefault(numbers.tobytes(), len(worth) / 100)
        return np.array([worth[numbers.tobytes()] for numbers in ours])

    first = Population.first(GAME, 0)
    monkeypatch.setattr(oracle, "_play", play)
    monkeypatch.setattr(Population, "joined", lambda self, more, *_: joined.extend(more) or self)
    first.grown(GAME, 0, 1)
    assert [worth[numbers.tobytes()] for numbers in joined] == [0.05, 0.04]


def test_a_league_begins_with_an_imitation_of_best_responses_whoever_stops_it(tmp_path):
    config, said = LEAGUE.replace(oracle_rounds=1), []
    stop(League(config, tmp_path, say=quiet), 1)
    League(config, tmp_path, say=said.append).run()
    assert any("imitation 1" in line for line in said)
    league = League(config, tmp_path, say=quiet)
    patterns = [member for member in league.pool.members if member.name.startswith("pattern:")]
    assert len(patterns) == len(Population.read(tmp_path / POPULATION).numbers) == len(KINDS) + oracle._KEPT
