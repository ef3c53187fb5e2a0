"""A published protocol never changes, and another rule or opponent than it names is refused."""

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError
from swarm_pz.standard.games import all_tracks
from swarm_pz.standard.protocol import Protocol

FROZEN = {"1": "10568d00d6437bad"}
"""Digests of the versions that were published. Never change one: what is changed becomes the next version."""
GOLDEN = "dc55a94b5ec8c8da"
"""Of the golden games, which say what the rules do: if they change, results of before and after do not compare."""


@pytest.fixture(scope="module")
def protocol():
    return Protocol.read()


def test_a_published_version_never_changes(protocol):
    assert protocol.digest == FROZEN[protocol.version]
    protocol.check()  # that its opponents are those that are installed


def test_the_games_behind_a_version_never_change():
    whole = hashlib.sha256()
    for path in sorted((Path(__file__).parents[1] / "golden").rglob("*")):
        if path.is_file():
            whole.update(path.name.encode() + path.read_bytes())
    assert whole.hexdigest()[:16] == GOLDEN, "golden games changed: publish the next version of the protocol"


def test_other_opponents_or_rules_than_the_named_ones_are_refused(protocol):
    track = protocol.tracks[0]
    other = replace(track, trials=(replace(track.trials[0], digest="0" * 32),))
    with pytest.raises(ResultsError, match=r"uniform \(expected 0000"):
        replace(protocol, tracks=(other,)).check()
    with pytest.raises(ResultsError, match="rules of protocol 1"):
        replace(protocol, plain=protocol.plain | {"rules_hash": "0" * 16}).check()


def test_tracks_have_seeds_and_opponents_and_trials_rules_of_their_own(protocol):
    tracks = all_tracks(protocol)
    assert [track.name for track in tracks] == ["uniform", "field", "held-out", "systems", "robust"]
    assert len({track.seed for track in tracks}) == len(tracks)
    for track in protocol.tracks:
        assert track.games % 2 == 0 and len({trial.name for trial in track.trials}) == len(track.trials)
    trials = {trial.name: trial for track in protocol.tracks for trial in track.trials}
    assert trials["ring, 7 a team"].game(GameConfig()).drones_per_team == 7
    assert trials["lasso, trails of 7 s"].game(GameConfig()).memory.trail == 7.0
    assert trials["direct"].game(GameConfig()).team_controllers == ("ergodic", "direct")


def test_a_try_is_another_protocol(protocol):
    quick = protocol.quick()
    assert quick.version == f"{protocol.version}-quick" and quick.digest != protocol.digest
    assert {track.games for track in all_tracks(quick)} == {2}
    assert quick.game.time_limit == 20.0 and quick.robust.steps < protocol.robust.steps
