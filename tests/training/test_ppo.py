"""A run uses its settings, fills its folder, and learns."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnvWrapper

from swarm_pz import policies
from swarm_pz.config import CHANNELS, MOTION_CHANNELS, CaptureConfig, GameConfig, ObservationConfig
from swarm_pz.errors import CheckpointError, KindError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies.learned import lineage
from swarm_pz.policy import load
from swarm_pz.simulator.spawn import random_start
from swarm_pz.spaces.actions import command_from_action
from swarm_pz.standard.running import cost_of
from swarm_pz.training import ppo
from swarm_pz.training.callbacks import PeriodicEvaluation
from swarm_pz.training.checkpoint import CHECKPOINT, write
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.networks import GridPolicy
from swarm_pz.training.ppo import Training
from swarm_pz.training.report import compare
from swarm_pz.training.vec_env import SwarmVecEnv
from tests.training.runs import TINY, quiet

DIRECT = TINY.replace(game=TINY.game.replace(controllers=("direct", "ergodic")), opponents=("uniform",))


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "tiny"
    run = Training(TINY, folder, say=quiet, command="swarm-pz train")
    return run, run.run(), folder


def images(count, channels=9, grid=10):
    return np.random.default_rng(0).integers(0, 256, (count, channels, grid, grid)).astype(np.uint8)


def test_the_folder_holds_the_policy_with_its_story_and_how_the_run_went(trained):
    run, policy, folder = trained
    history, card = (json.loads((folder / name).read_text()) for name in ("history.json", "policy.json"))
    assert [record["step"] for record in history["records"]] == [0, 32, 64] and history["records"] == run.state.records
    assert TrainConfig.from_dict(json.loads((folder / "config.json").read_text())) == TINY
    assert list((folder / "tensorboard").iterdir())
    summary = play_match(policy, "uniform", games=2, seed=1_000_000, config=TINY.game).summary()
    expected = {"win_rate": summary["win_rate"], "loss_rate": summary["losses"] / 2, "share": summary["mean_share"]}
    expected |= dict(zip(("win_rate_low", "win_rate_high"), summary["win_rate_ci95"], strict=True))
    assert run.state.records[-1].items() >= expected.items(), (
        "of what is written, on seeds that are those of no training"
    )
    assert (card["config_hash"], card["steps"], policy.name) == (TINY.game.hash, 64, "tiny")
    for story in (policy.card, card, history):
        assert GameConfig.from_dict(story["rules"]).rules_hash == story["rules_hash"] == TINY.game.rules_hash
        assert set(story["versions"]) >= {"python", "swarm-pz", "numpy", "numba", "torch", "stable-baselines3"}
        assert story["command"] == "swarm-pz train"


def test_the_written_policy_plays_the_mean_of_sb3s_policy_in_every_batch(trained):
    run, _, folder = trained
    loaded, batch = policies.load(folder, TINY.game), images(70)
    together = loaded.act(batch, np.arange(70))
    mean, _ = run.model.predict(batch, deterministic=True)
    expected = command_from_action(np.clip(mean, -1, 1).astype(np.float64), 10, is_log=True)
    np.testing.assert_allclose(together, expected, rtol=1e-4)
    for row in (0, 1, 69):
        np.testing.assert_array_equal(loaded.act(batch[row : row + 1], np.array([row]))[0], together[row])
    assert play_match(loaded, "uniform", games=2, config=TINY.game).summary()["games"] == 2


def test_more_channels_than_rows_are_learned_from_too(tmp_path):
    """SB3 would take the shortest side of an image for its channels."""
    observation = ObservationConfig(grid=5, channels=CHANNELS + MOTION_CHANNELS)
    config = TINY.replace(game=TINY.game.replace(observation=observation), total_steps=32)
    policy = Training(config, tmp_path / "run", say=quiet).run()
    loaded, batch = policies.load(tmp_path / "run", TINY.game), images(3, 13, 5)
    np.testing.assert_array_equal(loaded.act(batch, np.arange(3)), policy.act(batch, np.arange(3)))


def test_what_learns_other_commands_than_densities_plays_them_and_no_others(tmp_path):
    Training(DIRECT.replace(total_steps=32), tmp_path / "run", say=quiet).run()
    resumed = Training(DIRECT, tmp_path / "run", say=quiet).run()
    assert resumed.card["steps"] == 64
    policy, rows = load(tmp_path / "run", DIRECT.game), np.arange(40)
    card = policy.card
    assert (card["answers"], card["shape"], card["head"]) == ("accelerations", [4, 2], "drones")
    batch = np.random.default_rng(0).random((40, 4, 5)).astype(np.float32)
    alone = np.concatenate([policy.act(batch[row : row + 1], rows[row : row + 1]) for row in rows])
    np.testing.assert_array_equal(policy.act(batch, rows), alone)
    assert len(play_match(policy, "uniform", games=2, config=DIRECT.game).games) == 2
    for rules, message in (
        ({"controllers": "ergodic"}, "kind 'accelerations', but the control system ergodic"),
        ({"drones_per_team": 3}, r"shape \(4, 2\), but direct takes those of shape \(6, 2\)"),
    ):
        with pytest.raises(KindError, match=message):
            load(tmp_path / "run", DIRECT.game.replace(**rules))


def test_the_settings_reach_the_algorithm(tmp_path, monkeypatch):
    threads = []
    monkeypatch.setattr(torch, "set_num_threads", threads.append)
    config = TINY.replace(
        epochs=3, gamma=0.5, gae_lambda=0.6, clip_range=0.3, entropy=0.01, learning_rate=0.5, log_std=-0.25,
        threads=3, width=16, seed=7, batch_size=1000, total_steps=1000,
    )  # fmt: skip
    model = Training(config, tmp_path, say=quiet).model
    assert (model.n_steps, model.batch_size, model.n_epochs) == (8, 8 * 4, 3)  # no batch is larger than a rollout
    assert (model.gamma, model.gae_lambda, model.clip_range(1.0), model.ent_coef) == (0.5, 0.6, 0.3, 0.01)
    assert (model.seed, model.n_envs, model.policy.width, threads) == (7, 4, 16, [3])
    assert model.policy.log_std.tolist() == [-0.25] * 25
    assert not model.policy.log_std.requires_grad  # only the schedule changes it
    for steps, rate in ((0, 0.5), (250, 0.375), (900, 0.05), (960, 0.025), (5000, 0.025)):
        model.num_timesteps = steps
        assert model.lr_schedule(1.0) == pytest.approx(rate)


def test_the_settings_reach_the_games_of_every_size(tmp_path):
    config = TINY.replace(sizes=(1, 3), action_cells=2, threads=2, opponents=("noise", "ring", "noise"))
    run = Training(config, tmp_path, say=quiet)
    for part, size in zip(run.env.parts, (1, 3), strict=True):
        simulator = part.duel.batch.simulator
        assert (part.duel.config, part.num_envs) == (config.game.replace(drones_per_team=size), 2)
        assert (part.action_space.shape, simulator.threads) == ((2, 2), 2)
        assert set(part.opponent_names) == {"noise", "ring"}
    run.env.close()


@pytest.mark.parametrize("name", ["policy.json", "league.json", "search.json"])
def test_a_folder_with_anything_else_that_was_trained_is_left_as_it_is(tmp_path, name):
    (tmp_path / name).write_text("old")
    with pytest.raises(CheckpointError, match=rf"holds another run, its {name}: choose another folder \(--out\)"):
        Training(TINY, tmp_path, say=quiet)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]


def test_a_run_may_go_on_longer_with_other_threads_but_not_with_other_settings(tmp_path):
    Training(TINY, tmp_path, say=quiet)
    lines, settings = [], {"evaluate_every": 7, "checkpoint_every": 9}
    Training(TINY.replace(total_steps=96, threads=2, **settings), tmp_path, say=lines.append)
    assert "was to have 64 steps" in lines[1]
    for changes in ({"seed": 1}, {"opponents": ("ring",)}, {"evaluation_games": 4}, {"gamma": 0.5}):
        with pytest.raises(CheckpointError, match="another configuration"):
            Training(TINY.replace(**changes), tmp_path, say=quiet)
    write(tmp_path / CHECKPOINT, {"config_hash": TINY.replace(**ppo.MAY_CHANGE).hash, "learner": {}}, {})
    with pytest.raises(CheckpointError, match="does not fit this run"):
        Training(TINY, tmp_path, say=quiet)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"opponents": ("rign",)}, PolicyError, "did you mean 'ring'"),
        ({"start_from": "prowl"}, KindError, "takes those of kind 'density'"),
        ({"start_from": "hunter"}, CheckpointError, "'hunter' has another network"),
    ],
)
def test_players_that_cannot_be_had_are_refused(tmp_path, changes, error, message):
    with pytest.raises(error, match=message):
        Training(TINY.replace(**changes), tmp_path, say=quiet)


def test_a_run_from_a_script_imitates_it_and_a_resumed_one_does_not_do_so_again(tmp_path, monkeypatch):
    fitted = []
    monkeypatch.setattr(ppo, "_IMITATED_GAMES", 2)
    monkeypatch.setattr(ppo, "fit", lambda actor, seen, wanted, _: fitted.append((actor, len(seen), len(wanted))))
    config = TINY.replace(start_from="ring")
    run = Training(config, tmp_path, say=quiet)
    Training(config, tmp_path, say=quiet)
    ((actor, seen, wanted),) = fitted
    assert actor is run.model.policy.actor and seen == wanted > 0


def test_a_card_lists_all_that_its_weights_were_trained_by(tmp_path):
    first = Training(TINY, tmp_path / "first", say=quiet).run()
    second = Training(TINY.replace(start_from=str(tmp_path / "first")), tmp_path / "second", say=quiet).run()
    third = Training(TINY.replace(start_from=str(tmp_path / "second")), tmp_path / "third", say=quiet).run()
    assert [(one["name"], one["steps"]) for one in lineage(third.card)] == [("", 64), ("second", 64), ("first", 64)]
    seconds = [policy.card["seconds"] for policy in (third, second, first)]
    assert cost_of(third) == {
        "commands": 192, "seconds": round(sum(seconds), 1), "at_least": [], "processor": None, "parameters": 399
    }  # fmt: skip


def test_training_its_evaluations_and_the_matches_after_it_are_on_different_games(tmp_path, monkeypatch):
    starts = []

    def noted(*args):
        positions, altitudes = random_start(*args)
        starts.append(positions.tobytes())
        return positions, altitudes

    monkeypatch.setattr("swarm_pz.simulator.simulator.random_start", noted)

    def begun_by(work):
        starts.clear()
        work()
        return set(starts)

    run = Training(TINY, tmp_path, say=quiet)
    trained = begun_by(lambda: run.learn(32))
    evaluation = PeriodicEvaluation(run.state, run.policy)
    evaluation.init_callback(run.model)
    evaluated = begun_by(evaluation.evaluate)
    final = {"games": 2, "seed": TINY.seed, "threads": 1}
    reported = begun_by(lambda: compare(run.policy(), run.untrained(), TINY.game, **final))
    assert trained and evaluated and reported
    assert not trained & evaluated and not trained & reported and not evaluated & reported
    run.learn(64, evaluation)
    assert evaluated & begun_by(evaluation.evaluate)  # the same games at any step of the run


class Gather(VecEnvWrapper):
    """A toy task with a known answer, the same in all orientations: the closer to the centre, the better."""

    def reset(self):
        return self.venv.reset()

    def step_wait(self):
        images, _, dones, infos = self.venv.step_wait()
        simulator = self.venv.duel.batch.simulator
        own = simulator.teams == self.venv.duel.sides[:, None]
        distance = np.linalg.norm(simulator.positions - 0.5, axis=-1)
        return images, (1.0 - (distance * own).sum(axis=1) / own.sum(axis=1)).astype(np.float32), dones, infos


def test_learning_finds_the_place_that_is_rewarded():
    calm = CaptureConfig(enabled=False)
    game = GameConfig(observation=ObservationConfig(grid=10), drones_per_team=4, time_limit=20.0, capture=calm)
    env = Gather(SwarmVecEnv(game, 64, action_cells=5, seed=0))
    model = PPO(
        GridPolicy, env, n_steps=20, batch_size=256, n_epochs=6, learning_rate=2e-3, gamma=0.8, seed=0, device="cpu",
        policy_kwargs={"width": 16, "log_std_init": -0.7},
    )  # fmt: skip

    def mean_closeness():
        images, total = env.reset(), 0.0
        for _ in range(19):
            images, closeness, _, _ = env.step(model.predict(images, deterministic=True)[0])
            total += closeness.mean() / 19
        return total

    before = mean_closeness()
    model.learn(64 * 20 * 12)
    assert mean_closeness() > before + 0.02  # of an untrained network on other games: before ± 0.001
