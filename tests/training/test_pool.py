from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
import pytest

from swarm_pz.policies.pattern import KINDS, numbers_in, points_of
from swarm_pz.training.pool import Member, Pool


def test_a_new_opponent_counts_as_ten_games_at_an_even_score_and_two_hundred_are_remembered():
    member = Member("ring", "ring", "script")
    assert member.beaten == 0.5
    member.count(1.0)
    member.count(0.5)
    assert (member.games, member.score) == (12.0, 6.5)
    old = Member("ring", "ring", "script", games=200.0, score=100.0)
    old.count(1.0)
    assert (old.games, old.beaten) == (200.0, pytest.approx(101 / 201))


def test_the_hardest_are_met_most_and_scripts_keep_their_share_however_many_snapshots_there_are():
    scripts = [Member("easy", "easy", "script", 100, 95), Member("hard", "hard", "script", 100, 80)]
    snapshots = [Member(f"s{i}", f"s{i}", "snapshot", 100, 50) for i in range(30)]
    easy, hard = Pool(scripts).weights(exponent=2.0, floor=0.0, script=0.5)
    assert hard / easy == pytest.approx((0.2 / 0.05) ** 2) and easy + hard == pytest.approx(1.0)
    weights = Pool(scripts + snapshots).weights(exponent=2.0, floor=0.02, script=0.4)
    assert weights[:2].sum() == pytest.approx(0.4)
    assert weights[1] / weights[0] == pytest.approx((0.2**2 + 0.02) / (0.05**2 + 0.02))
    np.testing.assert_allclose(weights[2:], 0.6 / 30)
    patterns = [Member("p", "p", "pattern")]
    weights = Pool(scripts + patterns + snapshots).weights(exponent=2.0, floor=0.02, script=0.4, pattern=0.5)
    np.testing.assert_allclose([weights[:2].sum(), weights[2], weights[3:].sum()], [0.4, 0.5, 0.1])
    np.testing.assert_allclose(Pool(snapshots).weights(exponent=2.0, floor=0.02, script=0.4), 1 / 30)


def test_a_pool_is_read_as_it_was_written_and_its_newest_snapshot_is_the_last_of_them():
    kinds = {"ring": "script", "s1": "snapshot", "x1": "exploiter", "s2": "snapshot", "x2": "exploiter", "r": "initial"}
    members = [Member(name, f"pool/{name}", kind, 20.0, 5.0) for name, kind in kinds.items()]
    pool = Pool(members, "abc", snapshot_step=3, target="pool/s2", exploiters=2, exploiter_step=1, until=7)
    again = Pool.from_dict(json.loads(json.dumps(asdict(pool))))
    assert again == pool and again.newest().name == "s2"


def test_patterns_that_the_learner_finds_hard_stay_and_others_make_room_for_new_ones_near_them():
    generator = np.random.default_rng(2)
    pool = Pool([Member("ring", "ring", "script")])
    pool.renew_patterns(8, generator)
    first = pool.members[1:]
    assert len({one.name for one in first}) == 8 and {one.kind for one in first} == {"pattern"}
    for place, one in enumerate(first[:6]):  # the other two are not judged yet
        one.games, one.score = 60.0, 60.0 * (0.3 + 0.1 * place)
    first[5].score = 0.9 * 60.0
    pool.renew_patterns(8, generator)
    now = pool.members[1:]
    assert pool.members[0].name == "ring" and len(now) == 8
    assert [one.name for one in now[:6]] == [one.name for one in (*first[:4], *first[6:])]
    points = points_of(np.array([numbers_in(one.name) for one in now]))
    named = points_of(np.array([[*kind.values()] for kind in KINDS.values()]))
    near = [np.abs(points[:4] - points[new]).max(axis=1).min() for new in (6, 7)]
    assert np.abs(named - points[6]).max(axis=1).min() < 0.5 and near[1] < 0.25
    for one in pool.members[1:]:
        one.games, one.score = 60.0, 59.0
    pool.renew_patterns(8, generator)
    assert not {one.name for one in pool.members} & {one.name for one in now}
