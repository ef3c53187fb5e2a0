"""Options, presets and recipes reach the function that does the work."""

from pathlib import Path

import pytest

from swarm_pz import policies
from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.tournament import TournamentConfig
from swarm_pz.evaluation.workers import Processes, SerialExecutor
from swarm_pz.standard.exploitability import SearchConfig
from swarm_pz.training.config import RECIPES, TrainConfig

RULES = GameConfig(time_limit=5.0, drones_per_team=2)
SHORT = "--game.time-limit 5 --game.drones-per-team 2"
OUT = Path("runs/mine")


class EnoughError(Exception):
    """The function was reached."""


def plain(value):
    """Return players by their names, and pools by their number of processes."""
    if isinstance(value, SerialExecutor | Processes):
        return getattr(value, "count", 1)
    return getattr(value, "name", value) if not isinstance(value, Path) else value


@pytest.fixture
def given(monkeypatch):
    """Run a command up to a function; return what that was given."""

    def given(words, where):
        found = []

        def take(*args, **named):
            found.extend((args, named))
            raise EnoughError

        monkeypatch.setattr(f"swarm_pz.{where}", take)
        with pytest.raises(EnoughError):
            main(words.split())
        args, named = found
        for name in ("progress", "say", "show", "should_stop"):
            assert callable(named.pop(name, print)), name
        assert named.pop("command", f"swarm-pz {words}") == f"swarm-pz {words}"
        return tuple(map(plain, args)), {name: plain(value) for name, value in named.items()}

    return given


MATCH = f"--games 6 --seed 7 --threads 1 {SHORT}"
HOW = {"games": 6, "seed": 7, "threads": 1}
GAME = TrainConfig().game.replace(drones_per_team=3)
PLAYED, ATTACK = "evaluation.match.play_match", "standard.exploitability.attack"
TRAINING, LEAGUE = "training.ppo.Training", "training.selfplay.League"
LONG, RELEASED = RECIPES["long"], GameConfig.preset("released")
TOURNAMENT = f"tournament ring halo --games 6 --seed 7 --budget-ms 70 --out runs/mine {SHORT}"


@pytest.mark.parametrize(
    ("words", "where", "args", "named"),
    [
        (f"evaluate ring --opponent noise {MATCH}", PLAYED, ("ring", "noise"), HOW | {"config": RULES}),
        (
            f"evaluate ring --exploit {MATCH} --exploit-steps 640 --exploiters 2 --out runs/mine",
            ATTACK,
            ("ring", OUT, SearchConfig(steps=640, exploiters=2, games=6, seed=7), RULES),
            {"pool": 2},
        ),
        (
            TOURNAMENT,
            "evaluation.tournament.Tournament",
            (
                ("ring", "halo"),
                TournamentConfig(games=6, seed=7, budget_ms=70.0, game=RULES),
                OUT,
                policies.load,
                f"swarm-pz {TOURNAMENT}",
            ),
            {},
        ),
        (
            "train --out runs/mine --threads 3 --seed 4 --opponents ring noise --recipe long",
            TRAINING,
            (LONG.replace(threads=3, seed=4, opponents=("ring", "noise")), OUT),
            {},
        ),
    ],
)
def test_options_recipes_and_presets_reach_the_work(words, where, args, named, given):
    assert given(words, where) == (args, named)


def test_what_bench_measures_and_the_rules_of_a_preset_are_as_asked(given):
    (_, *sizes, _), _ = given("bench --games 1 3 --drones 4 --threads 1 2", "bench.measure")
    assert sizes == [(1, 3), (4,), (1, 2)]
    _, options = given("evaluate ring --preset released --game.time-limit 5", PLAYED)
    assert options["config"] == RELEASED.replace(time_limit=5.0), "options win over presets"
