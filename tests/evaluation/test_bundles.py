"""A player that travels is the same player where it arrives, or is refused."""

from __future__ import annotations

import pickle
import shutil
from pathlib import Path

import pytest

import swarm_pz.policies.zoo
from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError, WorkerError
from swarm_pz.evaluation import bundles
from swarm_pz.evaluation.bundles import PolicyBundle, VerifyingLoader
from swarm_pz.evaluation.tournament import TournamentConfig, play_block, play_block_elsewhere
from swarm_pz.policy import folder_of

GAME = GameConfig(time_limit=2.0, drones_per_team=2)


@pytest.fixture
def folder(tmp_path):
    place = Path(swarm_pz.policies.zoo.__file__).parent / "champion"
    shutil.copytree(place, tmp_path / "mine")
    (tmp_path / "mine" / "logs").mkdir()
    (tmp_path / "mine" / ".lock").touch()
    return tmp_path / "mine"


def test_a_folder_that_is_gone_plays_from_its_parcel(folder):
    digest = policies.load(str(folder), GAME).digest
    bundle = pickle.loads(pickle.dumps(PolicyBundle.of(folder)))  # noqa: S301
    assert [name for name, _ in bundle.files] == ["policy.safetensors", "policy.json"], "the card last"
    config = TournamentConfig(game=GAME)
    there = play_block(policies.load, str(folder), "ring", [0, 1], config)
    name = str(folder)
    shutil.rmtree(folder)
    here = play_block_elsewhere(policies.load, name, "ring", [0, 1], config, {name: digest}, bundle, None)
    assert [(game.key, game.fingerprint) for game in here] == [(game.key, game.fingerprint) for game in there]


def test_another_player_of_the_name_is_refused_and_forfeits_nothing(folder):
    bundle, name = PolicyBundle.of(folder), str(folder)
    with pytest.raises(WorkerError, match=f"{name} is another on .*: expected digest 123, got [0-9a-f]+"):
        play_block_elsewhere(policies.load, name, "ring", [0], TournamentConfig(game=GAME), {name: "123"}, bundle, None)
    with pytest.raises(WorkerError, match=r"champion is another on .*: expected digest None"):
        VerifyingLoader(policies.load, {}, {})("champion", GAME)


def test_a_player_that_is_not_there_is_refused_and_forfeits_nothing():
    with pytest.raises(WorkerError, match=r"cannot load no_such: there is no policy 'no_such'"):
        play_block_elsewhere(policies.load, "no_such", "ring", [0], TournamentConfig(game=GAME), {}, None, None)


def test_a_folder_that_is_too_large_is_refused_with_its_size(folder, monkeypatch):
    monkeypatch.setattr(bundles, "MOST_BYTES", 1000)
    with pytest.raises(PolicyError, match=r"mine is too large .* expected 1,000 bytes or fewer, got [\d,]+"):
        PolicyBundle.of(folder)


def test_only_names_that_are_folders_travel(folder, monkeypatch):
    monkeypatch.chdir(folder.parent)
    (folder.parent / "ring").mkdir()
    assert folder_of("mine") == Path("mine") and folder_of(str(folder)) == folder
    assert folder_of("ring") is None and folder_of("planner:ring") is None and folder_of("no_such") is None
