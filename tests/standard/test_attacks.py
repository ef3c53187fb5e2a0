"""Attacks on a policy: the score of a candidate, and the training of an exploiter."""

from types import SimpleNamespace

import pytest

from swarm_pz.evaluation.workers import SerialExecutor
from swarm_pz.standard import attacks
from swarm_pz.standard.games import PlayerFactory, attacked
from swarm_pz.training import ppo
from swarm_pz.training.exploit import exploiter_config, fixed_learner

GAMES = {
    "siege wins": [("loss", 0.0), ("loss", 0.0)],
    "siege draws": [("draw", 0.25), ("draw", 0.25)],
    "siege loses": [("win", 1.0), ("win", 1.0)],
    "siege shares": [("loss", 0.5), ("win", 1.0)],
}
"""Ends of the entry's games against a candidate, and its shares of the drones."""


def test_a_candidate_is_worth_what_the_entry_does_not_win_on_seeds_that_no_report_plays(tiny, tmp_path, monkeypatch):
    begun, shown = [], []

    class Played:
        def __init__(self, track, protocol, factory, folder, *, attackers):
            begun.append((track, attackers))

        def play(self, *, pool, progress, should_stop):
            progress(1.0, 2.0)

        def between(self, name, one):
            assert one == "entry 1"
            return [SimpleNamespace(outcome=outcome, share=share) for outcome, share in GAMES[name]]

    def search(score, **given):
        assert given == {"generations": 2, "candidates": 4, "seed": tiny.robust.seed + 1, "prefix": "siege"}
        return score(list(GAMES)), score(["siege draws"])

    monkeypatch.setattr(attacks, "TrackGames", Played)
    monkeypatch.setattr(attacks, "search", search)
    how = {"pool": SerialExecutor(), "show": lambda *done: shown.append(done), "should_stop": lambda: False}
    values = attacks.find(1, tiny, PlayerFactory(("ring", "halo")), tmp_path, **how)
    assert values == ([1.0, 0.875, 0.0, 0.375], [0.875])
    (track, attackers), *_ = begun
    assert attackers == [(1, name) for name in GAMES] and track.games == tiny.robust.search_games
    assert track.seed != attacked(tiny).seed
    assert [done for done, _ in shown] == [1, tiny.robust.search_games + 1]


def test_an_exploiter_learns_by_the_protocol_and_the_settings_whose_figures_compare(tiny, tmp_path, monkeypatch):
    given = []

    def make(config, folder, **_):
        given.append(config)
        raise KeyboardInterrupt

    monkeypatch.setattr(ppo, "Training", make)
    with pytest.raises(KeyboardInterrupt):
        attacks.learn("champion", 3, tiny, tmp_path / "work", lambda: False, print)
    learner = fixed_learner("champion", tiny.game, 256)
    assert given == [exploiter_config("champion", learner, steps=256, seed=3)]
