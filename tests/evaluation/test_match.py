"""Matches: both sides, the same seeds for both, and figures that follow from the games."""

import dataclasses
import json

import numpy as np
import pytest
from scipy.stats import binomtest

from swarm_pz import policies
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import CommandError
from swarm_pz.evaluation.match import MatchResult, paired_difference, play_match
from swarm_pz.evaluation.rollout import Game

SHORT = GameConfig(time_limit=30.0, drones_per_team=3)
TINY = SHORT.replace(time_limit=5.0)


class Ones:
    """Covers evenly; keeps the seeds that it is given."""

    observation = ObservationConfig(grid=10)
    name = "ones"

    def reset(self, seeds, rows):
        self.seeds = list(seeds)

    def act(self, observations, rows):
        return np.ones((len(rows), 10, 10))


def game(pair, side, outcome, end, **more):
    usual = {"share": float(outcome == "win"), "seconds": 9.0}
    return Game(
        pair=pair, side=side, outcome=outcome, captures=0, recaptures=0, fingerprint=end, sizes=[3], **usual | more
    )


def result(*games, **more):
    fields = {"policy": "a", "opponent": "b", "seed": 0, "config": SHORT, "limit_s": 30.0} | more
    return MatchResult(games=list(games), **fields)


def starts_of(policy, opponent, **match):
    """Play a match; return the seeds of its starts."""
    starts, reset = [], BatchEnv.reset
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BatchEnv, "reset", lambda env, seeds, **more: starts.extend(seeds) or reset(env, seeds, **more))
        play_match(policy, opponent, **match)
    return starts


def test_figures_agree_with_the_games_and_are_written(tmp_path):
    match = play_match("ring", "uniform", games=12, config=SHORT, threads=2)
    assert [(game.pair, game.side) for game in match.games] == [(n // 2, ("red", "blue")[n % 2]) for n in range(12)]
    for one in match.games:
        assert one.outcome == ("win" if one.share == 1 else "loss" if one.share == 0 else "draw")
        assert len(one.sizes) == int(np.ceil(one.seconds)) + 1
        assert one.sizes[-1] == round(6 * (one.share if one.side == "red" else 1 - one.share))
    mirrored = dataclasses.replace(match, games=[dataclasses.replace(one, outcome="loss") for one in match.games])
    mirrored.write(tmp_path / "folder" / "figures.json")
    written = json.loads((tmp_path / "folder" / "figures.json").read_text())
    assert written.pop("lost") == [{"pair": one.pair, "side": one.side, "seconds": one.seconds} for one in match.games]
    story = {name: written.pop(name) for name in ("rules", "versions", "command")}
    assert written == mirrored.summary()
    assert GameConfig.from_dict(story["rules"]).rules_hash == written["rules_hash"] == SHORT.rules_hash


def test_a_pair_that_is_the_same_game_twice_counts_once():
    twice = [game(0, "red", "win", b"0"), game(0, "blue", "loss", b"0")]
    others = [game(1, "red", "win", b"0"), game(1, "blue", "win", b"2")]
    match = result(*twice, *others)
    assert match.unique == [twice[0], *others] and (match.score(), match.standing()) == (1.0, "3-0-0")
    lost = result(game(0, "red", "loss", b"0"), game(0, "blue", "win", b"0"), game(1, "red", "draw", b"1"))
    # If all games that count are won, or none, a bootstrap interval has no width.
    for of_these, won, count in ((match, 3, 3), (lost, 0, 2)):
        interval = binomtest(won, count).proportion_ci(method="wilson")
        assert of_these.win_rate_interval() == pytest.approx((interval.low, interval.high))
    summary = play_match("uniform", "uniform", games=8, config=TINY).summary()
    assert summary["games"] == summary["unique_games"] == 4 and summary["mean_share"] == pytest.approx(0.5)


def test_a_summary_says_of_every_number_whose_it_is():
    match = result(
        game(0, "red", "win", b"0", share=1.0, thinking_ms=(1.0, 10.0)),
        game(0, "blue", "loss", b"0", share=0.0, thinking_ms=(3.0, 20.0)),  # the same game
        game(1, "red", "draw", b"1", share=0.5, seconds=20.0, thinking_ms=(2.0, 30.0)),
        game(1, "blue", "draw", b"2", share=0.7, seconds=20.0, thinking_ms=(2.0, 40.0)),
        game(2, "red", "loss", b"3", share=0.0, seconds=8.0, thinking_ms=(2.0, 0.0)),
        game(2, "blue", "draw", b"1", share=0.8, seconds=20.0, thinking_ms=(2.0, 20.0)),
        seed=7,
        privileged=("b",),
    )
    summary = match.summary()
    low, high = summary.pop("win_rate_ci95")
    assert 0.0 <= low < 0.2 < high <= 1.0
    low, high = summary.pop("mean_share_ci95")
    assert 0.4 <= low < 0.5 < high <= 0.6  # pairs' means are 0.5, 0.6 and 0.4
    assert summary == {
        "policy": "a", "opponent": "b", "privileged": ["b"], "seed": 7, "games": 5, "unique_games": 4,
        "wins": 1, "draws": 3, "losses": 1, "win_rate": 0.2, "mean_share": pytest.approx(3.0 / 6),
        "median_seconds": 30.0, "restricted_mean_seconds": pytest.approx((9.0 + 3 * 30.0 + 8.0) / 5),
        "time_limit": 30.0, "thinking_ms": [2.0, 20.0], "config_hash": SHORT.hash, "rules_hash": SHORT.rules_hash,
    }  # fmt: skip
    assert match.score() == pytest.approx((1 + 3 * 0.5) / 5)


def test_start_policy_and_opponent_have_a_stream_each_that_both_games_of_a_pair_share():
    policy, opponent = Ones(), Ones()
    starts = starts_of(policy, opponent, games=4, config=SHORT.replace(time_limit=1.0))
    streams = (starts, policy.seeds, opponent.seeds)
    firsts = np.array([[np.random.default_rng(seed).random() for seed in seeds] for seeds in streams])
    np.testing.assert_array_equal(firsts[:, ::2], firsts[:, 1::2])
    assert len(np.unique(firsts)) == 6, "three streams of each of two pairs"


def test_matches_repeat_and_do_not_depend_on_batch_or_threads(monkeypatch):
    one = play_match("blind_ring", "noise", games=6, seed=3, config=TINY)
    monkeypatch.setattr("swarm_pz.evaluation.match._BATCH", 4)
    assert one.games == play_match("blind_ring", "noise", games=6, seed=3, config=TINY, threads=2).games
    assert one.games != play_match("blind_ring", "noise", games=6, seed=4, config=TINY).games
    noise = policies.load("noise", TINY)
    same = [play_match(player, player, games=2, config=TINY).games for player in (noise, "noise")]
    assert same[0] == same[1]


@pytest.mark.parametrize("controllers", [("ergodic", "ergodic"), ("ergodic", "flocking")])
def test_a_match_is_the_same_whichever_player_is_called_the_policy(controllers):
    """Players who change sides take their controllers along."""
    one = play_match("ring", "uniform", games=4, config=TINY.replace(controllers=controllers))
    other = play_match("uniform", "ring", games=4, config=TINY.replace(controllers=controllers[::-1]))
    for number, mine in enumerate(one.games):
        theirs = other.games[number ^ 1]
        assert (mine.fingerprint, mine.sizes) == (theirs.fingerprint, theirs.sizes)
    assert one.unique == one.games, "no two of these games are the same"


def test_differences_are_paired_where_opponent_seeds_and_rules_are_the_same():
    shares = np.random.default_rng(0).random((2, 20))
    ring, noise = (
        result(*(game(n // 2, ("red", "blue")[n % 2], "draw", b"%d" % n, share=share) for n, share in enumerate(row)))
        for row in shares
    )
    difference, low, high = paired_difference(ring, noise)
    assert low <= difference <= high and difference == pytest.approx((shares[0] - shares[1]).mean())
    assert paired_difference(ring, noise) == (difference, low, high)
    coarse = dataclasses.replace(noise, config=SHORT.replace(observation=ObservationConfig(grid=10)))
    assert paired_difference(noise, coarse) == (0.0, 0.0, 0.0), "what is seen is no rule"
    for other in ({"opponent": "ring"}, {"seed": 1}, {"games": noise.games[:18]}, {"config": TINY}):
        with pytest.raises(CommandError, match="must share"):
            paired_difference(ring, dataclasses.replace(noise, **other))


def test_the_game_itself_has_its_order():
    """noise <= uniform < ring against uniform: what makes this a benchmark."""
    noise, ring = (play_match(name, "uniform", games=n, seed=5, threads=2) for name, n in (("noise", 6), ("ring", 30)))
    assert ring.share() > 0.65 and ring.share_interval()[0] > 0.5, "uniform's own share against itself is one half"
    assert noise.share_interval()[0] < 0.5
    assert ring.summary()["win_rate"] > 0.5
