"""How a policy is attacked: what a candidate is worth, and how an exploiter learns."""

from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import ObservationConfig
from swarm_pz.evaluation.workers import SerialExecutor
from swarm_pz.standard import attacks
from swarm_pz.standard.games import PlayerFactory, attacked
from swarm_pz.training.config import TrainConfig

GAMES = {
    "siege wins": ([[2.0, 0.0, 0.0]], [0.0, 0.0]),
    "siege draws": ([[0.0, 2.0, 0.0]], [0.25, 0.25]),
    "siege loses": ([[0.0, 0.0, 2.0]], [1.0, 1.0]),
    "siege shares": ([[1.0, 0.0, 1.0]], [0.5, 1.0]),
}
"""Games that a candidate won, drew and lost in each pair, and the entry's shares of the drones."""


def test_a_candidate_is_worth_its_points_and_its_share_on_seeds_that_no_report_plays(tiny, tmp_path, monkeypatch):
    begun, shown = [], []

    class Played:
        def __init__(self, track, protocol, factory, folder, *, attackers):
            begun.append((track, attackers))

        def play(self, *, pool, progress, should_stop):
            progress(1.0, 2.0)

        def tally(self, name, one):
            assert one == "entry 1"
            return np.array(GAMES[name][0])

        def between(self, name, one):
            return [SimpleNamespace(share=share) for share in GAMES[name][1]]

    def search(score, **given):
        assert given == {"generations": 2, "candidates": 4, "seed": tiny.robust.seed + 1, "prefix": "siege"}
        return score(list(GAMES)), score(["siege draws"])

    monkeypatch.setattr(attacks, "TrackGames", Played)
    monkeypatch.setattr(attacks, "search", search)
    how = {"pool": SerialExecutor(), "show": lambda *done: shown.append(done), "should_stop": lambda: False}
    values = attacks.find(1, tiny, PlayerFactory(("ring", "halo")), tmp_path, **how)
    assert values == ([1.0, 0.625, 0.0, 0.375], [0.625])
    (track, attackers), *_ = begun
    assert attackers == [(1, name) for name in GAMES] and track.games == tiny.robust.search_games
    assert track.seed != attacked(tiny).seed
    assert [done for done, _ in shown] == [1, tiny.robust.search_games + 1]


def test_an_exploiter_learns_by_the_protocol_and_sees_as_its_target_does(tiny, tmp_path, monkeypatch):
    class EnoughError(Exception):
        pass

    given = {}

    def make(policy, folder, **options):
        given.update(options, policy=policy)
        raise EnoughError

    target, seen = policies.load("champion"), ObservationConfig(grid=50)
    theirs = TrainConfig.from_dict(target.card["training"])
    theirs = theirs.replace(game=theirs.game.replace(observation=seen), width=24, action_cells=5)
    target.card = target.card | {"training": theirs.to_dict()}
    monkeypatch.setattr(policies, "load", lambda *_: target)
    monkeypatch.setattr("swarm_pz.training.exploit.make_exploiter", make)
    with pytest.raises(EnoughError):
        attacks.learn("champion", 3, tiny, tmp_path / "work", lambda: False, print, target.digest)
    learner = given["learner"]
    assert given["policy"] == "champion" and learner.game.rules_hash == tiny.game.rules_hash
    assert (given["resume"], given["steps"], given["seed"]) == (False, 256, tiny.robust.seed + 3)
    assert (learner.game.observation, learner.width, learner.action_cells, learner.threads) == (seen, 24, 5, 1)
