"""A league deals opponents, takes snapshots, trains exploiters, and can be resumed."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.errors import CheckpointError
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.training import selfplay
from swarm_pz.training.checkpoint import CHECKPOINT
from swarm_pz.training.config import LeagueConfig
from swarm_pz.training.pool import Member
from swarm_pz.training.selfplay import STATE, League
from swarm_pz.training.vec_env import SwarmVecEnv
from tests.training.runs import LEAGUE, LEARNER, assert_same_weights, quiet

PLAIN = LEAGUE.replace(exploiter_steps=0)
ONE_DEAL = PLAIN.replace(learner=LEARNER.replace(total_steps=32))


def kinds_of(league):
    return [member.kind for member in league.pool.members]


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    lines = []
    league = League(LEAGUE, tmp_path_factory.mktemp("leagues") / "league", say=lines.append, command="swarm-pz league")
    return league, league.run(), lines


def test_a_league_grows_a_pool_and_writes_a_policy_whose_card_says_whom_it_met(played):
    league, policy, lines = played
    assert any(" hardest " in line for line in lines) and any(
        "exploiter_000 against snapshot_001" in one for one in lines
    )
    assert kinds_of(league)[:2] == ["script", "script"]
    assert kinds_of(league).count("snapshot") >= 3 and league.pool.exploiters >= 1
    assert sum(member.games for member in league.pool.members) > 10 * len(league.pool.members)
    loaded = LearnedPolicy.read(league.folder, LEARNER.game)
    assert_same_weights(loaded, policy)
    assert "opponents" not in loaded.card["training"] and "learner" not in loaded.card["league"]
    assert LeagueConfig.from_dict(loaded.card["league"] | {"learner": loaded.card["training"]}) == LEAGUE
    assert (policy.name, policy.card["command"], policy.card["steps"]) == ("league", "swarm-pz league", 128)
    for member in league.pool.members:
        if member.kind != "script":
            LearnedPolicy.read(league.folder / member.source, LEARNER.game)


def test_opponents_are_dealt_as_often_as_their_weights_say_in_an_order_that_changes(tmp_path, monkeypatch):
    config = PLAIN.replace(
        scripts=("uniform", "ring", "noise"), seats=60, pfsp_exponent=3.0, floor=0.05, script_share=0.4
    )
    league = League(config, tmp_path, say=quiet)
    for member, score in zip(league.pool.members, (9.0, 5.0, 2.0, 4.0), strict=True):
        member.score = score
    dealt = []
    monkeypatch.setattr(league.main.env, "deal", lambda players, names: dealt.append((players, names)))
    for steps in (0, 0, 64):
        league.main.model.num_timesteps = steps
        league._deal()
    easy, even, hard = ((1 - share) ** 3 + 0.05 for share in (0.9, 0.5, 0.2))
    scripts = 0.4 / (easy + even + hard)
    weights = {"uniform": scripts * easy, "ring": scripts * even, "noise": scripts * hard, "snapshot_000": 0.6}
    for players, names in dealt:
        for name, weight in weights.items():
            assert abs(names.count(name) - 60 * weight) < 1, name
        assert len({id(player) for player in players}) == len(set(names))
        assert [player.name for player in players] == names
    orders = [names for _, names in dealt]
    assert orders[0] == orders[1] != orders[2]
    assert sum(one != other for one, other in zip(orders[0], orders[0][1:], strict=False)) > 20


def test_snapshots_explore_as_the_learner_does_and_named_opponents_do_not(tmp_path, monkeypatch):
    dealt = []
    league = League(ONE_DEAL.replace(scripts=()), tmp_path, say=quiet)
    monkeypatch.setattr(league.main.env, "deal", lambda players, names: dealt.append(players[0]))
    league._deal()
    league.main.learn(32)
    league._deal()
    assert set(kinds_of(league)) == {"snapshot"}, "who plays nobody else plays itself"
    first, later = dealt
    assert first.noise == pytest.approx(np.exp(LEARNER.log_std))
    assert later.noise == pytest.approx(league.main.state.exploration(32)) and later.noise < 0.99 * first.noise
    league.pool.members = [Member("hunter", "hunter", "initial")]
    league._deal()
    assert dealt[-1].name == "hunter" and dealt[-1].noise == 0.0


def test_the_learner_has_all_drones_of_a_won_game_and_none_of_a_lost_one(tmp_path, monkeypatch):
    ends, shares = [], []
    step_wait = SwarmVecEnv.step_wait

    def decided(self):
        teams, sides = self.duel.batch.simulator.games.teams, self.duel.sides
        teams[0], teams[1] = sides[0], 1 - sides[1]  # all drones of a game on one side: the first is won, the next lost
        result = step_wait(self)
        _, rewards, dones, _ = result
        signs = np.sign(np.trunc(rewards[dones]))  # ±1 for a win or a loss, plus the drones captured
        ends.extend(0.5 + 0.5 * signs[signs != 0.0])
        return result

    monkeypatch.setattr(SwarmVecEnv, "step_wait", decided)
    monkeypatch.setattr(Member, "count", lambda _, share: shares.append(share))
    League(ONE_DEAL, tmp_path, say=quiet).run()
    assert [share for share in shares if share in (0.0, 1.0)] == ends and {0.0, 1.0} <= set(ends)


@pytest.mark.parametrize(("points", "is_early"), [(2.9, False), (3.0, True)])
def test_a_snapshot_is_taken_early_where_the_newest_is_beaten(tmp_path, monkeypatch, points, is_early):
    monkeypatch.setattr(Member, "count", lambda *_: None)
    league = League(ONE_DEAL.replace(snapshot_score=0.75, snapshot_every=10_000), tmp_path, say=quiet)
    newest = league.pool.newest()
    newest.games, newest.score = 4.0, points
    league.run()
    assert (league.pool.newest() is not newest) is is_early


NOTHING = SimpleNamespace(unpack=lambda _: None)
"""The files of an exploiter that nobody trained."""


def test_each_game_against_a_pattern_is_played_by_the_pattern_that_it_counts_for(tmp_path, monkeypatch):
    dealt = []
    league = League(ONE_DEAL.replace(pattern_share=0.5, seats=16), tmp_path, say=quiet)
    monkeypatch.setattr(league.main.env, "deal", lambda *given: dealt.append(given))
    league._deal()
    ((players, names),) = dealt
    patterns = [(seat, name) for seat, name in enumerate(names) if name.startswith("pattern:")]
    assert len(patterns) == 8 and len({id(players[seat]) for seat, _ in patterns}) == 1
    images = np.zeros((32, 2, 25, 25), np.uint8)
    for seat, name in patterns:
        shared, alone = players[seat], policies.load(name, LEARNER.game)
        rows = np.array([seat, seat + 16])
        for one in (shared, alone):
            one.reset([1, 2], rows)
        np.testing.assert_allclose(shared.act(images[rows], rows), alone.act(images[rows], rows), atol=1e-3)


@pytest.mark.parametrize(("share", "joins"), [(0.5, False), (0.51, True)])
def test_an_exploiter_joins_the_pool_only_if_it_takes_more_than_half_of_the_drones(tmp_path, monkeypatch, share, joins):
    """The match's points used to decide, and the pool counted them as shares of the drones."""
    match = SimpleNamespace(share=lambda: share, score=lambda: 1.0 - share, standing=lambda: "so and so")
    monkeypatch.setattr(selfplay, "respond", lambda *_: (match, NOTHING))
    league = League(ONE_DEAL.replace(exploiter_steps=32, exploiter_every=32), tmp_path, say=quiet)
    league.run()
    assert league.pool.exploiters == 1
    joined = [member for member in league.pool.members if member.kind == "exploiter"]
    assert [member.name for member in joined] == (["exploiter_000"] if joins else [])
    assert all(member.beaten == pytest.approx(1.0 - share) for member in joined)


def test_exploiters_are_trained_in_turn_of_the_newest_snapshot_and_a_killed_one_is_begun_again(tmp_path, monkeypatch):
    learner = LEARNER.replace(total_steps=160, seed=5)
    config = LEAGUE.replace(learner=learner, exploiter_steps=48, snapshot_every=10_000, snapshot_score=1.0)
    calls, match = [], SimpleNamespace(share=lambda: 0.25, standing=lambda: "1-0-3")

    def killed(*given):
        calls.append(given)
        raise KeyboardInterrupt

    monkeypatch.setattr(selfplay, "respond", killed)
    with pytest.raises(KeyboardInterrupt):
        League(config, tmp_path, say=quiet).run()
    monkeypatch.setattr(selfplay, "respond", lambda *given: calls.append(given) or (match, NOTHING))
    league = League(config, tmp_path, say=quiet)
    league.run()
    assert [given[:6] for given in calls] == [
        (
            str(tmp_path / "pool" / f"snapshot_{target:03d}"), tmp_path / "exploiters" / f"exploiter_{number:03d}",
            learner.replace(evaluate_every=48), 48, 1005 + number, 4,
        )
        for number, target in ((0, 1), (0, 1), (1, 2))
    ]  # fmt: skip
    assert (league.pool.exploiters, league.pool.exploiter_step, league.pool.target) == (2, 128, "")
    assert "exploiter" not in kinds_of(league)


def test_a_league_goes_on_where_it_was_with_more_steps_and_other_threads_alone(tmp_path):
    League(ONE_DEAL, tmp_path, say=quiet).run()
    before = json.loads((tmp_path / STATE).read_text())
    assert LeagueConfig.from_dict(json.loads((tmp_path / "config.json").read_text())) == ONE_DEAL  # to resume with
    with pytest.raises(CheckpointError, match="other settings"):
        League(ONE_DEAL.replace(pfsp_exponent=1.0), tmp_path, say=quiet)
    longer = ONE_DEAL.replace(learner=LEARNER.replace(total_steps=64, threads=2))
    league = League(longer, tmp_path, say=quiet)
    assert (league.main.model.num_timesteps, league.main.config.threads) == (32, 2)
    assert [member.name for member in league.pool.members] == [member["name"] for member in before["members"]]
    league.run()
    assert league.main.model.num_timesteps == 64
    (tmp_path / "main" / CHECKPOINT).write_bytes(b"torn")
    with pytest.raises(CheckpointError, match="corrupt or foreign"):
        League(longer, tmp_path, say=quiet)
