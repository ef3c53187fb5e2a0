from __future__ import annotations

import json

import numpy as np
import pytest
from safetensors.numpy import save_file
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnvWrapper

from swarm_pz import policies
from swarm_pz.config import CHANNELS, MOTION_CHANNELS, CaptureConfig, GameConfig, ObservationConfig
from swarm_pz.errors import CheckpointError, ConfigError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.simulator.spawn import random_start
from swarm_pz.training.callbacks import PeriodicEvaluation
from swarm_pz.training.checkpoint import CHECKPOINT
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.networks import GridPolicy
from swarm_pz.training.ppo import Training
from swarm_pz.training.report import compare, plot_learning_curve, plot_sizes
from swarm_pz.training.vec_env import SwarmVecEnv

TINY = TrainConfig(
    game=GameConfig(observation=ObservationConfig(grid=10), drones_per_team=2, time_limit=5.0),
    total_steps=64,
    num_envs=4,
    rollout=8,
    batch_size=16,
    epochs=1,
    learning_rate=5e-4,
    width=8,
    evaluate_every=32,
    evaluation_games=2,
    checkpoint_every=32,
    threads=1,
)


def quiet(line: str) -> None:
    """Drop a line of progress."""


def weights(policy: LearnedPolicy) -> list[np.ndarray]:
    return [values.numpy() for values in policy._actor.state_dict().values()]


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "tiny"
    run = Training(TINY, folder, say=quiet)
    return run, run.run(), folder


def test_two_seeded_runs_agree_and_another_seed_differs(trained, tmp_path):
    _, policy, _ = trained
    again = Training(TINY, tmp_path / "again", say=quiet).run()
    other = Training(TINY.replace(seed=1), tmp_path / "other", say=quiet).run()
    for one, two in zip(weights(policy), weights(again), strict=True):
        np.testing.assert_array_equal(one, two)
    assert any(not np.array_equal(one, two) for one, two in zip(weights(policy), weights(other), strict=True))


@pytest.mark.parametrize("grid", [5, 10])
def test_more_channels_than_rows_are_learned_from_too(tmp_path, grid):
    """SB3 would take the shortest side of an image for its channels."""
    observation = ObservationConfig(grid=grid, channels=CHANNELS + MOTION_CHANNELS)
    config = TINY.replace(game=TINY.game.replace(observation=observation))
    policy = Training(config, tmp_path / "run", say=quiet).run()
    loaded = policies.load(tmp_path / "run", TINY.game)
    seen = np.random.default_rng(0).integers(0, 256, (3, 13, grid, grid)).astype(np.uint8)
    np.testing.assert_array_equal(loaded.act(seen, np.arange(3)), policy.act(seen, np.arange(3)))
    assert play_match(loaded, "ring", games=2, config=TINY.game).games


def test_the_written_policy_loads_and_plays_as_it_did(trained):
    _, policy, folder = trained
    loaded = policies.load(folder, TINY.game)
    seen = np.random.default_rng(0).integers(0, 256, (3, 9, 10, 10)).astype(np.uint8)
    np.testing.assert_array_equal(policy.act(seen, np.arange(3)), loaded.act(seen, np.arange(3)))
    assert play_match(loaded, "uniform", games=2, config=TINY.game).summary()["games"] == 2
    assert loaded.card["config_hash"] == TINY.game.hash
    assert loaded.card["steps"] >= 64


def test_the_played_action_is_the_mean_of_sb3s_policy(trained):
    run, policy, _ = trained
    seen = np.random.default_rng(0).integers(0, 256, (3, 9, 10, 10)).astype(np.uint8)
    mean, _ = run.model.predict(seen, deterministic=True)
    from swarm_pz.spaces.actions import command_from_action

    expected = command_from_action(np.clip(mean, -1, 1).astype(np.float64), 10, is_log=True)
    np.testing.assert_allclose(policy.act(seen, np.arange(3)), expected, rtol=1e-5)


def test_history_checkpoint_and_curve_are_written(trained):
    run, _, folder = trained
    steps = [record["step"] for record in run.history.records]
    assert steps == [0, 32, 64]
    assert json.loads((folder / "history.json").read_text())["records"] == run.history.records
    assert TrainConfig.from_dict(json.loads((folder / "config.json").read_text())) == TINY
    assert list((folder / "tensorboard").iterdir())
    plot_learning_curve(run.history, "uniform", folder / "curve.png")
    assert (folder / "curve.png").stat().st_size > 10_000
    plot_sizes(play_match("ring", "uniform", games=2, config=TINY.game), folder / "sizes.png")
    assert (folder / "sizes.png").stat().st_size > 10_000


def test_a_run_goes_on_from_its_checkpoint(trained, tmp_path):
    first = Training(TINY, tmp_path / "run", say=quiet)
    first.run()
    lines = []
    longer = Training(TINY.replace(total_steps=128), tmp_path / "run", resume=True, say=lines.append)
    assert longer.model.num_timesteps == 64
    assert "resuming" in lines[0]
    longer.run()
    assert longer.model.num_timesteps == 128
    assert [record["step"] for record in longer.history.records] == [0, 32, 64, 96, 128]


def test_a_fresh_run_leaves_nothing_of_an_earlier_one(trained, tmp_path):
    Training(TINY, tmp_path / "run", say=quiet).run()
    Training(TINY.replace(seed=5), tmp_path / "run", overwrite=True, say=quiet)
    again = Training(TINY.replace(seed=5), tmp_path / "run", resume=True, say=quiet)
    assert again.model.num_timesteps == 0
    assert not (tmp_path / "run" / "policy.json").exists()


def test_exploration_fades_from_the_first_rollout_to_the_last(tmp_path):
    seen = []

    class Note(BaseCallback):
        def _on_step(self):
            seen.append((self.num_timesteps, float(self.model.policy.log_std.mean())))
            return True

    run = Training(TINY.replace(log_std=-0.5, final_log_std=-2.5), tmp_path, say=quiet)
    run.learn(64, Note())
    spreads = dict(seen)
    assert spreads[4] == spreads[32] == pytest.approx(-0.5)
    assert spreads[36] == spreads[64] == pytest.approx(-1.5)
    assert run.exploration() == pytest.approx(np.exp(-2.5))


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
    assert trained
    assert evaluated
    assert reported
    assert not trained & evaluated
    assert not trained & reported
    assert not evaluated & reported
    run.learn(64, evaluation)
    assert evaluated & begun_by(evaluation.evaluate)  # the same ones every time, however far the run is


def test_a_run_whose_steps_do_not_fill_its_rollouts_still_learns(tmp_path):
    rates = []
    run = Training(TINY.replace(total_steps=40), tmp_path, say=quiet)
    schedule = run.model.lr_schedule
    run.model.lr_schedule = lambda left: rates.append(schedule(left)) or rates[-1]
    run.run()
    assert min(rates) > 0.0


def test_a_learned_policys_answers_do_not_depend_on_the_batch(trained):
    _, policy, _ = trained
    seen = np.random.default_rng(0).integers(0, 256, (70, 9, 10, 10)).astype(np.uint8)
    together = policy.act(seen, np.arange(70))
    for row in (0, 1, 69):
        np.testing.assert_array_equal(policy.act(seen[row : row + 1], np.array([row]))[0], together[row])


def test_a_checkpoint_of_another_configuration_is_refused(trained):
    _, _, folder = trained
    with pytest.raises(CheckpointError, match="another configuration"):
        Training(TINY.replace(gamma=0.5), folder, resume=True, say=quiet)


def test_card_and_history_say_what_they_come_from(trained):
    _, policy, folder = trained
    history = json.loads((folder / "history.json").read_text())
    for story in (policy.card, json.loads((folder / "policy.json").read_text()), history):
        assert story["rules_hash"] == TINY.game.rules_hash
        assert GameConfig.from_dict(story["rules"]).rules_hash == TINY.game.rules_hash
        assert set(story["versions"]) >= {"python", "swarm-pz", "numpy", "numba", "torch", "stable-baselines3"}
        assert story["command"] == ""


@pytest.mark.parametrize("content", [b"", b"not a checkpoint", b"PK\x03\x04 torn"])
def test_a_corrupt_checkpoint_is_refused(tmp_path, content):
    (tmp_path / CHECKPOINT).write_bytes(content)
    with pytest.raises(CheckpointError, match="corrupt or foreign"):
        Training(TINY, tmp_path, resume=True, say=quiet)


def test_a_foreign_checkpoint_is_refused(tmp_path):
    save_file({"something": np.zeros(3)}, tmp_path / CHECKPOINT)
    with pytest.raises(CheckpointError, match="corrupt or foreign"):
        Training(TINY, tmp_path, resume=True, say=quiet)


def tamper(folder, change):
    card = json.loads((folder / "policy.json").read_text())
    change(card)
    (folder / "policy.json").write_text(json.dumps(card))


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda folder: (folder / "policy.safetensors").unlink(), "policy.safetensors is missing"),
        (lambda folder: (folder / "policy.safetensors").write_bytes(b"torn"), "corrupt or foreign"),
        (lambda folder: (folder / "policy.json").write_text("{"), "corrupt or foreign"),
        (lambda folder: (folder / "policy.json").write_text("[]"), "must hold a JSON object"),
        (lambda folder: tamper(folder, lambda card: card.pop("grid")), "card must hold"),
        (lambda folder: tamper(folder, lambda card: card.update(format=99)), "format"),
        (lambda folder: tamper(folder, lambda card: card.update(width=16)), "do not fit its card"),
        (lambda folder: tamper(folder, lambda card: card.update(grid=7)), "do not fit its card"),
        (lambda folder: tamper(folder, lambda card: card.update(width="wide")), "do not fit its card"),
        (lambda folder: tamper(folder, lambda card: card.update(action_cells=0)), "do not fit its card"),
        (lambda folder: tamper(folder, lambda card: card.update(channels=5)), "channels"),
    ],
)
def test_spoiled_policies_are_refused(trained, tmp_path, spoil, message):
    _, policy, _ = trained
    policy.write(tmp_path / "policy")
    spoil(tmp_path / "policy")
    with pytest.raises(CheckpointError, match=message):
        policies.load(tmp_path / "policy", TINY.game)


def test_weights_that_are_not_numbers_are_refused(trained):
    _, policy, _ = trained
    spoiled = {name: np.full_like(values, np.nan) for name, values in policy._actor.state_dict().items()}
    with pytest.raises(CheckpointError, match="finite"):
        LearnedPolicy(policy.card, {name: np.asarray(values) for name, values in spoiled.items()}, TINY.game, "spoiled")


def test_bad_settings_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="action_cells must be a divisor"):
        TrainConfig(action_cells=3)
    with pytest.raises(ConfigError, match="opponents must be a tuple"):
        TrainConfig(opponents="ring")
    for name, value in (("sizes", 5), ("num_envs", None), ("game", 5), ("opponents", (1,)), ("opponents", None)):
        with pytest.raises(ConfigError, match=f"{name} must be"):
            TrainConfig(**{name: value})
    with pytest.raises(ConfigError, match="evaluation_games must be even"):
        TrainConfig(evaluation_games=3)
    with pytest.raises(ConfigError, match="num_envs must be a multiple of 3"):
        TrainConfig(sizes=(5, 10, 20))
    with pytest.raises(ConfigError, match="'grids', which the network is made for"):
        TrainConfig(game=GameConfig(observation=ObservationConfig(kind="entities")))
    with pytest.raises(ConfigError, match="did you mean 'learning_rate'"):
        TrainConfig(learn_rate=0.1)
    with pytest.raises(PolicyError, match="no policy 'rign'"):
        Training(TINY.replace(opponents=("rign",)), tmp_path, say=quiet)


def test_a_run_may_meet_several_sizes(tmp_path):
    run = Training(TINY.replace(sizes=(1, 3)), tmp_path, say=quiet)
    assert [part.duel.config.team_sizes for part in run.env.parts] == [(1, 1), (3, 3)]
    run.run()
    assert LearnedPolicy.read(tmp_path, TINY.game).card["training"]["sizes"] == [1, 3]


class Gather(VecEnvWrapper):
    """A toy task with a known answer, the same in all orientations: the closer to the centre, the better."""

    place = (0.5, 0.5)

    def reset(self):
        return self.venv.reset()

    def step_wait(self):
        seen, _, dones, infos = self.venv.step_wait()
        return seen, self.closeness(), dones, infos

    def closeness(self):
        simulator = self.venv.duel.batch.simulator
        own = simulator.teams == self.venv.duel.sides[:, None]
        distance = np.linalg.norm(simulator.positions - self.place, axis=-1)
        return (1.0 - (distance * own).sum(axis=1) / own.sum(axis=1)).astype(np.float32)


def test_learning_finds_the_place_that_is_rewarded():
    game = GameConfig(
        observation=ObservationConfig(grid=10), drones_per_team=4, time_limit=20.0, capture=CaptureConfig(enabled=False)
    )
    env = Gather(SwarmVecEnv(game, 64, action_cells=5))
    model = PPO(
        GridPolicy, env, n_steps=20, batch_size=256, n_epochs=6, learning_rate=2e-3, gamma=0.8, seed=0, device="cpu",
        policy_kwargs={"width": 16, "log_std_init": -0.7},
    )  # fmt: skip

    def mean_closeness():
        seen, total = env.reset(), 0.0
        for _ in range(19):
            seen, closeness, _, _ = env.step(model.predict(seen, deterministic=True)[0])
            total += closeness.mean() / 19
        return total

    before = mean_closeness()
    model.learn(64 * 20 * 25)
    after = mean_closeness()
    assert after > before + 0.1
