"""A dataset's folder: whole, or not there."""

import resource
import subprocess
import sys
from pathlib import Path

import minari
import pytest
from minari.dataset.minari_storage import MinariStorage

from swarm_pz.config import GameConfig
from swarm_pz.datasets import record_match
from swarm_pz.datasets.folder import name_for
from swarm_pz.errors import OutputError
from swarm_pz.evaluation.ledger import folder_lock

SHORT = GameConfig(drones_per_team=4, time_limit=6.0)
KILLED = """
import os, signal, sys
from pathlib import Path
from swarm_pz.config import GameConfig
from swarm_pz.datasets import record_match
record_match("ring", ["uniform"], root=Path(sys.argv[1]), games=1, config=GameConfig(drones_per_team=4, time_limit=6.0),
             progress=lambda *_: os.kill(os.getpid(), signal.SIGKILL))
"""


def test_a_full_disk_is_said_in_words_and_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # of what is imported meanwhile, Python would keep torn code
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, hard))  # the system then says "file too large"
    try:
        with pytest.raises(OutputError, match=r"swarm-ring-v0': file too large"):
            record_match("ring", ["uniform"], root=tmp_path, games=2, config=SHORT)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_process_left_is_gone_with_the_next_try_which_is_not_written_over(tmp_path):
    subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)  # noqa: S603
    (left,) = tmp_path.iterdir()
    assert left.name == ".swarm-ring-v0.draft"
    folder = record_match("ring", ["uniform"], root=tmp_path, games=1, config=SHORT)
    assert list(tmp_path.iterdir()) == [folder] and list(folder.iterdir()) == [folder / "data"]
    before = (folder / "data/main_data.hdf5").read_bytes()
    with pytest.raises(OutputError, match="is there already"):
        record_match("ring", ["uniform"], root=tmp_path, games=1, config=SHORT)
    assert (folder / "data/main_data.hdf5").read_bytes() == before


def test_a_dataset_that_another_process_makes_is_refused_at_once(tmp_path):
    told = []
    with folder_lock(tmp_path / ".swarm-ring-v0.draft"), pytest.raises(OutputError, match="another process"):
        record_match("ring", ["uniform"], root=tmp_path, games=1, config=SHORT, progress=lambda *now: told.append(now))
    assert told == []


def test_a_folder_may_be_named_from_here_and_may_be_no_file(tmp_path):
    folder = record_match("ring", ["uniform"], root=Path("runs/data"), games=1, config=SHORT)
    assert folder == Path("runs/data/swarm-ring-v0") and (tmp_path / folder / "data/metadata.json").is_file()
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="is a file"):
        record_match("ring", ["uniform"], root=tmp_path / "file", games=1, config=SHORT)


def test_minari_finds_the_dataset_in_its_own_folder_and_knows_where_it_is_from(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    record_match("ring", ["uniform"], name="mine/ring-v3", games=1, config=SHORT, command="swarm-pz dataset")
    dataset = minari.load_dataset("mine/ring-v3")
    assert dataset.total_steps == 6 and list(minari.list_local_datasets()) == ["mine/ring-v3"]
    told = MinariStorage.read_raw_metadata(tmp_path / "mine/ring-v3/data")
    assert told["rules_hash"] == SHORT.rules_hash and told["versions"]["swarm-pz"] and told["seeds"] == [0, 0]
    assert (told["player"], told["opponents"], told["command"]) == ("ring", ["uniform"], "swarm-pz dataset")


def test_a_datasets_usual_id_is_of_its_player():
    assert [name_for(player) for player in ("planner:ring", "runs/first", "../..")] == [
        "swarm-planner_ring-v0",
        "swarm-first-v0",
        "swarm-player-v0",
    ]
