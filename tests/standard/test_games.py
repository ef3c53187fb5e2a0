"""Players and rules of a track's games."""

from dataclasses import replace

import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.ledger import PlayedGame
from swarm_pz.standard.games import Line, PlayerFactory, TrackGames, line_of

FACTORY = PlayerFactory(("ring", "halo"), (), ("chase", "noise"))


def test_each_name_of_a_track_is_its_own_player():
    names = ("entry 0", "entry 1", "learned 0", "learned 1")
    assert [FACTORY(name, GameConfig()).name for name in names] == ["ring", "halo", "chase", "noise"]
    for name in ("entry 2", "learned 2", "entry", "entry -1", "nobody 0", "ring"):
        with pytest.raises(ResultsError, match="nobody is called"):
            FACTORY(name, GameConfig())


def test_games_are_played_by_the_tracks_seed_and_the_trials_rules(tiny, tmp_path):
    tracks = {track.name: replace(track, seed=70 + number) for number, track in enumerate(tiny.tracks)}
    factory = replace(FACTORY, trials=tracks["systems"].trials)
    games = TrackGames(tracks["systems"], tiny, factory, tmp_path, digests=["", "another"])
    assert games.pairings() == [("entry 0", "direct"), ("entry 1", "direct")]
    rules = games.rules_of("entry 1", "direct")
    assert rules.game.team_controllers == ("ergodic", "direct") and rules.game.time_limit == tiny.game.time_limit
    assert rules.game.dynamics.min_speed == 0.3 and tiny.game.dynamics.min_speed == 0.0
    assert (rules.seed, rules.games, rules.budget_ms) == (tracks["systems"].seed, 4, tiny.budget_ms)
    given = {"digests": ["", tracks["field"].trials[0].digest], "attackers": [(1, "learned 1")]}
    factory = replace(FACTORY, trials=tracks["field"].trials)
    games = TrackGames(tracks["field"], tiny, factory, tmp_path / "attacked", **given)
    met = [("entry 0", "ring"), ("entry 0", "uniform"), ("entry 1", "uniform"), ("entry 1", "learned 1")]
    assert games.pairings() == met, "the second is the first opponent, and does not meet itself"


def test_a_line_is_the_entrys_side_of_a_game(tiny, tmp_path):
    ended = {"outcome": "loss", "share": 0.25, "seconds": 12.34567, "fingerprint": "ab", "forfeit": "late"}
    played = PlayedGame(one="entry 1", other="uniform", number=3, **ended, thinking_ms=(3.0, 5.0))
    assert line_of("uniform", played) == Line("uniform", 1, "uniform", 3, "loss", 0.25, 12.3457, "late")
    factory = replace(FACTORY, trials=tiny.tracks[0].trials)
    games = TrackGames(tiny.tracks[0], tiny, factory, tmp_path, digests=["", ""])
    games.games = {one.key: one for one in (played, replace(played, number=2, forfeit=""))}
    assert games.thinking_ms() == [3.0], "of games that were not forfeited"
