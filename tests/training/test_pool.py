from __future__ import annotations

import json

import pytest

from swarm_pz.training.pool import Member, Pool


def test_a_new_opponent_counts_as_ten_games_at_an_even_score():
    member = Member("ring", "ring", "script")
    assert member.beaten == 0.5
    member.count(1.0)
    assert member.beaten == pytest.approx(6 / 11)
    member.count(0.5)
    assert (member.games, member.score) == (12.0, 6.5)


def test_two_hundred_games_are_remembered():
    member = Member("ring", "ring", "script", games=200.0, score=100.0)
    member.count(1.0)
    assert member.games == 200.0
    assert member.beaten == pytest.approx(101 / 201)


def test_a_pool_is_read_as_it_was_written():
    pool = Pool(
        [Member("ring", "ring", "script", 20.0, 5.0), Member("snapshot_000", "pool/snapshot_000", "snapshot")],
        config_hash="abc", snapshot_step=3, target="pool/snapshot_000", exploiters=2, exploiter_step=1, until=7,
    )  # fmt: skip
    assert Pool.from_dict(json.loads(pool.to_json())) == pool
