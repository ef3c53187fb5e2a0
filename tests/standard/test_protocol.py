"""Rules or opponents that the protocol does not name are refused."""

import hashlib
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError
from swarm_pz.standard.games import all_tracks
from swarm_pz.standard.protocol import FILE, Protocol, refresh

GOLDEN = "dc55a94b5ec8c8da"
"""Digest of the golden games: if they change, results of before and after do not compare."""


@pytest.fixture(scope="module")
def protocol():
    return Protocol.read()


def test_the_protocol_names_what_is_installed(tmp_path):
    shutil.copyfile(FILE, tmp_path / "protocol.json")
    refresh(tmp_path / "protocol.json")
    # If it fails, `scripts/board refresh` writes the digests of a protocol that is not published.
    assert (tmp_path / "protocol.json").read_text() == FILE.read_text()


def test_the_games_behind_a_version_never_change():
    games = Path(__file__).parents[1] / "golden" / "games.npz"
    whole = hashlib.sha256(games.name.encode() + games.read_bytes())
    assert whole.hexdigest()[:16] == GOLDEN, "golden games changed: play open_loop again, and publish the next version"


def test_other_opponents_or_rules_than_the_named_ones_are_refused(protocol):
    track = protocol.tracks[0]
    other = replace(track, trials=(replace(track.trials[0], digest="0" * 32),))
    with pytest.raises(ResultsError, match=r"uniform \(expected 0000"):
        replace(protocol, tracks=(other,)).check()
    with pytest.raises(ResultsError, match="rules of protocol 3"):
        replace(protocol, plain=protocol.plain | {"rules_hash": "0" * 16}).check()


def test_tracks_have_seeds_and_opponents_of_their_own(protocol):
    tracks = all_tracks(protocol)
    names = [name for one in ("uniform", "field", "generated", "systems") for name in (one, f"{one}, late")]
    assert [track.name for track in tracks] == [*names, "choice", "robust"]
    assert len({track.seed for track in tracks}) == len(protocol.tracks) + 2, "late games are the same"
    for track in tracks:
        assert track.games % 2 == 0 and len({trial.name for trial in track.trials}) == len(track.trials)
    trials = {trial.name: trial for track in protocol.tracks for trial in track.trials}
    assert trials["direct"].game(GameConfig()).team_controllers == ("ergodic", "direct")
    assert protocol.robust.best in trials


def test_a_try_is_another_protocol(protocol):
    quick = protocol.quick()
    assert quick.version == f"{protocol.version}-quick" and quick.digest != protocol.digest
    assert {track.games for track in all_tracks(quick)} == {2}
    alone = protocol.attacks_alone(3_000_000)
    assert alone.digest != protocol.digest and alone.robust.steps == 3_000_000
    assert {track.games for track in all_tracks(alone)} == {0, 40, 200}
    assert quick.game.time_limit == 20.0 and quick.robust.steps < protocol.robust.steps
