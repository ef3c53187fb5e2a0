"""Options, presets, recipes and a resumed run's own settings reach the function that does the work."""

import json
from pathlib import Path

import pytest

from swarm_pz import policies
from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.tournament import TournamentConfig
from swarm_pz.evaluation.workers import Processes, SerialExecutor
from swarm_pz.standard.exploitability import SearchConfig
from swarm_pz.training.config import RECIPES, LeagueConfig, TrainConfig

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
NEW, AGAIN = {"resume": False, "overwrite": False}, {"resume": False, "overwrite": True}
PLAYED, ATTACK = "evaluation.match.play_match", "standard.exploitability.attack"
TRAINING, LEAGUE = "training.ppo.Training", "training.selfplay.League"
LONG, RELEASED = RECIPES["long"], GameConfig.preset("released")
TOURNAMENT = f"tournament ring halo --games 6 --seed 7 --budget-ms 70 --out runs/mine {SHORT}"


@pytest.mark.parametrize(
    ("words", "where", "args", "named"),
    [
        (f"evaluate ring --opponent noise {MATCH}", PLAYED, ("ring", "noise"), HOW | {"config": RULES}),
        (
            f"evaluate ring --exploit {MATCH} --exploit-steps 640 --exploiters 2 --out runs/mine --overwrite",
            ATTACK,
            ("ring", OUT, SearchConfig(steps=640, exploiters=2, games=6, seed=7), RULES),
            AGAIN | {"pool": 2},
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
            "train --out runs/mine --threads 3 --seed 4 --opponents ring noise --game.drones-per-team 3 --overwrite",
            TRAINING,
            (TrainConfig(game=GAME, threads=3, seed=4, opponents=("ring", "noise")), OUT),
            AGAIN | {"log": ["tensorboard"]},
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


# --- resumed runs -----------------------------------------------------------------------------------------

KEPT = LONG.replace(total_steps=200_000, seed=4, game=TrainConfig().game.replace(time_limit=5.0))


def keep(settings):
    OUT.mkdir(parents=True)
    (OUT / "config.json").write_text(settings)


@pytest.mark.parametrize(
    ("words", "where", "kept", "changed"),
    [
        ("train --seed 4 --recipe long", TRAINING, KEPT, {}),
        (
            "train --preset paper --total-steps 300000 --threads 1",
            TRAINING,
            KEPT,
            {"total_steps": 300_000, "threads": 1},
        ),
        ("league --learner.seed 4", LEAGUE, LeagueConfig(learner=KEPT, seats=8), {}),
    ],
)
def test_a_resumed_run_has_its_own_settings(words, where, kept, changed, given):
    """Without them a run of 200,000 steps trained for 2,400,000 when it was resumed."""
    keep(json.dumps(kept.to_dict()))
    assert given(f"{words} --resume --out {OUT}", where)[0] == (kept.replace(**changed), OUT)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--seed 0", "was begun with seed 4, and this line says --seed 0: leave that out"),
        ("--game.time-limit 6", "begun with game.time_limit 5.0, and this line says --game.time-limit 6.0"),
        ("torn", "cannot be read"),
    ],
)
def test_options_that_contradict_a_resumed_run_and_settings_that_are_torn_are_named(words, message, refused):
    keep(json.dumps(KEPT.to_dict()) if words != "torn" else words)
    assert message in refused(f"train {words.removeprefix('torn')} --resume --out {OUT}")
