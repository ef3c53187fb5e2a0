"""Players and rules of a track's games."""

from dataclasses import replace

import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.ledger import PlayedGame
from swarm_pz.standard.games import LatePlayer, Line, PlayerFactory, TrackGames, choice_of, line_of, worst_attackers

FACTORY = PlayerFactory(("ring", "halo"), (), ("chase", "noise"))


def test_each_name_of_a_track_is_its_own_player():
    names = ("entry 0", "entry 1", "itself 1", "learned 0", "learned 1")
    assert [FACTORY(name, GameConfig()).name for name in names] == ["ring", "halo", "halo", "chase", "noise"]
    for name in ("entry 2", "learned 2", "entry", "entry -1", "nobody 0", "ring"):
        with pytest.raises(ResultsError, match="nobody is called"):
            FACTORY(name, GameConfig())


class Counting:
    """Answers with images whose value counts its commands."""

    observation = ObservationConfig()

    def reset(self, seeds, rows):
        self.count = 0

    def act(self, observations, rows):
        self.count += 1
        return np.full((len(rows), 10, 10), self.count / 10.0) * (1.0 + rows[:, None, None])


class Planning(Counting):
    plan = lambda self, simulator, teams, rows: self.act(None, rows)  # noqa: E731


@pytest.mark.parametrize("player", [Counting(), Planning()])
def test_a_late_players_commands_come_one_later_in_each_game(player):
    late = LatePlayer(player, GameConfig())
    late.reset([1, 2], np.arange(2))
    ask = (lambda rows: late.plan(None, None, rows)) if hasattr(late, "plan") else (lambda rows: late.act(None, rows))
    both, one = np.arange(2), np.array([1])
    assert [ask(rows)[:, 0, 0].round(6).tolist() for rows in (both, both, one, both)] == [
        [1, 1],
        [0.1, 0.2],
        [0.4],
        [0.2, 0.6],
    ]
    late.reset([3], one)
    assert ask(both)[1].min() == 1.0, "a new game begins with uniform coverage"


def test_games_are_played_by_the_tracks_seed_and_the_trials_rules(tiny, tmp_path):
    tracks = {track.name: replace(track, seed=70 + number) for number, track in enumerate(tiny.tracks)}
    factory = replace(FACTORY, trials=tracks["systems"].trials)
    games = TrackGames(tracks["systems"], tiny, factory, tmp_path)
    assert games.pairings() == [("entry 0", "direct"), ("entry 1", "direct")]
    rules = games.rules_of("entry 1", "direct")
    assert rules.game.team_controllers == ("ergodic", "direct") and rules.game.time_limit == tiny.game.time_limit
    assert rules.game.dynamics.min_speed == 0.3 and tiny.game.dynamics.min_speed == 0.0
    assert (rules.seed, rules.games, rules.budget_ms) == (tracks["systems"].seed, 4, tiny.budget_ms)
    late = TrackGames(tracks["systems"].late, tiny, factory, tmp_path / "late")
    assert late.pairings()[0] == ("late 0", "direct") and late.rules_of("late 0", "direct").games == 2
    factory = replace(FACTORY, trials=tracks["field"].trials)
    games = TrackGames(choice_of(tiny), tiny, factory, tmp_path / "attacked", meetings=[(1, "learned 1"), (0, "ring")])
    assert games.pairings() == [("entry 1", "learned 1"), ("entry 0", "ring")]


def test_the_worst_attacker_of_each_policy_is_chosen_by_shares():
    lines = [
        Line("choice", policy, name, number, "loss", share, 1.0, "")
        for policy, name, shares in ((0, "a", (0.5, 0.2)), (0, "b", (0.3, 0.3)), (1, "a", (0.1, 0.0)))
        for number, share in enumerate(shares)
    ]
    assert worst_attackers(lines) == {0: "b", 1: "a"}


def test_a_line_is_the_entrys_side_of_a_game(tiny, tmp_path):
    ended = {"outcome": "loss", "share": 0.25, "seconds": 12.34567, "fingerprint": "ab", "forfeit": "late"}
    played = PlayedGame(one="entry 1", other="uniform", number=3, **ended, thinking_ms=(3.0, 5.0))
    assert line_of("uniform", played) == Line("uniform", 1, "uniform", 3, "loss", 0.25, 12.3457, "late")
    factory = replace(FACTORY, trials=tiny.tracks[0].trials)
    games = TrackGames(tiny.tracks[0], tiny, factory, tmp_path)
    games.games = {one.key: one for one in (played, replace(played, number=2, forfeit=""))}
    assert games.thinking_ms() == [3.0], "of games that were not forfeited"
