from dataclasses import replace

import pytest

from swarm_pz.standard import Entry, Protocol, aggregate, run

RESAMPLES = aggregate.RESAMPLES


@pytest.fixture(scope="package", autouse=True)
def few_resamples():
    """Take fewer resamples than results do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(aggregate, "RESAMPLES", 200)
        yield


@pytest.fixture
def all_resamples(monkeypatch):
    """Take as many resamples as results do."""
    monkeypatch.setattr(aggregate, "RESAMPLES", RESAMPLES)


@pytest.fixture(scope="package")
def tiny():
    """The protocol with a short opponent or two a track, and hardly any budget for attacks; it is no try."""
    whole = Protocol.read()
    names = ("uniform", "ring", "strip", "direct")
    tracks = tuple(
        replace(track, games=4, trials=tuple(trial for trial in track.trials if trial.name in names))
        for track in whole.tracks
    )
    robust = replace(whole.robust, games=4, exploiters=4, steps=256, generations=2, candidates=4, search_games=2)
    alone = {
        kind: {"score": won, "score_ci95": [won - 0.1, won + 0.1], "opponents": {"uniform": won, "ring": 1.0}}
        for kind, won in (("constant", 0.5), ("sequence", 0.25))
    }
    game = whole.game.replace(time_limit=3.0)
    plain = whole.plain | {"version": "tiny", "open_loop": {"field": alone}}
    return replace(whole, version="tiny", game=game, tracks=tracks, robust=robust, plain=plain)


@pytest.fixture(scope="package")
def reported(tiny, tmp_path_factory):
    """The folder of a finished report."""
    out = tmp_path_factory.mktemp("report")
    run(Entry(policies=("champion", "ring"), name="two"), out, protocol=tiny)
    return out
