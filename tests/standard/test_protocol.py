from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError
from swarm_pz.standard.games import all_tracks
from swarm_pz.standard.protocol import FILE, Protocol

FROZEN = {"1": "10568d00d6437bad"}
"""Digests of the versions that were published. Never change one: what is changed becomes the next version."""
GOLDEN = "dc55a94b5ec8c8da"
"""Of the golden games, which say what the rules do: if they change, results of before and after do not compare."""


def test_a_published_version_never_changes():
    protocol = Protocol.read()
    assert protocol.digest == FROZEN[protocol.version]


def test_the_games_behind_a_version_never_change():
    whole = hashlib.sha256()
    for path in sorted((Path(__file__).parents[1] / "golden").rglob("*")):
        if path.is_file():
            whole.update(path.name.encode() + path.read_bytes())
    assert whole.hexdigest()[:16] == GOLDEN, "golden games changed: publish the next version of the protocol"


def test_who_is_installed_is_whom_the_protocol_names():
    Protocol.read().check()


def test_another_opponent_than_the_named_one_is_refused():
    protocol = Protocol.read()
    track = protocol.tracks[0]
    other = replace(track, trials=(replace(track.trials[0], digest="0" * 32),))
    with pytest.raises(ResultsError, match=r"opponents of protocol 1 are others here: uniform \(expected 0000"):
        replace(protocol, tracks=(other,)).check()


def test_other_rules_than_the_named_ones_are_refused():
    protocol = Protocol.read()
    with pytest.raises(ResultsError, match="the rules of protocol 1 have another hash here"):
        replace(protocol, plain=protocol.plain | {"rules_hash": "0" * 16}).check()


def test_tracks_have_seeds_and_opponents_of_their_own():
    protocol = Protocol.read()
    tracks = all_tracks(protocol)
    assert [track.name for track in tracks] == ["uniform", "field", "held-out", "systems", "robust"]
    assert len({track.seed for track in tracks}) == len(tracks)
    for track in protocol.tracks:
        assert track.games % 2 == 0 and len({trial.name for trial in track.trials}) == len(track.trials)


def test_a_trial_has_rules_of_its_own():
    trials = {trial.name: trial for track in Protocol.read().tracks for trial in track.trials}
    assert trials["ring, 7 a team"].game(GameConfig()).drones_per_team == 7
    assert trials["lasso, trails of 7 s"].game(GameConfig()).memory.trail == 7.0
    assert trials["direct"].game(GameConfig()).team_controllers == ("ergodic", "direct")


def test_a_try_is_another_protocol():
    protocol = Protocol.read()
    assert protocol.quick().version == f"{protocol.version}-quick"
    assert protocol.quick().digest != protocol.digest
    assert {track.games for track in all_tracks(protocol.quick())} == {2}
    assert protocol.quick().game.time_limit == 20.0 and protocol.quick().robust.steps < protocol.robust.steps
    assert FILE.is_file()
