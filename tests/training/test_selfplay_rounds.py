"""What a league does between two deals: whom it deals, exploits and rates, and what it tells."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz.errors import CheckpointError
from swarm_pz.evaluation.workers import SerialExecutor
from swarm_pz.training import exploit, rating
from swarm_pz.training.checkpoint import CHECKPOINT
from swarm_pz.training.pool import Member
from swarm_pz.training.rating import Rating
from swarm_pz.training.selfplay import League
from tests.training.test_selfplay import LEARNER, TINY, quiet

PLAIN = TINY.replace(exploiter_steps=0)


def test_opponents_are_dealt_as_often_as_their_weights_say_in_an_order_that_changes(tmp_path, monkeypatch):
    config = PLAIN.replace(scripts=("uniform", "ring", "noise"), seats=60, hardness=3.0, floor=0.05, script_share=0.4)
    league = League(config, tmp_path, say=quiet)
    for member, score in zip(league.pool.members, (9.0, 5.0, 2.0, 4.0), strict=True):
        member.score = score
    dealt = []
    monkeypatch.setattr(league.main, "deal", lambda players, names: dealt.append((players, names)))
    for steps in (0, 0, 64):
        league.main.model.num_timesteps = steps
        league._deal()
    easy, even, hard = ((1 - share) ** 3 + 0.05 for share in (0.9, 0.5, 0.2))
    scripts = 0.4 / (easy + even + hard)
    weights = {"uniform": scripts * easy, "ring": scripts * even, "noise": scripts * hard, "snapshot_000": 0.6}
    for players, names in dealt:
        assert len(names) == 60
        for name, weight in weights.items():
            assert abs(names.count(name) - 60 * weight) < 1, name
        assert len({id(player) for player in players}) == len(set(names))
        assert [player.name for player in players] == names
    orders = [names for _, names in dealt]
    assert orders[0] == orders[1] != orders[2]
    assert sum(one != other for one, other in zip(orders[0], orders[0][1:], strict=False)) > 20
    league.config = config.replace(learner=LEARNER.replace(seed=1))
    league._deal()
    assert dealt[-1][1] != orders[2]


def test_exploiters_are_trained_in_turn_of_the_newest_snapshot_and_taken_up_where_they_were(tmp_path, monkeypatch):
    learner = LEARNER.replace(total_steps=160, seed=5)
    config = TINY.replace(learner=learner, exploiter_every=64, exploiter_steps=48, snapshot_every=10_000)
    config = config.replace(snapshot_score=1.0)
    asked, played = [], []

    def make_exploiter(target, folder, **given):
        assert given.pop("say")("a line") is None
        asked.append((target, folder, given))
        if len(asked) == 1:
            folder.mkdir(parents=True)
            (folder / CHECKPOINT).touch()
            raise KeyboardInterrupt
        return SimpleNamespace(run=lambda asked: None, folder=folder)

    def play_exploiter(run, target, *, games):
        played.append((run.folder, target, games))
        return [SimpleNamespace(score=lambda: 0.25, standing=lambda: "1-0-3")]

    monkeypatch.setattr(exploit, "make_exploiter", make_exploiter)
    monkeypatch.setattr(exploit, "play_exploiter", play_exploiter)
    with pytest.raises(KeyboardInterrupt):
        League(config, tmp_path, say=quiet).run()
    said = []
    league = League(config, tmp_path, resume=True, say=said.append)
    league.run()
    folders = [tmp_path / "exploiters" / f"exploiter_{number:03d}" for number in (0, 0, 1)]
    targets = [str(tmp_path / "pool" / f"snapshot_{number:03d}") for number in (1, 1, 2)]
    trained = learner.replace(evaluate_every=48)
    assert asked == [
        (target, folder, {"steps": 48, "learner": trained, "seed": seed, "resume": resume})
        for target, folder, seed, resume in zip(targets, folders, (1005, 1005, 1006), (False, True, False), strict=True)
    ]
    assert played == [(folder, target, 4) for folder, target in zip(folders[1:], targets[1:], strict=True)]
    assert (league.pool.exploiters, league.pool.exploiter_step, league.pool.target) == (2, 128, "")
    assert [member.kind for member in league.pool.members].count("exploiter") == 0
    assert "exploiter_000 against snapshot_001: 1-0-3" in said


def test_a_snapshot_is_rated_among_all_scripts_the_first_and_the_latest(tmp_path, monkeypatch):
    monkeypatch.setattr(rating, "_RATED", 2)
    league = League(PLAIN.replace(rivals=("halo",), scripts=("ring", "uniform")), tmp_path, say=quiet)
    for kind in ("snapshot", "exploiter"):
        for number in range(kind == "snapshot", 4):
            name = f"{kind}_{number:03d}"
            league.pool.members.append(Member(name, f"{kind}s/{name}", kind))
    held = []

    def tournament(names, config, folder, loader):
        held.append((names, config, folder, loader))
        return SimpleNamespace(players=tuple(names), play=lambda: held.append("played"), results=lambda: "results")

    def rate(results, anchor):
        held.append((results, anchor))
        return SimpleNamespace(values=100.0 * np.arange(len(held[0][0])))

    monkeypatch.setattr(rating, "Tournament", tournament)
    monkeypatch.setattr(rating, "rate", rate)
    made = Rating(league.pool, tmp_path, LEARNER.game, SerialExecutor())
    made.begin()
    found = made.end(lambda: False)
    (names, config, folder, loader), *then = held
    assert names == [
        "ring", "uniform", "pool/snapshot_000", "snapshots/snapshot_002", "snapshots/snapshot_003",
        "exploiters/exploiter_002", "exploiters/exploiter_003",
    ]  # fmt: skip
    assert found == 400.0
    assert then == ["played", ("results", "uniform")]
    assert (config.games, config.game, folder) == (rating._GAMES, LEARNER.game, tmp_path / "ratings")
    assert config.budget_ms >= 60_000  # a machine that stalls is no reason to lose
    assert [loader(name, LEARNER.game).name for name in ("ring", "pool/snapshot_000")] == ["ring", "snapshot_000"]


def test_a_league_tells_how_far_it_is_and_who_is_hardest(tmp_path):
    said = []
    league = League(PLAIN.replace(scripts=("ring", "uniform", "noise", "halo")), tmp_path, say=said.append)
    for member, score in zip(league.pool.members, (9.0, 1.0, 5.0, 2.0, 8.0), strict=True):
        member.score = score
    league.main.model.num_timesteps = 32
    league._report(123.4)
    assert " ".join(said[-1].split()) == (
        "25% 32 steps 123/s pool 5 mean 0.50 hardest uniform 0.10, halo 0.20, noise 0.50, snapshot_000 0.80"
    )
    told = league.main.logger.name_to_value
    assert {name: round(told[f"league/{name}"], 6) for name in ("pool", "mean_score", "lowest_score")} == {
        "pool": 5, "mean_score": 0.5, "lowest_score": 0.1,
    }  # fmt: skip


def test_a_league_goes_on_with_other_threads_and_one_that_is_replaced_leaves_nothing(tmp_path):
    League(PLAIN, tmp_path, say=quiet)
    longer = PLAIN.replace(learner=LEARNER.replace(total_steps=1024, threads=2))
    assert League(longer, tmp_path, resume=True, say=quiet).main.config.threads == 2
    for name in ("pool/old", "exploiters/old", "ratings/old"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("policy.json", "policy.safetensors", "notes.txt"):
        (tmp_path / name).touch()
    with pytest.raises(CheckpointError, match="holds a league"):
        League(PLAIN, tmp_path, say=quiet)
    assert (tmp_path / "ratings" / "old").exists()
    League(PLAIN, tmp_path, overwrite=True, say=quiet)
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.parent.name != "main"}
    snapshot = {"pool/snapshot_000", "pool/snapshot_000/policy.json", "pool/snapshot_000/policy.safetensors"}
    assert left == {"main", "pool", "league.json", "notes.txt"} | {"config.json"} | snapshot
    assert [member["name"] for member in json.loads((tmp_path / "league.json").read_text())["members"]] == [
        "uniform", "ring", "snapshot_000",
    ]  # fmt: skip


def test_the_card_of_a_leagues_tactic_says_whom_it_met_by_the_league_alone(tmp_path):
    config = PLAIN.replace(learner=LEARNER.replace(total_steps=32), seats=3)
    policy = League(config, tmp_path / "league", say=quiet, command="swarm-pz league").run()
    assert "opponents" not in policy.card["training"] and "learner" not in policy.card["league"]
    assert policy.card["league"]["seats"] == 3
    assert (policy.name, policy.card["command"], policy.card["steps"]) == ("league", "swarm-pz league", 32)
