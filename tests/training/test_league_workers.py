"""Exploiters of a league are the same with any workers, and join at the same steps."""

from __future__ import annotations

from dataclasses import asdict

import pytest
import torch

from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.training.callbacks import Checkpoint
from swarm_pz.training.selfplay import League
from tests.elsewhere import Elsewhere
from tests.training.runs import LEAGUE, LEARNER, assert_same_weights, quiet

LATER = LEAGUE.replace(
    learner=LEARNER.replace(total_steps=192), scripts=("noise", "ring"), async_delay=40, snapshot_score=1.0
)
"""Exploiters begin at 64 and 160, and join at 128 and at the end."""


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    joined = []

    def say(line):
        if line.startswith("exploiter_") and " against " in line and "trains" not in line:
            joined.append((league.pool.exploiter_step, league.main.model.num_timesteps))

    league = League(LATER, tmp_path_factory.mktemp("alone"), say=say)
    league.run()
    league.joined = joined
    return league


def assert_same(league, other):
    assert asdict(league.pool) == asdict(other.pool)
    for place in ("", *(member.source for member in league.pool.members if "/" in member.source)):
        assert_same_weights(*(LearnedPolicy.read(each.folder / place, LEARNER.game) for each in (league, other)))


def test_an_exploiter_joins_between_two_deals_and_at_the_end(alone):
    assert alone.joined == [(64, 128), (160, 192)]


def test_whoever_works_for_a_league_it_is_the_same(alone, tmp_path, monkeypatch):
    during = []
    save = Checkpoint._on_rollout_start
    torch.rand(3)  # workers have random streams of their own
    (tmp_path / "there").mkdir()
    league = League(LATER, tmp_path / "here", say=quiet, workers=Elsewhere(tmp_path / "there"))

    def noted(self):
        during.append("exploiter_000" in league._background)
        save(self)

    monkeypatch.setattr(Checkpoint, "_on_rollout_start", noted)
    league.run()
    assert any(during)  # the learner trained meanwhile
    assert_same(league, alone)
    assert not list((tmp_path / "here" / "exploiters").rglob("checkpoint*"))
    assert not list((tmp_path / "there").iterdir())
