from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import CheckpointError, ConfigError
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.training.checkpoint import CHECKPOINT
from swarm_pz.training.config import LeagueConfig, TrainConfig
from swarm_pz.training.exploit import exploiter_config, make_exploiter, play_exploiter
from swarm_pz.training.pool import Member, Pool
from swarm_pz.training.ppo import Training
from swarm_pz.training.rating import Rating
from swarm_pz.training.selfplay import STATE, League
from swarm_pz.training.vec_env import SwarmVecEnv

LEARNER = TrainConfig(
    game=GameConfig(observation=ObservationConfig(grid=10), drones_per_team=2, time_limit=5.0),
    total_steps=128,
    num_envs=4,
    rollout=8,
    batch_size=16,
    epochs=1,
    width=8,
    evaluate_every=10_000,
    evaluation_games=2,
    threads=1,
)
TINY = LeagueConfig(
    learner=LEARNER,
    scripts=("uniform", "ring"),
    seats=4,
    cycle=32,
    snapshot_every=64,
    exploiter_every=64,
    exploiter_steps=32,
)


def quiet(line: str) -> None:
    """Drop a line of progress."""


def test_the_hardest_are_met_most():
    pool = Pool([Member("easy", "easy", "script", 100, 95), Member("hard", "hard", "script", 100, 20)])
    easy, hard = pool.weights(exponent=2.0, floor=0.0, scripts=0.5)
    assert hard / easy == pytest.approx((0.8 / 0.05) ** 2)
    assert easy + hard == pytest.approx(1.0)


def test_scripts_keep_their_share_however_many_snapshots_there_are():
    scripts = [Member("easy", "easy", "script", 100, 95), Member("hard", "hard", "script", 100, 80)]
    snapshots = [Member(f"s{i}", f"s{i}", "snapshot", 100, 50) for i in range(30)]
    weights = Pool(scripts + snapshots).weights(exponent=2.0, floor=0.02, scripts=0.4)
    assert weights[:2].sum() == pytest.approx(0.4)
    assert weights[1] / weights[0] == pytest.approx((0.2**2 + 0.02) / (0.05**2 + 0.02))
    np.testing.assert_allclose(weights[2:], 0.6 / 30)
    np.testing.assert_allclose(Pool(snapshots).weights(exponent=2.0, floor=0.02, scripts=0.4), 1 / 30)


def test_the_newest_snapshot_is_the_last_of_them_whatever_else_came_after():
    kinds = {"ring": "script", "s1": "snapshot", "x1": "exploiter", "s2": "snapshot", "x2": "exploiter", "r": "rival"}
    pool = Pool([Member(name, name, kind) for name, kind in kinds.items()])
    assert pool.newest().name == "s2"
    assert Pool.from_dict(json.loads(pool.to_json())).newest().name == "s2"


def test_old_games_fade():
    member = Member("m", "m", "script")
    for _ in range(1000):
        member.count(0.0)
    assert member.beaten == pytest.approx(0.0, abs=0.01)
    for _ in range(400):
        member.count(1.0)
    assert member.beaten > 0.8


def test_rivals_are_met_from_the_start_among_the_snapshots(tmp_path):
    first = League(TINY.replace(exploiter_steps=0), tmp_path / "first", say=quiet)
    first.run()
    rival = str(tmp_path / "first")
    second = League(TINY.replace(exploiter_steps=0, rivals=(rival,)), tmp_path / "second", say=quiet)
    second.run()
    met = next(member for member in second.pool.members if member.name == rival)
    assert met.kind == "rival" and met.games > 10
    weights = second.pool.weights(exponent=1.0, floor=0.1, scripts=0.5)
    assert weights[[member.kind == "script" for member in second.pool.members]].sum() == pytest.approx(0.5)


def test_a_league_grows_a_pool_and_writes_a_policy(tmp_path):
    league = League(TINY, tmp_path, say=quiet)
    policy = league.run()
    kinds = [member.kind for member in league.pool.members]
    assert kinds[:2] == ["script", "script"]
    assert kinds.count("snapshot") >= 3
    assert league.pool.exploiters >= 1
    loaded = LearnedPolicy.read(tmp_path, LEARNER.game)
    assert LeagueConfig.from_dict(loaded.card["league"] | {"learner": loaded.card["training"]}) == TINY
    np.testing.assert_array_equal(list(loaded.weights().values())[1], list(policy.weights().values())[1])
    for member in league.pool.members:
        if member.kind != "script":
            LearnedPolicy.read(tmp_path / member.source, LEARNER.game)
    assert sum(member.games for member in league.pool.members) > 10 * len(kinds)


def test_a_won_game_is_a_point_for_the_learner_and_a_lost_one_is_none(tmp_path, monkeypatch):
    ends, points = [], []
    step_wait = SwarmVecEnv.step_wait

    def watched(self):
        result = step_wait(self)
        _, rewards, dones, _ = result
        ends.extend(0.5 + 0.5 * np.sign(np.trunc(rewards[dones])))  # to win or lose counts one, and what was captured
        return result

    monkeypatch.setattr(SwarmVecEnv, "step_wait", watched)
    monkeypatch.setattr(Member, "count", lambda _, gained: points.append(gained))
    game = LEARNER.game.replace(drones_per_team=1, time_limit=60.0)
    learner = LEARNER.replace(game=game, num_envs=16, rollout=32, total_steps=1024)
    League(TINY.replace(learner=learner, cycle=1024, exploiter_steps=0), tmp_path, say=quiet).run()
    assert points == ends
    assert {0.0, 1.0} & set(points)


@pytest.mark.parametrize(("points", "is_early"), [(2.0, False), (3.0, True), (4.0, True)])
def test_a_snapshot_is_taken_early_where_the_newest_is_beaten(tmp_path, monkeypatch, points, is_early):
    monkeypatch.setattr(Member, "count", lambda *_: None)
    monkeypatch.setattr(League, "_begin_rating", lambda _: SimpleNamespace(end=lambda asked: 0.0))
    config = TINY.replace(
        learner=LEARNER.replace(total_steps=32), snapshot_score=0.75, snapshot_every=10_000, exploiter_steps=0
    )
    league = League(config, tmp_path, say=quiet)
    newest = league.pool.newest()
    newest.games, newest.score = 4.0, points
    league.run()
    assert (league.pool.newest() is not newest) is is_early


@pytest.mark.parametrize(("score", "joins"), [(0.2, False), (0.5, False), (0.51, True), (0.9, True)])
def test_an_exploiter_joins_the_pool_only_if_it_beats_its_target(tmp_path, monkeypatch, score, joins):
    target = SimpleNamespace(score=lambda: score, standing=lambda: "so and so")
    other = SimpleNamespace(score=lambda: 1.0 - score, standing=lambda: "that shows its competence alone")
    monkeypatch.setattr(
        "swarm_pz.training.exploit.make_exploiter", lambda *_, **__: SimpleNamespace(run=lambda _: None)
    )
    monkeypatch.setattr("swarm_pz.training.exploit.play_exploiter", lambda *_, **__: [target, other, other])
    learner = LEARNER.replace(total_steps=32)
    league = League(TINY.replace(learner=learner, exploiter_every=32), tmp_path, say=quiet)
    league.run()
    assert league.pool.exploiters == 1
    joined = [member for member in league.pool.members if member.kind == "exploiter"]
    assert [member.name for member in joined] == (["exploiter_000"] if joins else [])
    assert all(member.beaten == pytest.approx(1.0 - score) for member in joined)


def test_a_league_goes_on_where_it_was(tmp_path):
    League(TINY, tmp_path, say=quiet).run()
    before = json.loads((tmp_path / STATE).read_text())
    with pytest.raises(CheckpointError, match=r"holds a league, a finished run of 128 steps .*--resume"):
        League(TINY, tmp_path, say=quiet)
    with pytest.raises(CheckpointError, match="other settings"):
        League(TINY.replace(hardness=1.0), tmp_path, resume=True, say=quiet)
    longer = TINY.replace(learner=LEARNER.replace(total_steps=192))
    league = League(longer, tmp_path, resume=True, say=quiet)
    assert league.main.model.num_timesteps >= 128
    assert [member.name for member in league.pool.members] == [member["name"] for member in before["members"]]
    league.run()
    assert league.main.model.num_timesteps >= 192
    (tmp_path / "main" / CHECKPOINT).write_bytes(b"torn")
    with pytest.raises(CheckpointError, match="corrupt or foreign"):
        League(longer, tmp_path, resume=True, say=quiet)


def test_partners_explore_as_the_learner_does(tmp_path):
    league = League(TINY.replace(scripts=(), exploiter_steps=0), tmp_path, say=quiet)
    league._deal()
    partner = league.main.env.duel._dealt[0].player
    assert partner.noise == pytest.approx(np.exp(LEARNER.log_std))
    boards = np.zeros((2, *league.main.env.observation_space.shape), np.uint8)
    partner.reset([1, 2], np.arange(2))
    noisy = partner.act(boards, np.arange(2))
    assert not np.array_equal(noisy[0], noisy[1])
    partner.noise = 0.0
    plain = partner.act(boards, np.arange(2))
    np.testing.assert_array_equal(plain[0], plain[1])
    league.main.learn(64)
    league._deal()
    partner = league.main.env.duel._dealt[0].player
    assert partner.noise == pytest.approx(league.main.exploration())
    assert partner.noise < 0.99 * np.exp(LEARNER.log_std)  # it fades, as the learner's does
    league.main.env.close()


def test_a_league_that_is_killed_while_it_rates_goes_on(tmp_path, monkeypatch):
    league = League(TINY, tmp_path, say=quiet)
    begin = Rating.begin

    def killed(self):
        begin(self)
        raise KeyboardInterrupt

    monkeypatch.setattr(Rating, "begin", killed)
    with pytest.raises(KeyboardInterrupt):
        league.run()
    monkeypatch.setattr(Rating, "begin", begin)
    league = League(TINY, tmp_path, resume=True, say=quiet)
    assert league.pool.unrated == "pool/snapshot_001"
    league.run()
    assert not league.pool.unrated


def test_a_league_that_is_killed_while_it_exploits_finishes_the_same_exploiter(tmp_path, monkeypatch):
    league = League(TINY, tmp_path, say=quiet)
    targets = []

    def killed(target, *args, **kwargs):
        targets.append(LearnedPolicy.read(Path(target), LEARNER.game).digest)
        if len(targets) == 1:
            raise KeyboardInterrupt
        return make_exploiter(target, *args, **kwargs)

    monkeypatch.setattr("swarm_pz.training.exploit.make_exploiter", killed)
    with pytest.raises(KeyboardInterrupt):
        league.run()
    League(TINY, tmp_path, resume=True, say=quiet).run()
    assert targets[0] == targets[1]


def test_an_exploiter_of_something_else_is_not_taken_up(tmp_path):
    Training(LEARNER, tmp_path / "target", say=quiet).run()
    settings = {"steps": 32, "learner": LEARNER, "seed": 0, "say": quiet}
    make_exploiter(str(tmp_path / "target"), tmp_path / "exploiter", **settings).run()
    Training(LEARNER.replace(seed=5), tmp_path / "target", overwrite=True, say=quiet).run()
    with pytest.raises(CheckpointError, match="belongs to another configuration"):
        make_exploiter(str(tmp_path / "target"), tmp_path / "exploiter", resume=True, **settings)


def test_pure_self_play_meets_only_itself(tmp_path):
    league = League(TINY.replace(scripts=(), exploiter_steps=0), tmp_path, say=quiet)
    assert LeagueConfig.from_dict(json.loads((tmp_path / "config.json").read_text())) == league.config  # to go on by
    league.run()
    assert {member.kind for member in league.pool.members} == {"snapshot"}


def test_an_exploiter_starts_from_its_targets_weights(tmp_path):
    target = Training(LEARNER, tmp_path / "target", say=quiet).run()
    config = exploiter_config(str(tmp_path / "target"), LEARNER, steps=64, seed=3)
    run = Training(config, tmp_path / "exploiter", say=quiet)
    for name, values in run.policy().weights().items():
        np.testing.assert_array_equal(values, target.weights()[name])
    run.learn(config.critic_steps)
    for name, values in run.policy().weights().items():  # only the critic has learned
        np.testing.assert_array_equal(values, target.weights()[name])
    run.learn(64)
    assert any(not np.array_equal(values, target.weights()[name]) for name, values in run.policy().weights().items())
    run.env.close()


def test_exploiting_reports_target_and_competence(tmp_path):
    run = make_exploiter("centre", tmp_path, steps=32, learner=LEARNER, seed=0, say=quiet)
    run.run()
    matches = play_exploiter(run, "centre", games=2)
    assert [match.opponent for match in matches] == ["centre", "uniform", "ring"]


@pytest.mark.parametrize(
    "change",
    [
        {"seats": 0},
        {"cycle": 0},
        {"hardness": -1.0},
        {"floor": 0.0},
        {"script_share": 1.5},
        {"snapshot_score": 2.0},
        {"scripts": "ring"},
    ],
)
def test_bad_settings_are_refused(change):
    with pytest.raises(ConfigError, match=next(iter(change))):
        LeagueConfig(**change)


def test_another_network_cannot_be_taken_over(tmp_path):
    Training(LEARNER, tmp_path / "target", say=quiet).run()
    with pytest.raises(CheckpointError, match="another network"):
        Training(LEARNER.replace(width=16, start_from=str(tmp_path / "target")), tmp_path / "run", say=quiet)
    with pytest.raises(CheckpointError, match="must name a learned policy"):
        Training(LEARNER.replace(start_from="ring"), tmp_path / "run", say=quiet)
