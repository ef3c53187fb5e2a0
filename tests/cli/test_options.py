"""Every option of a command reaches the function that does the work."""

from pathlib import Path

import pytest

from swarm_pz import policies
from swarm_pz.cli import main
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.evaluation.workers import Processes, SerialExecutor
from swarm_pz.rendering.overlays import make_overlays
from swarm_pz.standard.exploitability import SearchConfig
from swarm_pz.training.config import RECIPES, LeagueConfig, TrainConfig

RULES = GameConfig(time_limit=5.0, drones_per_team=2)
SHORT = "--game.time-limit 5 --game.drones-per-team 2"
CALLS = ("progress", "say", "show", "should_stop", "loader")


class EnoughError(Exception):
    """The function was reached."""


@pytest.fixture
def given(monkeypatch):
    """Run a command up to a function; return what that was given, players by their names."""

    def given(words, where):
        found = []

        def take(*args, **named):
            found.extend((args, named))
            raise EnoughError

        monkeypatch.setattr(f"swarm_pz.{where}", take)
        with pytest.raises(EnoughError):
            main(words.split())
        args, named = found
        for name in CALLS:
            assert callable(named.pop(name, print)), name
        return tuple(getattr(one, "name", one) for one in args), named

    return given


MATCH, HOW = f"--games 6 --seed 7 --threads 1 {SHORT}", {"games": 6, "seed": 7, "threads": 1}
ONE = f"ring noise --seed 7 --pair 3 --side blue --seconds 1.5 {SHORT}"
CHOSEN = {"config": RULES, "seed": 7, "pair": 3, "side": "blue", "seconds": 1.5}
GAME = TrainConfig().game.replace(drones_per_team=3)
MINE = Path("runs/mine")
AGAIN = {"resume": False, "overwrite": True}


@pytest.mark.parametrize(
    ("words", "where", "args", "named"),
    [
        (
            f"evaluate ring --opponent noise {MATCH}",
            "evaluation.match.play_match",
            ("ring", "noise"),
            HOW | {"config": RULES},
        ),
        (f"evaluate ring --held-out {MATCH}", "policies.held_out.play_suites", ("ring", RULES), HOW),
        (
            f"evaluate ring --exploit {MATCH} --exploit-steps 640 --exploiters 2 --out runs/mine --overwrite",
            "standard.exploitability.attack",
            ("ring", MINE, SearchConfig(steps=640, exploiters=2, games=6, seed=7), RULES),
            AGAIN,
        ),
        (
            f"evaluate ring --exploit {SHORT}",
            "standard.exploitability.attack",
            ("ring", Path("runs/exploiter"), SearchConfig(), RULES),
            AGAIN | {"overwrite": False},
        ),
        (
            f"render {ONE} --speed 3 --out a.gif --overlay target captures --overlay-team both",
            "analysis.video.film_game",
            ("ring", "noise", "a.gif"),
            CHOSEN | {"speed": 3.0, "overlays": make_overlays(["target", "captures"], [RED, BLUE])},
        ),
        (f"diagnose {ONE} --out a.svg", "analysis.diagnosis.diagnose", ("ring", "noise"), CHOSEN),
        (
            "bench --games 1 3 --drones 4 --threads 1 2 --repeats 5 --grid 10",
            "bench.measure",
            None,
            {"games": (1, 3), "drones": (4,), "threads": (1, 2), "grid": 10, "repeats": 5},
        ),
        (f"warmup {SHORT}", "bench.batch_env_face", (RULES, 2, 1), {}),
        (
            f"tournament ring halo --games 6 --seed 7 --budget-ms 70 --out runs/mine {SHORT}",
            "evaluation.tournament.Tournament",
            None,
            {},
        ),
        (
            "train --out runs/mine --threads 3 --seed 4 --opponents ring noise --game.drones-per-team 3 --overwrite",
            "training.ppo.Training",
            (TrainConfig(game=GAME, threads=3, seed=4, opponents=("ring", "noise")), "mine"),
            AGAIN,
        ),
        (
            "league --out runs/mine --seats 5 --learner.threads 3 --learner.game.drones-per-team 3 --overwrite",
            "training.selfplay.League",
            (LeagueConfig(learner=RECIPES["long"].replace(game=GAME, threads=3), seats=5), "mine"),
            AGAIN,
        ),
        (
            "sweep --seeds 4 6 --processes 3 --out runs/mine --gamma 0.9",
            "training.sweep.sweep",
            None,
            {},
        ),
    ],
    ids=lambda value: value.split()[0] if isinstance(value, str) and " " in value else "",
)
def test_options_reach_the_work(words, where, args, named, given):
    found, options = given(words, where)
    if "command" in options:
        assert options.pop("command") == f"swarm-pz {words}"
    for pool in ("pool", "workers"):
        options.pop(pool, None)
    if args is not None:
        assert found == tuple(getattr(one, "name", one) for one in args)
    assert options == named


def test_a_tournament_and_a_sweep_are_begun_as_they_were_asked_for(given):
    words = f"tournament ring halo --games 6 --seed 7 --budget-ms 70 --out runs/mine {SHORT}"
    (players, config, folder, _, command), _ = given(words, "evaluation.tournament.Tournament")
    assert (players, folder, command) == (("ring", "halo"), "mine", f"swarm-pz {words}")
    assert (config.games, config.seed, config.budget_ms, config.game) == (6, 7, 70.0, RULES)
    found, _ = given("sweep --seeds 4 6 --processes 3 --out runs/mine --gamma 0.9", "training.sweep.sweep")
    assert found[:3] == (TrainConfig(threads=1, gamma=0.9), (4, 6), "mine") and found[3].count == 3


@pytest.mark.parametrize(
    ("words", "where", "kind"),
    [
        ("evaluate ring --held-out", "policies.held_out.play_suites", SerialExecutor),
        ("evaluate ring --held-out --processes 2", "policies.held_out.play_suites", Processes),
        ("evaluate ring --exploit", "standard.exploitability.attack", Processes),
        ("evaluate ring --exploit --processes 1", "standard.exploitability.attack", SerialExecutor),
        ("league", "training.selfplay.League", SerialExecutor),
        ("league --processes 3", "training.selfplay.League", Processes),
    ],
)
def test_work_is_shared_as_it_was_asked_for(words, where, kind, given):
    _, options = given(words, where)
    assert isinstance(options.get("pool", options.get("workers")), kind)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--held-out --exploit", "one at a time"),
        ("--held-out --opponent halo", "opponent must be left out"),
        ("--exploit --opponent halo", "opponent must be left out"),
        ("--resume", "left out without exploit, got (True, False)"),
        ("--held-out --overwrite", "left out without exploit, got (False, True)"),
        ("--exploit --resume --overwrite", "give one of them"),
        ("--exploit --overwrite", "overwrite must say which run to replace"),
        ("--held-out --json /", "expected the name of a file to write"),
        ("--exploit --games 7", "games must be even"),
        ("--exploit --exploiters 0", "exploiters must be"),
        ("--exploit --exploit-steps 0", "steps must be"),
        ("--exploit --ray auto", "ray must be left out without held_out"),
        ("--processes 2", "processes must be left out without held_out or exploit, got 2"),
    ],
)
def test_options_of_evaluate_that_do_not_go_together_are_refused_before_anything_is_played(words, message, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["evaluate", "ring", *words.split()])
    assert message in capsys.readouterr().err and not Path("runs").exists()


def test_a_tournament_of_all_is_of_those_who_can_play_these_rules(given, monkeypatch, capsys):
    load = policies.load

    def choosy(name, config):
        if name == "halo":
            raise PolicyError("not so few drones")
        return load(name, config)

    monkeypatch.setattr("swarm_pz.cli.player_options.load", choosy)
    monkeypatch.setattr("swarm_pz.cli.player_options.faults", lambda: {"evade": "evade cannot be loaded"})
    (players, *_), _ = given(f"tournament {SHORT}", "evaluation.tournament.Tournament")
    assert {"ring", "noise", "uniform"} <= set(players) and not {"halo", "evade", "prowl"} & set(players)
    said = capsys.readouterr().err
    assert "left out: halo: not so few drones\n" in said and "left out: evade cannot be loaded\n" in said
