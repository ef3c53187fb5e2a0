"""Distillation: a network that meets each opponent as one of its teachers does."""

import itertools

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.policies import load
from swarm_pz.policies.learned import LearnedPolicy, lineage
from swarm_pz.training import distil as distillation
from swarm_pz.training import imitation
from swarm_pz.training.config import DistilConfig
from swarm_pz.training.imitation import lessons_of
from tests.training.runs import TINY, quiet

GAME = TINY.game
SMALL = DistilConfig(
    game=GAME, teachers=("hunter", "ring"), opponents=("uniform", "corners"), drawn=2, rounds=2, width=8, threads=1
)


@pytest.fixture(autouse=True)
def few_games(monkeypatch):
    for name, value in {"_LONG": 30, "_BATCH": 32, "_TRIED": 2, "_AGAINST": 2}.items():
        monkeypatch.setattr(imitation, name, value)


def test_each_opponent_is_taught_by_the_first_teacher_that_does_nearly_as_well_as_the_best(monkeypatch):
    shares = {"uniform": (0.95, 1.0, 0.2), "chase": (0.5, 0.6, 0.9), "ring": (0.5, 0.9, 0.85)}
    patterns = distillation.laps_and_spots(3, 0)
    of_patterns = (0.4, 1.0, 0.3), (0.9, 0.1, 0.2), (0.3, 0.4, 0.9)
    teachers = ["halo", "lasso", "centre"]

    def play(ours, theirs, games, game, seed):
        rows = of_patterns if theirs.name == "pattern" else [shares[theirs.name]]
        return np.repeat([row[teachers.index(ours.name)] for row in rows], imitation._TRIED)

    monkeypatch.setattr(imitation, "play", play)
    lessons = lessons_of(teachers, tuple(shares), patterns, GameConfig(), 0)
    assert [(one.opponent, one.teacher) for one in lessons[:3]] == [
        ("uniform", "halo"),
        ("chase", "centre"),
        ("ring", "lasso"),
    ]
    met = {one.teacher: one.opponent for one in lessons[3:]}
    for teacher, place in {"lasso": 0, "halo": 1, "centre": 2}.items():
        np.testing.assert_array_equal(met[teacher], np.repeat(patterns[[place]], 2, axis=0))


def test_the_learner_commands_what_the_teacher_would_in_the_places_that_it_comes_to(tmp_path, monkeypatch):
    monkeypatch.setattr(imitation, "_LONG", 300)
    config = SMALL.replace(teachers=("ring",), opponents=("uniform",), drawn=0, rounds=1)
    learned = distillation.distil(config, tmp_path / "ring")
    ring, uniform = load("ring", GAME), load("uniform", GAME)
    seen, wanted = imitation._Recorded(
        GAME.observations[0], ring, learned, uniform, range(8), seed=9, config=GAME
    ).examples()
    learned.reset([0] * len(seen), np.arange(len(seen)))
    answered = np.stack(learned.act(seen, np.arange(len(seen))))
    apart = [
        np.abs(one / one.sum(axis=(1, 2), keepdims=True) - wanted / wanted.sum(axis=(1, 2), keepdims=True)).sum() / 2
        for one in (answered, np.ones_like(answered))
    ]
    assert apart[0] < 0.8 * apart[1]  # uniform coverage is as far as a learner that learned nothing


def test_a_distilled_policy_has_the_costs_of_its_teachers_once_and_a_stop_ends_it_early(tmp_path):
    said, asked = [], itertools.count()
    policy = distillation.distil(
        SMALL.replace(teachers=("hunter", "ring", "hunter")),
        tmp_path / "both",
        say=said.append,
        should_stop=lambda: next(asked) == 1,
    )
    assert "stopped after 1 of 2 rounds" in said
    own, *older = lineage(policy.card)
    hunter = load("hunter", GameConfig())
    assert isinstance(hunter, LearnedPolicy)
    assert own["steps"] > 0 and [one["name"] for one in older].count("hunter") == 1
    assert older[0]["steps"] == hunter.card["steps"]
    with pytest.raises(ConfigError, match="choose another folder"):
        distillation.distil(SMALL, tmp_path / "both", say=quiet)
