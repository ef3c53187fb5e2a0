from dataclasses import replace
from functools import partial

import pytest

from swarm_pz.standard import Entry, Protocol, figures, run
from swarm_pz.training import exploit


@pytest.fixture(scope="package", autouse=True)
def little_work():
    """Use fewer resamples and imitation steps than real reports."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(exploit, "fit", partial(exploit.fit, steps=10))
        patch.setattr(figures, "RESAMPLES", 200)
        yield


@pytest.fixture(scope="package")
def tiny():
    """Return the protocol with one or two opponents a track, short games and few attacks; not marked as a try."""
    whole = Protocol.read()
    names = ("uniform", "ring", "strip", "direct")
    tracks = tuple(
        replace(track, games=4, late_games=2, trials=tuple(trial for trial in track.trials if trial.name in names))
        for track in whole.tracks
    )
    robust = replace(whole.robust, games=6, choice_games=4, exploiters=2, steps=320, recorded_games=2)
    robust = replace(robust, generations=1, candidates=4, search_games=2)
    alone = {
        kind: {"score": won, "score_ci95": [won - 0.1, won + 0.1]}
        for kind, won in (("constant", 0.5), ("sequence", 0.25), ("lap", 0.125))
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
