"""Every option of a command reaches the function that does the work."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import swarm_pz
import swarm_pz.training.vec_env
from swarm_pz.cli import main, named_options, report
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.evaluation.workers import SerialExecutor
from swarm_pz.rendering.overlays import make_overlays

SHORT = ["--game.time-limit", "5", "--game.drones-per-team", "2"]
RULES = GameConfig(time_limit=5.0, drones_per_team=2)


class EnoughError(Exception):
    pass


def asked(monkeypatch, where, arguments):
    """Run a command up to a function; return what that was given."""
    found = []

    def take(*given, **named):
        found.append((given, named))
        raise EnoughError

    monkeypatch.setattr(where, take)
    with pytest.raises(EnoughError):
        main(arguments)
    return found[0]


MATCH = ["--games", "6", "--seed", "7", "--threads", "1", *SHORT]


def test_of_evaluate(monkeypatch):
    given, named = asked(
        monkeypatch, "swarm_pz.evaluation.match.play_match", ["evaluate", "ring", "--opponent", "noise", *MATCH]
    )
    assert [player.name for player in given] == ["ring", "noise"]
    assert callable(named.pop("progress"))
    assert named == {"games": 6, "seed": 7, "config": RULES, "threads": 1}


def test_of_evaluate_held_out(monkeypatch):
    given, named = asked(
        monkeypatch, "swarm_pz.policies.held_out.play_suites", ["evaluate", "ring", "--held-out", *MATCH]
    )
    assert given == ("ring", RULES)
    assert callable(named.pop("progress"))
    assert isinstance(named.pop("pool"), SerialExecutor)
    assert named == {"games": 6, "seed": 7, "threads": 1}


@pytest.mark.parametrize("again", ["--resume", "--overwrite"])
def test_a_match_has_nothing_to_go_on_with_or_to_replace(again, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["evaluate", "ring", again, *MATCH])
    assert "left out without exploit" in capsys.readouterr().err


def test_of_tournament(monkeypatch, tmp_path):
    arguments = ["tournament", "ring", "halo", "--games", "6", "--seed", "7", "--budget-ms", "70", "--processes", "3"]
    arguments += ["--out", str(tmp_path), *SHORT]
    fields = []

    def play(field, progress, should_stop, pool):
        fields.append((field, pool.slots, should_stop()))
        progress(1, 2)
        raise EnoughError

    monkeypatch.setattr("swarm_pz.evaluation.tournament.Tournament.play", play)
    with pytest.raises(EnoughError):
        main(arguments)
    ((field, slots, stops),) = fields
    assert (field.players, field.folder, slots, stops) == (("ring", "halo"), tmp_path, 6, False)
    config = field.config
    assert (config.games, config.seed, config.budget_ms, config.game) == (6, 7, 70.0, RULES)
    assert field.command == " ".join(["swarm-pz", *arguments])


def test_a_tournament_of_all_is_of_those_who_can_play_these_rules(monkeypatch, tmp_path, capsys):
    from swarm_pz import policies

    load = policies.load

    def choosy(name, config):
        if name in ("ring", "noise") and config != RULES:
            raise PolicyError("not these rules")
        if name == "halo" and config == RULES:
            raise PolicyError("not so few drones")
        return load(name, config)

    monkeypatch.setattr("swarm_pz.cli.player_options.load", choosy)
    monkeypatch.setattr("swarm_pz.cli.player_options.faults", lambda: {"evade": "evade cannot be loaded"})
    given, _ = asked(
        monkeypatch, "swarm_pz.evaluation.tournament.Tournament", ["tournament", "--out", str(tmp_path), *SHORT]
    )
    assert {"ring", "noise", "uniform"} <= set(given[0]) and not {"halo", "evade"} & set(given[0])
    said = capsys.readouterr().err
    assert "left out: halo: not so few drones\n" in said and "left out: evade cannot be loaded\n" in said


ONE = ["ring", "noise", "--seed", "7", "--pair", "3", "--side", "blue", "--seconds", "1.5", *SHORT]
CHOSEN = {"config": RULES, "seed": 7, "pair": 3, "side": "blue", "seconds": 1.5}


@pytest.mark.parametrize(("team", "teams"), [("red", [RED]), ("blue", [BLUE]), ("both", [RED, BLUE])])
def test_of_render(monkeypatch, team, teams):
    overlays = ["--overlay", "target", "captures", "--overlay-team", team]
    given, named = asked(
        monkeypatch, "swarm_pz.analysis.video.film_game", ["render", *ONE, "--speed", "3", "--out", "a.gif", *overlays]
    )
    assert ([player.name for player in given[:2]], given[2]) == (["ring", "noise"], Path("a.gif"))
    assert callable(named.pop("progress"))
    assert named == {**CHOSEN, "speed": 3.0, "overlays": make_overlays(["target", "captures"], teams)}


def test_of_diagnose(monkeypatch, tmp_path, capsys):
    given, named = asked(monkeypatch, "swarm_pz.analysis.diagnosis.diagnose", ["diagnose", *ONE, "--out", "a.svg"])
    assert ([player.name for player in given], named) == (["ring", "noise"], CHOSEN)
    (tmp_path / "folder").mkdir()
    with pytest.raises(SystemExit, match="2"):  # and not after the game
        main(["diagnose", *ONE, "--json", str(tmp_path / "folder")])
    assert "got the folder" in capsys.readouterr().err


def test_of_bench(monkeypatch, tmp_path):
    from swarm_pz import bench

    small = ["--games", "1", "3", "--drones", "4", "--threads", "1", "2", "--repeats", "5", "--grid", "10"]
    given, named = asked(monkeypatch, "swarm_pz.bench.measure", ["bench", *small])
    (faces,) = given
    assert named.pop("say") is not None
    assert named == {"games": (1, 3), "drones": (4,), "threads": (1, 2), "grid": 10, "repeats": 5}
    assert list(faces) == ["simulator", "batch_env", "SwarmVecEnv, uniform", "SwarmVecEnv, ring", "parallel_env"]
    made, config = [], GameConfig(drones_per_team=2)

    class Env(swarm_pz.training.vec_env.SwarmVecEnv):
        def __init__(self, *given, **named):
            made.append((given, named))
            super().__init__(*given, **named)

    monkeypatch.setattr("swarm_pz.training.vec_env.SwarmVecEnv", Env)
    given, _ = asked(monkeypatch, "swarm_pz.bench.measure", ["bench", *small])
    for opponent in ("uniform", "ring"):
        given[0][f"SwarmVecEnv, {opponent}"](config, 3, 2)()
    assert made == [((config, 3), {"opponent": opponent, "threads": 2, "seed": 0}) for opponent in ("uniform", "ring")]
    monkeypatch.setattr(bench, "measure", lambda *_, **__: [])
    configs = []
    monkeypatch.setattr(bench, "phases", lambda config: configs.append(config) or {})
    main(["bench", *small, "--json", str(tmp_path / "speed.json")])
    assert [config.observations[0].grid for config in configs] == [10]


def test_of_warmup(monkeypatch):
    given, _ = asked(monkeypatch, "swarm_pz.bench.batch_env_face", ["warmup", *SHORT])
    assert given == (RULES, 2, 1)


TABLE = ["--host", "0.0.0.0", "--port", "0"]  # noqa: S104


@pytest.mark.parametrize(
    ("opponent", "page"), [([], ""), (["--opponent", "halo"], "play=halo"), (["--opponent", "none"], "play=none")]
)
def test_of_play(monkeypatch, tmp_path, opponent, page):
    arguments = ["play", *opponent, *TABLE, "--min-command-interval", "2.5", "--out", str(tmp_path), *SHORT]
    (_, installed), named = asked(monkeypatch, "swarm_pz.play.server.serve.serve", arguments)
    assert {"ring", "halo"} <= set(installed) and "none" not in installed
    table = named["table"]
    assert (table.game, table.min_command_interval) == (RULES, 2.5)
    shown = {name: named[name] for name in ("host", "port", "folder", "page")}
    assert shown == {"host": TABLE[1], "port": 0, "folder": tmp_path, "page": page}
    assert "\n" in named["draw_code"]("http://here")


def test_a_folder_of_ones_own_is_an_opponent_at_the_table(monkeypatch):
    monkeypatch.setattr("swarm_pz.policies.load", lambda name, config, system: None)
    monkeypatch.setattr("swarm_pz.cli.table.about", lambda name: f"about {name}")
    (_, installed), _ = asked(monkeypatch, "swarm_pz.play.server.serve.serve", ["play", "--opponent", "runs/mine"])
    assert installed["runs/mine"] == "about runs/mine"


@pytest.mark.parametrize("parquet", [False, True])
def test_of_study(monkeypatch, tmp_path, capsys, parquet):
    monkeypatch.setattr("swarm_pz.play.recordings.study.read_folder", lambda folder: (["rows", folder], ["a.gz: torn"]))
    arguments = ["study", "tables", "games", "--out", str(tmp_path), *(["--parquet"] if parquet else [])]
    given, named = asked(monkeypatch, "swarm_pz.play.recordings.study.write_tables", arguments)
    assert given == (["rows", Path("games")], tmp_path)
    assert named == {"every_game": False, "parquet": parquet, "command": " ".join(["swarm-pz", *arguments])}
    assert "left out: a.gz: torn\n" in capsys.readouterr().err


def test_of_presets_in_the_games_of_others():
    from swarm_pz.training.config import LeagueConfig

    released = GameConfig.preset("released")
    rules, rest = named_options.take_preset(["--preset=released", "--pre", "x"])
    assert (rules, rest) == (released, ["--pre", "x"])
    learner = named_options._with_rules(LeagueConfig(), released).learner.game
    assert learner == released.replace(observation=LeagueConfig().learner.game.observation)


def test_the_version_is_said(capsys):
    main(["--version"])
    assert capsys.readouterr().out == f"swarm-pz {swarm_pz.__version__}\n"


def test_a_program_that_is_not_on_the_path_is_called_by_its_place(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for called, found, expected in (
        ("some/pytest", None, "swarm-pz"),
        (f"{tmp_path}/my bin/swarm-pz", "/usr/bin/swarm-pz", "swarm-pz"),
        (f"{tmp_path}/my bin/swarm-pz", None, "'my bin/swarm-pz'"),
    ):
        monkeypatch.setattr("sys.argv", [called])
        monkeypatch.setattr("shutil.which", lambda name, found=found: found)
        assert report.program() == expected


def test_figures_are_written_whole_with_the_rules_that_were_played(tmp_path, monkeypatch, capsys):
    path = tmp_path / "a.json"
    token = report.arguments.set(["evaluate", "ring"])
    try:
        report.write_json({"number": 1}, path, RULES)
        assert json.loads(path.read_text())["rules_hash"] == RULES.rules_hash
        with pytest.raises(TypeError):
            report.write_json({"number": np.zeros(3)}, path, RULES)
        assert json.loads(path.read_text())["number"] == 1 and len(list(tmp_path.iterdir())) == 1
        report.print_rules(RULES, "a note")
    finally:
        report.arguments.reset(token)
    assert capsys.readouterr().out == f"figures: {path}\nrules: {RULES.rules_hash} a note\n"


def test_a_log_is_told_now_and_then_and_not_more_often(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr("swarm_pz.cli.report.time.monotonic", lambda: now[0])
    with report.progress("games") as move:
        for moment, done in ((59.0, 1), (61.0, 2), (62.0, 3), (122.0, 4)):
            now[0] = moment
            move(done, 5)
    assert capsys.readouterr().out.split("\n")[:2] == ["2 of 5 games", "4 of 5 games"]
