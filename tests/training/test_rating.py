"""Exploiters and ratings of a league are the same whoever is at them, and join where they always do."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest

from swarm_pz.errors import Stopped, WorkerError
from swarm_pz.evaluation.bundles import PolicyBundle
from swarm_pz.evaluation.workers import Processes
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.training.callbacks import Checkpoint
from swarm_pz.training.exploit import respond
from swarm_pz.training.selfplay import League
from tests.training.test_selfplay import LEARNER, TINY, quiet

LATER = TINY.replace(
    learner=LEARNER.replace(total_steps=192), join_after=40, exploiter_every=64, snapshot_every=64, snapshot_score=1.0
)
"""Exploiters begin at 64 and 160, and join at 128 and at the end."""


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    joined = []
    end = League._end_exploiter

    def noted(self, asked):
        joined.append((self.pool.exploiter_step, self.main.model.num_timesteps))
        end(self, asked)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(League, "_end_exploiter", noted)
        league = League(LATER, tmp_path_factory.mktemp("alone"), say=quiet)
        league.run()
    league.joined = joined
    return league


def assert_same(league, other):
    one, two = asdict(league.pool), asdict(other.pool)
    assert one == two
    for place in ("", *(member.source for member in league.pool.members if "/" in member.source)):
        ours, theirs = (LearnedPolicy.read(each.folder / place, LEARNER.game) for each in (league, other))
        for name, values in ours.weights().items():
            np.testing.assert_array_equal(values, theirs.weights()[name])
    games = [
        sorted(
            line.split('"thinking_ms"')[0] for line in (each.folder / "ratings/games.jsonl").read_text().splitlines()
        )
        for each in (league, other)
    ]
    assert games[0] == games[1] and len(set(games[0])) == len(games[0])


def test_an_exploiter_joins_between_two_deals_and_at_the_end(alone):
    assert alone.joined == [(64, 128), (160, 192)]


def test_whoever_works_for_a_league_it_is_the_same(alone, tmp_path, monkeypatch):
    during = []
    save = Checkpoint._on_rollout_start
    with Processes(1) as workers:
        workers.elsewhere = True  # as if it had none of these files
        league = League(LATER, tmp_path, say=quiet, workers=workers)

        def noted(self):
            during.append("exploiter_000" in league._background)
            save(self)

        monkeypatch.setattr(Checkpoint, "_on_rollout_start", noted)
        league.run()
    assert any(during)  # the learner went on
    assert_same(league, alone)
    assert not list((tmp_path / "exploiters").rglob("checkpoint*"))
    for place in (tmp_path / "exploiters").iterdir():
        told = LearnedPolicy.read(place, LEARNER.game).card["training"]
        assert {*told["opponents"], told["start_from"]} <= {
            "uniform", "ring", *(str(folder) for folder in (tmp_path / "pool").iterdir())
        }  # fmt: skip


def test_a_league_that_was_stopped_while_others_worked_for_it_goes_on_as_the_same(alone, tmp_path):
    steps = []

    def stop():
        steps.append(league.main.model.num_timesteps)
        return steps[-1] >= 96

    league = League(LATER, tmp_path, say=quiet)
    with pytest.raises(Stopped):
        league.run(stop)
    assert league.pool.target and league.pool.unrated
    league = League(LATER, tmp_path, resume=True, say=quiet)
    league.run()
    assert_same(league, alone)


def test_a_worker_with_another_target_trains_nothing(alone, tmp_path):
    target = alone.folder / "pool" / "snapshot_000"
    with pytest.raises(WorkerError, match=r"snapshot_000 is another on .*: expected digest 0{32}"):
        respond(str(target), tmp_path / "e", LEARNER, 32, 0, 2, digest="0" * 32, bundle=PolicyBundle.of(target))
    assert not list(tmp_path.iterdir())
