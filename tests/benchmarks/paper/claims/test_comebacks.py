from __future__ import annotations

import pytest

from benchmarks.paper.claims import comebacks
from swarm_pz.config import GameConfig
from tests.benchmarks.paper.given import SEED, game, results

SMALL = {"GAMES": 2, "PLAYERS": ("ring",)}
"""What makes the figure quick."""


@pytest.mark.parametrize(
    ("far", "near", "holds"),
    # Of 100 games 7 are more than 5 %, but not surely; 11 are.
    [(11, 40, True), (7, 40, False), (11, 7, False), (0, 0, False)],
)
def test_a_comeback_needs_surely_more_than_a_few_wins_of_the_strongest_from_both_handicaps(
    monkeypatch, far, near, holds
):
    asked = []

    def play(player, opponent, numbers, *, seed, config):
        asked.append((player, opponent, config.drones_per_team, [*numbers] == [*range(0, 200, 2)], seed))
        wins = {(1, 19): far, (3, 17): near}[config.drones_per_team] if player == "champion" else 100 - far
        return [game(2 * number, outcome) for number, outcome in enumerate(results(wins, 100, "draw"))]

    monkeypatch.setattr(comebacks, "play_games", play)
    monkeypatch.setattr(comebacks, "installed", lambda names, config: list(names))
    finding = comebacks.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic == {"win_rate_from_1_against_19": far / 100, "win_rate_from_3_against_17": near / 100}
    assert asked == [
        (player, "uniform", sizes, True, SEED)
        for sizes in ((1, 19), (3, 17))
        for player in ("ring", "hunter", "champion")
    ]
    assert finding.series["strongest"] == "champion"
    assert [(row["wins"], row["draws"]) for row in finding.series["rows"]][2] == (far, 100 - far)


def test_the_comeback_shown_is_a_won_one():
    histories = [[1, 1, 1, 0], [1, 2, 12, 20], [1, 2, 3, 20]]
    assert comebacks.longest_behind(histories, ["loss", "win", "win"], 20) == 2
    assert comebacks.longest_behind(histories, ["loss", "loss", "draw"], 20) is None


def test_players_that_cannot_be_loaded_are_left_out(monkeypatch):
    from swarm_pz.errors import MissingExtraError

    def load(name, config):
        if name == "champion":
            raise MissingExtraError("torch is not installed")

    monkeypatch.setattr(comebacks, "load", load)
    assert comebacks.installed(("ring", "champion"), GameConfig()) == ["ring"]
