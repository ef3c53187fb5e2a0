"""Another rule or opponent than the protocol names is refused, and nobody meets itself."""

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


def test_the_protocol_names_what_is_installed(protocol, tmp_path):
    protocol.check()  # if it fails, `scripts/board refresh` writes the digests of a protocol that is not published
    shutil.copyfile(FILE, tmp_path / "protocol.json")
    refresh(tmp_path / "protocol.json")
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
    with pytest.raises(ResultsError, match="rules of protocol 2"):
        replace(protocol, plain=protocol.plain | {"rules_hash": "0" * 16}).check()


def test_tracks_have_seeds_and_opponents_of_their_own_and_figures_of_the_clock_alone(protocol):
    tracks = all_tracks(protocol)
    assert [track.name for track in tracks] == ["uniform", "field", "generated", "systems", "robust"]
    assert len({track.seed for track in tracks}) == len(tracks)
    for track in protocol.tracks:
        assert track.games % 2 == 0 and len({trial.name for trial in track.trials}) == len(track.trials)
        if (alone := protocol.open_loop.get(track.name)) or track.name == "field":
            assert all(set(one["opponents"]) == {trial.name for trial in track.trials} for one in alone.values())
    trials = {trial.name: trial for track in protocol.tracks for trial in track.trials}
    assert trials["direct"].game(GameConfig()).team_controllers == ("ergodic", "direct")


def test_nobody_meets_itself_and_the_only_opponent_of_a_track_is_no_entry(protocol):
    uniform, field, *_ = protocol.tracks
    champion = next(trial for trial in field.trials if trial.name == "champion")
    assert set(field.opponents("another")) - set(field.opponents(champion.digest)) == {"champion"}
    with pytest.raises(ResultsError, match="only opponent of track 'uniform'"):
        uniform.opponents(uniform.trials[0].digest)


def test_a_try_is_another_protocol(protocol):
    quick = protocol.quick()
    assert quick.version == f"{protocol.version}-quick" and quick.digest != protocol.digest
    assert {track.games for track in all_tracks(quick)} == {2}
    assert quick.game.time_limit == 20.0 and quick.robust.steps < protocol.robust.steps
