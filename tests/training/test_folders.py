from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from swarm_pz.errors import CheckpointError, ConfigError
from swarm_pz.training.checkpoint import CHECKPOINT, write
from swarm_pz.training.folders import SETTINGS, check_folder, choose, held_by, next_free
from swarm_pz.training.ppo import Training
from swarm_pz.training.selfplay import League
from tests.training.runs import LEAGUE, TINY, quiet

RUNS = Path("runs")


def leave_run(folder, steps=64, total=128):
    folder.mkdir(parents=True)
    story = {"learner": {"steps": steps}, "total_steps": total, "finished": steps == total}
    write(folder / CHECKPOINT, story, {"weights": np.zeros(2)})


def test_a_folder_with_a_run_is_refused_with_three_ways_out():
    leave_run(RUNS / "first", 128)
    leave_run(RUNS / "first-2")
    with pytest.raises(CheckpointError) as refused:
        check_folder(RUNS / "first", resume=False, overwrite=False, mark=CHECKPOINT)
    for part in ("finished run of 128 steps", "--resume", "--overwrite", "--out runs/first-3"):
        assert part in str(refused.value)
    check_folder(RUNS / "first", resume=True, overwrite=False, mark=CHECKPOINT)
    check_folder(RUNS / "first", resume=False, overwrite=True, mark=CHECKPOINT)
    check_folder(RUNS / "third", resume=False, overwrite=False, mark=CHECKPOINT)


def test_resuming_without_a_run_is_refused():
    (RUNS / "empty").mkdir(parents=True)
    leave_run(RUNS / "league" / "main")
    (RUNS / "league" / "league.json").write_text("{}")
    league = "holds a league, a run at step 64 of 128"
    for name, said in (("none", "does not exist"), ("empty", "holds none"), ("league", league)):
        with pytest.raises(CheckpointError, match=f"expects a folder with {CHECKPOINT}.*{name} {said}"):
            check_folder(RUNS / name, resume=True, overwrite=False, mark=CHECKPOINT)


def test_a_run_goes_to_the_next_free_folder_and_the_latest_is_resumed():
    first = RUNS / "first"

    def chosen(out=None, **asked):
        return choose(out, first, **({"resume": False, "overwrite": False} | asked))

    assert chosen() == chosen(resume=True) == first
    leave_run(first)
    assert chosen() == next_free(first) == RUNS / "first-2"
    leave_run(RUNS / "first-2")
    assert (chosen(), chosen(resume=True)) == (RUNS / "first-3", RUNS / "first-2")
    assert chosen(Path("mine"), overwrite=True) == Path("mine")
    for asked in ({"overwrite": True}, {"out": first, "resume": True, "overwrite": True}):
        with pytest.raises(ConfigError, match=r"which run to replace|give one of them"):
            chosen(**asked)


@pytest.mark.parametrize(("kind", "save", "config"), [(Training, "save_checkpoint", TINY), (League, "_save", LEAGUE)])
def test_a_run_that_is_killed_after_its_first_checkpoint_has_settings_to_be_resumed_by(
    tmp_path, monkeypatch, kind, save, config
):
    write_checkpoint = getattr(kind, save)

    def write_and_die(run):
        write_checkpoint(run)
        raise KeyboardInterrupt

    monkeypatch.setattr(kind, save, write_and_die)
    with pytest.raises(KeyboardInterrupt):
        kind(config, tmp_path, say=quiet)
    assert held_by(tmp_path) is not None
    assert type(config).from_dict(json.loads((tmp_path / SETTINGS).read_text())) == config
