"""A policy sent to a worker is the same there, or is refused."""

import pickle
import shutil
from pathlib import Path

import pytest

import swarm_pz.policies.zoo
from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError, WorkerError
from swarm_pz.evaluation import bundles
from swarm_pz.evaluation.bundles import PolicyBundle
from swarm_pz.evaluation.tournament import TournamentConfig, play_block
from swarm_pz.policy import folder_of

CONFIG = TournamentConfig(game=GameConfig(time_limit=2.0, drones_per_team=2))


@pytest.fixture
def folder(tmp_path):
    shutil.copytree(Path(swarm_pz.policies.zoo.__file__).parent / "champion", tmp_path / "mine")
    (tmp_path / "mine" / "logs").mkdir()
    (tmp_path / "mine" / ".lock").touch()
    return tmp_path / "mine"


def test_a_policy_whose_folder_is_gone_plays_from_its_bundle(folder):
    name, digest = str(folder), policies.load(str(folder), CONFIG.game).digest
    bundle = pickle.loads(pickle.dumps(PolicyBundle.of(folder)))  # noqa: S301
    assert [file for file, _ in bundle.files] == ["policy.safetensors", "policy.json"], "the card last"
    expected = play_block(policies.load, name, "ring", [0, 1], CONFIG)
    shutil.rmtree(folder)
    games = play_block(policies.load, name, "ring", [0, 1], CONFIG, {name: digest}, bundle, None)
    assert [(game.key, game.fingerprint) for game in games] == [(game.key, game.fingerprint) for game in expected]


@pytest.mark.parametrize(
    ("name", "digests", "reason"),
    [
        ("champion", {"champion": "123"}, "expected digest 123"),
        ("no_such", {}, "cannot load"),
    ],
)
def test_another_or_a_missing_policy_is_refused_and_forfeits_nothing(name, digests, reason):
    with pytest.raises(WorkerError, match=reason):
        play_block(policies.load, name, "ring", [0], CONFIG, digests, None, None)


def test_only_folders_travel_and_no_large_ones(folder, monkeypatch):
    monkeypatch.chdir(folder.parent)
    (folder.parent / "ring").mkdir()
    assert folder_of("mine") == Path("mine") and folder_of(str(folder)) == folder
    assert folder_of("ring") is None and folder_of("planner:ring") is None and folder_of("no_such") is None
    with pytest.raises(PolicyError, match="cannot be read"):
        PolicyBundle.of(folder / "nowhere")
    monkeypatch.setattr(bundles, "MOST_BYTES", 1000)
    with pytest.raises(PolicyError, match="1,000 bytes"):
        PolicyBundle.of(folder)
