"""What ``train``, ``sweep`` and ``league`` pass on, and what they leave behind."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from swarm_pz.cli import learn, main
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.workers import SerialExecutor
from swarm_pz.policies.scripted import SCRIPTS
from swarm_pz.training.config import RECIPES, LeagueConfig, TrainConfig

OUT = Path("runs/mine")


class Trained:
    """A policy that notes where it is written, and with what."""

    name = "mine"

    def __init__(self, given, results=None):
        self.given, self.results = given, results

    def with_results(self, results):
        return Trained(self.given, results)

    def write(self, folder):
        self.given["written"] = (folder, self.results)


def stand_in(given, **more):
    """Return what takes the place of a run: it notes what it is begun with, and is at its end at once."""

    def begin(*args, **options):
        assert options.pop("say").func is print
        given["workers"] = options.pop("workers", None)
        given["begun"] = (args, options)
        policy = Trained(given)
        return SimpleNamespace(
            history="history", is_finished=False, untrained=lambda: "untrained",
            run=lambda asked: given.update(asked=asked()) or policy, **more,
        )  # fmt: skip

    return begin


def match(opponent):
    return SimpleNamespace(
        policy="mine", opponent=opponent, summary=lambda: {"against": opponent},
        write=lambda path, command: Path(path).parent.mkdir(parents=True, exist_ok=True)
        or Path(path).write_text(command),
    )  # fmt: skip


@pytest.fixture
def given():
    return {}


def test_the_line_that_train_ends_with_names_what_the_policy_flies_by(given, monkeypatch, capsys):
    baseline = SimpleNamespace(match=match("uniform"), difference=0.25, low=-0.125, high=0.5)
    monkeypatch.setattr("swarm_pz.training.ppo.Training", stand_in(given))
    monkeypatch.setattr("swarm_pz.training.report.compare", lambda *_, **__: (match("uniform"), [baseline]))
    monkeypatch.setattr("swarm_pz.training.report.plot_learning_curve", lambda *_: None)
    monkeypatch.setattr("swarm_pz.analysis.video.film_game", lambda *_, **__: "a draw")
    monkeypatch.setattr(learn.tables, "print_matches", lambda _: None)
    for flown, rules in (("ergodic", ")"), ("direct", " --game.controllers direct ergodic)")):
        main(["train", "--out", str(OUT), "--game.controllers", flown, "ergodic"])
        assert f"evaluate {OUT} --opponent ring{rules}\n" in capsys.readouterr().out


@pytest.mark.parametrize("more", [[], ["--overwrite"], ["--resume"]])
def test_train_passes_on_what_it_was_asked_for(given, monkeypatch, capsys, more):
    def compare(*args, **options):
        given["compared"] = (args, options)
        baseline = SimpleNamespace(match=match("uniform"), difference=0.25, low=-0.125, high=0.5)
        return match("uniform"), [baseline]

    def film(*args, progress, **options):
        given["filmed"] = (args, options)
        return "won in no time"

    monkeypatch.setattr("swarm_pz.training.ppo.Training", stand_in(given))
    monkeypatch.setattr("swarm_pz.training.report.compare", compare)
    monkeypatch.setattr("swarm_pz.training.report.plot_learning_curve", lambda *args: given.update(curve=args))
    monkeypatch.setattr("swarm_pz.analysis.video.film_game", film)
    monkeypatch.setattr(learn.tables, "print_matches", lambda matches: given.update(shown=len(matches)))
    words = ["--out", str(OUT), "--games", "6", "--threads", "3", "--seed", "4", "--opponents", "ring", "noise", *more]
    main(["train", *words, "--game.drones-per-team", "3"])
    game = TrainConfig().game.replace(drones_per_team=3)
    config = TrainConfig(game=game, threads=3, seed=4, opponents=("ring", "noise"))
    command = " ".join(["swarm-pz train", *words, "--game.drones-per-team 3"])
    settings = {"resume": "--resume" in more, "overwrite": "--overwrite" in more, "command": command}
    assert given["begun"] == ((config, OUT), settings)
    assert given["asked"] is False
    assert given["curve"] == ("history", "ring", OUT / "learning_curve.png")
    (trained, *others), options = given["compared"]
    assert isinstance(trained, Trained)
    assert (others, options) == (["untrained", game], {"games": 6, "seed": 0, "threads": 3})
    assert given["written"] == (OUT, {"against": "uniform"})
    assert (OUT / "evaluation.json").read_text() == command
    (trained, *others), options = given["filmed"]
    assert isinstance(trained, Trained)
    assert (others, options) == (["uniform", OUT / "game.mp4"], {"config": game, "seed": 1, "speed": 4.0})
    assert given["shown"] == 2
    printed = capsys.readouterr().out
    assert f"rules: {game.rules_hash}\n" in printed
    assert "training for 2,400,000 steps in runs/mine (Ctrl-C stops, --resume goes on)" in printed
    assert "+0.250 (95 % interval -0.125 to +0.500)" in printed
    assert f"one game, won in no time: {OUT / 'game.mp4'}" in printed


@pytest.mark.parametrize("more", [[], ["--overwrite"], ["--resume"]])
def test_league_passes_on_what_it_was_asked_for(given, monkeypatch, capsys, more):
    played = []

    def play_match(policy, opponent, **options):
        played.append((policy.name, opponent.name, options))
        return match(opponent.name)

    begin = stand_in(given, main=SimpleNamespace(is_finished=False))
    monkeypatch.setattr("swarm_pz.training.selfplay.League", begin)
    monkeypatch.setattr("swarm_pz.evaluation.match.play_match", play_match)
    shown = []
    monkeypatch.setattr(learn.tables, "print_opponents", lambda matches, title: shown.append((len(matches), title)))
    words = ["--out", str(OUT), "--games", "6", "--seats", "5", "--learner.threads", "3", *more]
    main(["league", *words, "--learner.game.drones-per-team", "3"])
    game = TrainConfig().game.replace(drones_per_team=3)
    config = LeagueConfig(learner=RECIPES["long"].replace(game=game, threads=3), seats=5)
    command = " ".join(["swarm-pz league", *words, "--learner.game.drones-per-team 3"])
    settings = {"resume": "--resume" in more, "overwrite": "--overwrite" in more, "command": command}
    assert given["begun"] == ((config, OUT), settings)
    names = [script.__name__ for script in SCRIPTS]
    assert played == [("mine", name, {"games": 6, "config": game, "threads": 3}) for name in names]
    assert given["written"] == (OUT, {name: {"against": name} for name in names})
    assert shown == [(len(names), "mine against the scripts")]
    printed = capsys.readouterr().out
    assert isinstance(given["workers"], SerialExecutor) and "waits for exploiters" not in printed
    assert f"rules: {game.rules_hash}\n" in printed
    assert "training for 3,000,000 steps in runs/mine" in printed and printed.endswith("policy: runs/mine\n")


def test_who_has_others_work_for_a_league_is_told_that_the_learner_need_not_wait(given, monkeypatch, capsys):
    monkeypatch.setattr("swarm_pz.training.selfplay.League", stand_in(given, main=SimpleNamespace(is_finished=True)))
    monkeypatch.setattr("swarm_pz.evaluation.match.play_match", lambda *_, **__: match("ring"))
    monkeypatch.setattr(learn.tables, "print_opponents", lambda *_: None)
    hint = "the learner waits for exploiters where they begin: --async-delay 500000 lets it go on meanwhile"
    for more, is_told in (([], True), (["--async-delay", "64"], False), (["--exploiter-steps", "0"], False)):
        main(["league", "--out", str(OUT), "--processes", "3", *more])
        assert given["workers"].count == 3
        assert (hint in capsys.readouterr().out) is is_told


class EnoughError(Exception):
    """A run has begun."""


@pytest.fixture
def begins(given, monkeypatch):
    """Note what runs begin with, and end them at once."""

    def begin(*args, **options):
        given["begun"] = args
        raise EnoughError

    monkeypatch.setattr("swarm_pz.training.ppo.Training", begin)
    monkeypatch.setattr("swarm_pz.training.selfplay.League", begin)


@pytest.mark.usefixtures("begins")
def test_without_settings_the_defaults_are_played(given):
    with pytest.raises(EnoughError):
        main(["train"])
    assert given["begun"] == (TrainConfig(), Path("runs/first"))
    with pytest.raises(EnoughError):
        main(["league"])
    assert given["begun"] == (LeagueConfig(), Path("runs/league"))
    assert TrainConfig().game == GameConfig(observation=TrainConfig().game.observation)


SHORT = RECIPES["long"].replace(total_steps=200_000, seed=4, game=TrainConfig().game.replace(time_limit=5.0))


@pytest.mark.usefixtures("begins")
@pytest.mark.parametrize(
    ("words", "kept", "changed"),
    [
        ("train --resume", SHORT, {}),
        ("train --resume --seed 4 --recipe long", SHORT, {}),
        (
            "train --resume --preset paper --total-steps 300000 --threads 1",
            SHORT,
            {"total_steps": 300_000, "threads": 1},
        ),
        ("league --resume --learner.seed 4", LeagueConfig(learner=SHORT, seats=8), {}),
    ],
)
def test_a_run_goes_on_by_its_own_settings(given, words, kept, changed):
    """Without them a run of 200,000 steps trained for 2,400,000 when it was taken up."""
    OUT.mkdir(parents=True)
    (OUT / "config.json").write_text(json.dumps(kept.to_dict()))
    with pytest.raises(EnoughError):
        main([*words.split(), "--out", str(OUT)])
    assert given["begun"] == (kept.replace(**changed), OUT)


@pytest.mark.usefixtures("begins")
@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("train --seed 0", "was begun with seed 4, and this line says --seed 0: leave that out"),
        ("train --game.time-limit 6", "begun with game.time_limit 5.0, and this line says --game.time-limit 6.0"),
        ("train --recipe quick --rollout 8", "begun with rollout 64, and this line says --rollout 8"),
        ("train --preset released", "begun with game.spawn.layout 'corners', and this line says --game.spawn.layout"),
    ],
)
def test_options_that_contradict_the_run_are_named(words, message, capsys):
    OUT.mkdir(parents=True)
    (OUT / "config.json").write_text(json.dumps(SHORT.to_dict()))
    with pytest.raises(SystemExit, match="2"):
        main([*words.split(), "--resume", "--out", str(OUT)])
    assert message in capsys.readouterr().err


def test_sweep_passes_on_what_it_was_asked_for(given, monkeypatch, capsys):
    def train(*args, **options):
        assert options.pop("say").func is print and not options.pop("should_stop")()
        options.pop("show")(1, 2)
        given["begun"] = (args[:3], args[3].count, options)
        return [SimpleNamespace(name=f"seed-{seed}") for seed in args[1]]

    def play(policy, opponent, **options):
        given.setdefault("played", []).append((policy.name, opponent, options["games"]))
        return match(opponent)

    monkeypatch.setattr("swarm_pz.training.sweep.sweep", train)
    monkeypatch.setattr("swarm_pz.evaluation.match.play_match", play)
    monkeypatch.setattr("swarm_pz.cli.printing.print_matches", lambda matches: None)
    words = ["--seeds", "4", "6", "--processes", "3", "--games", "8", "--out", str(OUT), "--gamma", "0.9"]
    main(["sweep", *words])
    config = TrainConfig(threads=1, gamma=0.9)
    command = " ".join(["swarm-pz sweep", *words])
    assert given["begun"] == ((config, (4, 6), OUT), 3, {"command": command})
    assert given["played"] == [("seed-4", "uniform", 8), ("seed-6", "uniform", 8)]
    assert "benchmark runs/mine/seed-4 runs/mine/seed-6 --name mine)" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="2"):
        main(["sweep", "--seed", "3"])
    assert "seed must be left out: --seeds names them" in capsys.readouterr().err
