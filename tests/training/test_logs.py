from __future__ import annotations

import itertools
import sys

import pytest

from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import ConfigError, MissingExtraError
from swarm_pz.evaluation.match import play_match
from swarm_pz.training.callbacks import _mean_reward
from swarm_pz.training.ppo import Training
from tests.training.runs import TINY, quiet, stop

# Called as the two libraries are: trackio takes neither an id nor a folder.
FAKE = """
calls = []
def init(project, name, config, resume{more}):
    calls.append(("init", project, name, resume, {given}))
    return Run()
class Run:
    def log(self, values, step):
        calls.append(("log", step, values))
def finish():
    calls.append(("finish",))
"""


@pytest.fixture
def trackers(tmp_path, monkeypatch):
    (tmp_path / "trackio.py").write_text(FAKE.format(more="", given="None"))
    (tmp_path / "wandb.py").write_text(FAKE.format(more=", id, dir", given="(id, dir)"))
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("trackio", "wandb"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    yield ("trackio", "wandb")
    for name in ("trackio", "wandb"):
        sys.modules.pop(name, None)


def test_a_resumed_run_goes_on_in_its_trackers_where_it_was_and_another_one_begins_anew(trackers, tmp_path):
    """Else its curves would begin at step 0, in a run of their own, or would not be whole after Ctrl-C."""
    config, folder = TINY.replace(total_steps=96), tmp_path / "mine"
    stop(Training(config, folder, say=quiet, log=trackers), 2)
    resumed = Training(config, folder, say=quiet, log=trackers, resume=True)
    resumed.run()
    Training(config, folder, say=quiet, log=trackers, overwrite=True).run()
    assert not (folder / "tensorboard").exists()
    begun = {}
    for tracker in trackers:
        calls = sys.modules[tracker].calls
        kinds = [kind for kind, _ in itertools.groupby(call[0] for call in calls)]
        assert kinds == ["init", "log", "finish"] * 3
        begun[tracker] = [call[1:] for call in calls if call[0] == "init"]
        sittings = [list(part) for is_log, part in itertools.groupby(calls, lambda call: call[0] == "log") if is_log]
        steps = [step for _, step, _ in sittings[0] + sittings[1]]
        assert steps == sorted(steps) and {*steps} == {0, 32, 64, 96} and {s[1] for s in sittings[1]} == {64, 96}
        values = {key: value for _, _, told in sittings[0] + sittings[1] for key, value in told.items()}
        assert {type(value) for value in values.values()} == {float}
        assert values.keys() >= {
            "rollout/ep_rew_mean", "rollout/ep_len_mean", "rollout/success_rate", "train/loss", "time/fps",
            "eval/mean_reward", "eval/success_rate",
        }, "names that plots of other libraries' runs have"  # fmt: skip
        assert values["eval/success_rate"] == resumed.history[-1]["win_rate"]
    (first, again, other), wandb = begun["trackio"], begun["wandb"]
    assert first == again != other and first[:1] == ("swarm-pz",) and first[1].startswith("mine-")
    assert [call[:3] for call in wandb] == [first[:3], again[:3], other[:3]]
    assert [call[3] for call in wandb] == [(call[1].removeprefix("mine-"), str(folder)) for call in begun["trackio"]]


def test_logs_that_cannot_be_had_are_refused_before_a_run_is_replaced(trackers, tmp_path, monkeypatch):
    """And not after hours, or with a traceback."""
    monkeypatch.setitem(sys.modules, "wandb", None)
    for names, error, message in (
        (("tensorbord",), ConfigError, "did you mean 'tensorboard'.*trackio, wandb"),
        (
            ("tensorboard", "wandb"),
            MissingExtraError,
            "wandb is not installed; .* -m pip install wandb",
        ),
    ):
        with pytest.raises(error, match=message):
            Training(TINY, tmp_path / "run", say=quiet, log=names)
    assert not (tmp_path / "run").exists()


def test_a_tracker_that_nobody_has_logged_in_to_is_said_in_a_line(trackers, tmp_path, monkeypatch):
    (tmp_path / "wandb.py").write_text("def init(**_):\n    raise RuntimeError('no key')\n")
    with pytest.raises(ConfigError, match="wandb cannot begin a run: no key; set wandb up"):
        Training(TINY, tmp_path / "run", say=quiet, log=("wandb",)).run()


def test_the_mean_reward_of_an_evaluation_is_what_the_environment_has_paid(monkeypatch):
    """Else it would not compare with rollout/ep_rew_mean: of the other side, or without the outcome."""
    paid, step = [], BatchEnv.step

    def noted(env, *given):
        paid.append((result := step(env, *given)).rewards.copy())
        return result

    monkeypatch.setattr(BatchEnv, "step", noted)
    game = TINY.game.replace(drones_per_team=(2, 3), time_limit=40.0)
    match = play_match("ring", "centre", games=6, config=game)
    total = sum(paid)
    expected = [total[row, row % 2] for row in range(6)]
    assert len({one.outcome for one in match.games}) > 1
    assert _mean_reward(match) == pytest.approx(sum(expected) / 6)
