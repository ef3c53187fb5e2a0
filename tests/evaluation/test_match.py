from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from scipy.stats import binomtest

from swarm_pz import policies
from swarm_pz.config import CaptureConfig, GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import CommandError, ConfigError, PolicyError
from swarm_pz.evaluation.match import MatchResult, paired_difference, play_match
from swarm_pz.evaluation.rollout import _MATCH, Game
from tests.envs.test_gymnasium_env import Nonsense

SHORT = GameConfig(time_limit=30.0, drones_per_team=3)


def test_figures_agree_with_the_games():
    match = play_match("ring", "uniform", games=40, config=SHORT, threads=2)
    summary = match.summary()
    outcomes = [game.outcome for game in match.games]
    assert summary["games"] == summary["unique_games"] == 40
    assert [summary["wins"], summary["draws"], summary["losses"]] == [
        outcomes.count(outcome) for outcome in ("win", "draw", "loss")
    ]
    seconds = [30.0 if game.outcome == "draw" else game.seconds for game in match.games]
    assert summary["restricted_mean_seconds"] == pytest.approx(np.mean(seconds))
    assert summary["median_seconds"] == pytest.approx(np.median(seconds))
    interval = binomtest(summary["wins"], 40).proportion_ci(method="wilson")
    assert summary["win_rate_ci95"] == pytest.approx([interval.low, interval.high])
    assert summary["config_hash"] == SHORT.hash
    for game in match.games:
        assert game.outcome == ("win" if game.share == 1 else "loss" if game.share == 0 else "draw")
        assert len(game.sizes) == int(np.ceil(game.seconds)) + 1
        red = game.share if game.side == "red" else 1 - game.share
        assert game.sizes[-1] == round(6 * red)


def test_half_of_the_games_are_played_from_each_side_with_the_same_seeds():
    match = play_match("ring", "uniform", games=8, config=SHORT)
    assert [game.side for game in match.games] == ["red", "blue"] * 4
    assert [game.pair for game in match.games] == [0, 0, 1, 1, 2, 2, 3, 3]


def test_a_pair_that_is_the_same_game_twice_counts_once():
    summary = play_match("uniform", "uniform", games=20, config=SHORT).summary()
    assert summary["games"] == summary["unique_games"] == 10
    assert sum(summary[outcome] for outcome in ("wins", "draws", "losses")) == 10
    low, high = summary["win_rate_ci95"]
    assert low <= summary["win_rate"] <= high
    assert low < high
    assert summary["mean_share"] == pytest.approx(0.5)


def test_the_score_counts_a_pair_that_is_the_same_game_twice_once():
    def game(pair, side, outcome, end):
        return Game(
            pair=pair,
            side=side,
            outcome=outcome,
            share=float(outcome == "win"),
            seconds=9.0,
            captures=3,
            recaptures=0,
            fingerprint=end,
            sizes=[3],
        )

    twice = [game(0, "red", "win", b"0"), game(0, "blue", "loss", b"0")]
    others = [game(1, "red", "win", b"1"), game(1, "blue", "win", b"2")]
    match = MatchResult(policy="a", opponent="b", seed=0, config=SHORT, limit_s=30.0, games=twice + others)
    assert match.unique == [twice[0], *others]
    assert match.score() == 1.0
    assert match.standing() == "3-0-0"
    # All that count are won: a bootstrap would be certain of it.
    interval = binomtest(3, 3).proportion_ci(method="wilson")
    assert match.win_rate_interval() == pytest.approx((interval.low, interval.high))
    lost = MatchResult(
        policy="a", opponent="b", seed=0, config=SHORT, limit_s=30.0,
        games=[game(0, "red", "loss", b"0"), game(0, "blue", "win", b"0"), game(1, "red", "draw", b"1")],
    )  # fmt: skip
    interval = binomtest(0, 2).proportion_ci(method="wilson")
    assert lost.win_rate_interval() == pytest.approx((interval.low, interval.high))


def test_a_summary_says_of_every_number_whose_it_is():
    def game(pair, side, outcome, end, **other):
        return Game(
            pair=pair, side=side, outcome=outcome, captures=0, recaptures=0, fingerprint=end, sizes=[3], **other
        )

    games = [
        game(0, "red", "win", b"0", share=1.0, seconds=9.0, thinking_ms=(1.0, 10.0)),
        game(0, "blue", "loss", b"0", share=0.0, seconds=9.0, thinking_ms=(3.0, 20.0)),  # the same game
        game(1, "red", "draw", b"1", share=0.5, seconds=20.0, thinking_ms=(2.0, 30.0)),
        game(1, "blue", "draw", b"2", share=0.7, seconds=20.0, thinking_ms=(2.0, 40.0)),
        game(2, "red", "loss", b"3", share=0.0, seconds=8.0, thinking_ms=(2.0, 0.0)),
        game(2, "blue", "draw", b"1", share=0.8, seconds=20.0, thinking_ms=(2.0, 20.0)),
    ]
    match = MatchResult(policy="a", opponent="b", seed=7, config=SHORT, limit_s=30.0, games=games, privileged=("b",))
    found = match.summary()
    low, high = found.pop("win_rate_ci95")
    assert 0.0 <= low < 0.2 < high <= 1.0
    low, high = found.pop("mean_share_ci95")
    assert 0.4 <= low < 0.5 < high <= 0.6  # pairs' means are 0.5, 0.6 and 0.4
    assert found == {
        "policy": "a", "opponent": "b", "privileged": ["b"], "seed": 7, "games": 5, "unique_games": 4,
        "wins": 1, "draws": 3, "losses": 1, "win_rate": 0.2, "mean_share": pytest.approx(3.0 / 6),
        "median_seconds": 30.0, "restricted_mean_seconds": pytest.approx((9.0 + 3 * 30.0 + 8.0) / 5),
        "time_limit": 30.0, "thinking_ms": [2.0, 20.0], "config_hash": SHORT.hash, "rules_hash": SHORT.rules_hash,
    }  # fmt: skip
    assert match.standing() == "1-3-1"
    assert match.score() == pytest.approx((1 + 3 * 0.5) / 5)


def test_a_match_tells_how_far_it_is_and_who_sees_the_simulator(monkeypatch):
    class Seer:
        name = "seer"

        def reset(self, seeds, rows):
            pass

        def plan(self, simulator, teams, rows):
            return np.ones((len(rows), 10, 10))

    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr("swarm_pz.evaluation.match._BATCH", 4)
    threads, play = [], BatchEnv.step_checked
    monkeypatch.setattr(
        BatchEnv, "step_checked", lambda env, *given: threads.append(env.simulator.threads) or play(env, *given)
    )
    config, told = SHORT.replace(time_limit=2.0, capture=CaptureConfig(enabled=False)), []
    match = play_match("uniform", Seer(), games=6, config=config, threads=2, progress=lambda *now: told.append(now))
    assert match.privileged == ("seer",) == tuple(match.summary()["privileged"])
    assert play_match(Seer(), "uniform", games=2, config=config).privileged == ("seer",)
    assert told == [(0, 6), (4, 6), (4, 6), (6, 6)]
    assert set(threads[: len(told)]) == {2}


def test_start_policy_and_opponent_have_a_stream_each_that_both_games_of_a_pair_share(monkeypatch):
    class Keeper:
        observation = ObservationConfig(grid=10)
        name = "keeper"

        def reset(self, seeds, rows):
            self.seeds = list(seeds)

        def act(self, observations, rows):
            return np.ones((len(rows), 10, 10))

    starts, reset = [], BatchEnv.reset

    def noting(batch, seeds, **others):
        starts.extend(seeds)
        reset(batch, seeds, **others)

    monkeypatch.setattr(BatchEnv, "reset", noting)
    policy, opponent = Keeper(), Keeper()
    play_match(policy, opponent, games=4, config=SHORT.replace(time_limit=1.0))
    streams = (starts, policy.seeds, opponent.seeds)
    firsts = np.array([[np.random.default_rng(seed).random() for seed in seeds] for seeds in streams])
    np.testing.assert_array_equal(firsts[:, ::2], firsts[:, 1::2])
    assert len(np.unique(firsts)) == 6, "three streams of each of two pairs"


def test_matches_repeat_and_do_not_depend_on_batch_or_threads(monkeypatch):
    one = play_match("blind_ring", "noise", games=10, seed=3, config=SHORT)
    monkeypatch.setattr("swarm_pz.evaluation.match._BATCH", 4)
    other = play_match("blind_ring", "noise", games=10, seed=3, config=SHORT, threads=2)
    assert one.games == other.games
    assert one.games != play_match("blind_ring", "noise", games=10, seed=4, config=SHORT).games


def test_a_match_with_sides_exchanged_is_the_mirror_image():
    one = play_match("ring", "uniform", games=6, config=SHORT)
    other = play_match("uniform", "ring", games=6, config=SHORT)
    for game, mirrored in zip(one.games[::2], other.games[1::2], strict=True):
        assert game.share == pytest.approx(1 - mirrored.share)


@pytest.mark.parametrize("controllers", [("ergodic", "flocking"), ("flocking", "ergodic")])
def test_players_who_change_sides_take_their_controllers_along(controllers):
    """So a match is the same whoever of the two is called the policy, with the controllers in that order, too."""
    one = play_match("ring", "uniform", games=6, config=SHORT.replace(controllers=controllers))
    other = play_match("uniform", "ring", games=6, config=SHORT.replace(controllers=controllers[::-1]))
    for pair in range(3):
        for side in range(2):
            mine, theirs = one.games[2 * pair + side], other.games[2 * pair + 1 - side]
            assert (mine.fingerprint, mine.sizes) == (theirs.fingerprint, theirs.sizes)
    assert one.unique == one.games, "another controller is another game, even where both policies play alike"


def test_a_policy_may_play_against_itself():
    noise = policies.load("noise", SHORT)
    one = play_match(noise, noise, games=4, config=SHORT)
    other = play_match("noise", "noise", games=4, config=SHORT)
    assert one.games == other.games


def test_matches_do_not_begin_like_training_games():
    from swarm_pz.simulator import Simulator
    from swarm_pz.training.vec_env import SwarmVecEnv

    env = SwarmVecEnv(SHORT, 8, seed=0)
    env.reset()
    trained = {positions.tobytes() for positions in env.duel.batch.simulator.positions}
    simulator = Simulator(SHORT, 8)
    streams = np.random.SeedSequence(0, spawn_key=(_MATCH,)).spawn(8)
    simulator.reset([np.random.SeedSequence(s.entropy, spawn_key=(*s.spawn_key, 0)) for s in streams])
    assert not trained & {positions.tobytes() for positions in simulator.positions}


def test_paired_differences():
    ring, noise = (play_match(name, "uniform", games=20, config=SHORT) for name in ("ring", "noise"))
    difference, low, high = paired_difference(ring, noise)
    assert low <= difference <= high
    mean = np.mean([game.share for game in ring.games]) - np.mean([game.share for game in noise.games])
    assert difference == pytest.approx(mean)
    assert paired_difference(ring, noise) == paired_difference(ring, noise) != paired_difference(ring, noise, seed=1)
    for other in ({"opponent": "ring"}, {"seed": 1}, {"games": noise.games[:18]}):
        with pytest.raises(CommandError, match="must share opponent, seed"):
            paired_difference(ring, dataclasses.replace(noise, **other))


def test_json_holds_the_figures(tmp_path):
    match = play_match("ring", "uniform", games=4, config=SHORT)
    match.write(tmp_path / "folder" / "figures.json")
    written = json.loads((tmp_path / "folder" / "figures.json").read_text())
    story = {name: written.pop(name) for name in ("rules", "versions", "command", "lost")}
    assert written == match.summary()
    assert GameConfig.from_dict(story["rules"]).rules_hash == written["rules_hash"] == SHORT.rules_hash


def test_the_lost_games_that_count_are_named(tmp_path):
    match = play_match("noise", "uniform", games=10, seed=5, config=SHORT)
    alike = play_match("uniform", "uniform", games=10, config=SHORT)
    for played in (match, alike):
        lost = [game for game in played.unique if game.outcome == "loss"]
        assert lost and played.lost == lost and len(lost) == played.summary()["losses"]
        played.write(tmp_path / "figures.json")
        written = json.loads((tmp_path / "figures.json").read_text())["lost"]
        assert written == [{"pair": game.pair, "side": game.side, "seconds": game.seconds} for game in lost]


def test_bad_seeds_are_refused():
    with pytest.raises(CommandError, match="seed must be a whole number"):
        play_match("ring", "uniform", games=2, seed=-1)


def test_a_match_takes_no_seed_that_is_a_stream_already():
    with pytest.raises(CommandError, match="seed is a whole number"):
        play_match("ring", "uniform", games=2, seed=np.random.SeedSequence(1))


def test_differences_are_paired_where_the_rules_are_the_same_and_refused_where_not():
    def play(**changes):
        return play_match("noise", "uniform", games=2, config=SHORT.replace(**changes))

    first = play(time_limit=2.0)
    seen = play(time_limit=2.0, observation=ObservationConfig(grid=10), drones_per_team=(3, 3))
    assert paired_difference(first, seen) == (0.0, 0.0, 0.0)
    with pytest.raises(CommandError, match="rules"):
        paired_difference(first, play(time_limit=1.0))


@pytest.mark.parametrize("games", [0, 3, -2, 2.0, True])
def test_bad_numbers_of_games_are_refused(games):
    with pytest.raises(ConfigError, match="games must be"):
        play_match("ring", "uniform", games=games)


def test_a_policy_that_answers_nonsense_is_named():
    with pytest.raises(PolicyError, match="policy Nonsense's answer must be numbers"):
        play_match("ring", Nonsense(np.full((2, 10, 10), np.inf)), games=2, config=SHORT)


def test_a_policy_of_ones_own_plays_without_being_registered():
    class Corner:
        observation = ObservationConfig(grid=10)
        name = "corner"

        def reset(self, seeds, rows):
            pass

        def act(self, observations, rows):
            density = np.zeros((len(rows), 10, 10))
            density[:, 0, 0] = 1.0
            return density

    assert play_match(Corner(), policies.load("uniform"), games=2, config=SHORT).policy == "corner"


def test_the_game_itself_has_its_order():
    """noise <= uniform < ring against uniform: what makes this a benchmark."""
    shares = {name: play_match(name, "uniform", games=60, seed=5, threads=2) for name in ("noise", "uniform", "ring")}
    ring_above, low, _ = paired_difference(shares["ring"], shares["uniform"])
    assert ring_above > 0.15
    assert low > 0.0
    _, low, _ = paired_difference(shares["noise"], shares["uniform"])
    assert low < 0.0
    assert shares["ring"].summary()["win_rate"] > 0.5
