from __future__ import annotations

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.policies.held_out import SUITE, play_suites
from swarm_pz.policies.scripted import SCRIPTS


@pytest.mark.parametrize("trial", SUITE, ids=lambda trial: trial.name)
def test_every_opponent_of_the_suite_plays_and_moves_on(trial):
    assert trial.opponent.__name__ not in policies.names() or trial.drones_per_team is not None
    config = GameConfig(drones_per_team=trial.drones_per_team or 10)
    batch = BatchEnv(config, 2)
    batch.reset([0, 1])
    player = trial.opponent(config)
    player.reset([3, 4], np.arange(2))
    answers = []
    for _ in range(25):
        rows = np.flatnonzero(batch.running)
        commands = np.ones((2, 2, 10, 10))
        commands[rows, 0] = batch.ask(player, np.zeros_like(rows), rows)
        batch.step(commands)
        answers.append(commands[0, 0])
    if trial.opponent.__name__ not in ("uniform", "halo"):
        assert not np.array_equal(answers[0], answers[-1])


def test_scores_are_means_over_the_suites():
    config = GameConfig(drones_per_team=2, time_limit=5.0)
    suites = play_suites("ring", config, games=2)
    figures = suites.to_dict()
    assert len(figures["in_suite"]) == len(SCRIPTS)
    assert [entry["opponent"] for entry in figures["held_out"]] == [trial.name for trial in SUITE]
    assert figures["generalisation"] == pytest.approx(figures["held_out_score"] - figures["in_suite_score"])
    scores = [(m["wins"] + m["draws"] / 2) / m["games"] for m in figures["held_out"]]
    assert figures["held_out_score"] == pytest.approx(np.mean(scores))
