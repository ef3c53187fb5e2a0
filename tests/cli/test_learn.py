"""What ``train``, ``sweep``, ``league`` and the searches of ``evaluate`` print and leave behind"""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from swarm_pz.cli import learn
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.policies.held_out import Generalisation
from swarm_pz.policies.scripted import SCRIPTS
from swarm_pz.standard import exploitability
from swarm_pz.training.config import TrainConfig
from tests.cli.conftest import run

OUT = Path("runs/mine")


class Trained:
    """A policy that notes with what it is written."""

    name, results = "mine", None

    def with_results(self, results):
        self.results = results
        return self

    def write(self, folder):
        (Path(folder) / "results.json").write_text(json.dumps(self.results))


def match(opponent, score=0.0):
    return SimpleNamespace(
        policy="mine", opponent=opponent, score=lambda: score, summary=lambda: {"against": opponent, "score": score},
        write=lambda path, command: Path(path).write_text(command),
    )  # fmt: skip


@pytest.fixture
def shown(monkeypatch):
    """Note tables instead of printing them, and let every run be at its end at once."""
    shown, trained = [], Trained()

    def begin(config, out, **_):
        out.mkdir(parents=True, exist_ok=True)
        more = {"history": "history", "untrained": lambda: "untrained", "main": SimpleNamespace(is_finished=False)}
        return SimpleNamespace(is_finished=False, run=lambda should_stop: trained, **more)

    monkeypatch.setattr("swarm_pz.training.ppo.Training", begin)
    monkeypatch.setattr("swarm_pz.training.selfplay.League", begin)
    for name in ("print_matches", "print_opponents", "print_exploitability"):
        monkeypatch.setattr(learn.tables, name, lambda *given, name=name: shown.append((name, *given)))
    return shown


def test_train_is_compared_and_filmed_by_its_own_rules_and_says_how_to_try_the_policy(shown, monkeypatch, capsys):
    given = {}
    baseline = SimpleNamespace(match=match("uniform"), difference=0.25, low=-0.125, high=0.5)

    def compare(*args, **options):
        given["compared"] = (args[1:], options)
        return match("uniform"), [baseline]

    monkeypatch.setattr("swarm_pz.training.report.compare", compare)
    monkeypatch.setattr("swarm_pz.training.report.plot_learning_curve", lambda *args: given.update(curve=args))
    monkeypatch.setattr("swarm_pz.analysis.video.film_game", lambda *_, config, **__: given.update(filmed=config))
    rules = "--game.drones-per-team 3 --game.controllers direct ergodic"
    run(f"train --out {OUT} --games 6 --threads 3 --opponents ring noise {rules}")
    game = TrainConfig().game.replace(
        drones_per_team=3, controllers=("direct", "ergodic"), observation=ObservationConfig(kind="drones")
    )
    assert given == {
        "curve": ("history", "ring", OUT / "learning_curve.png"),
        "compared": (("untrained", game), {"games": 6, "seed": 0, "threads": 3}),
        "filmed": game,
    }
    assert json.loads((OUT / "results.json").read_text())["against"] == "uniform"
    printed = capsys.readouterr().out
    assert "+0.250 (95 % interval -0.125 to +0.500)" in printed
    assert "--opponent ring --game.controllers direct ergodic)\n" in printed


def test_league_plays_the_scripts_and_says_how_its_exploiters_learn(shown, monkeypatch, capsys):
    played = []

    def play_match(policy, opponent, **options):
        played.append((policy.name, opponent.name, options))
        return match(opponent.name)

    monkeypatch.setattr("swarm_pz.evaluation.match.play_match", play_match)
    run(f"league --out {OUT} --games 6 --learner.threads 3 --learner.game.drones-per-team 3")
    names, game = [script.__name__ for script in SCRIPTS], TrainConfig().game.replace(drones_per_team=3)
    assert played == [("mine", name, {"games": 6, "config": game, "threads": 3}) for name in names]
    assert list(json.loads((OUT / "results.json").read_text())) == names
    assert [(len(matches), title) for _, matches, title in shown] == [(len(names), "mine against the scripts")]
    assert "--async-delay" not in capsys.readouterr().out
    for more, is_told in (("", True), (" --async-delay 64", False), (" --exploiter-steps 0", False)):
        run(f"league --out {OUT} --overwrite --processes 3{more}")
        assert ("--async-delay 500000" in capsys.readouterr().out) is is_told


def test_sweep_plays_every_policy_and_names_the_benchmark(shown, monkeypatch, capsys):
    monkeypatch.setattr(
        "swarm_pz.training.sweep.sweep", lambda config, seeds, *_, **__: [f"seed-{seed}" for seed in seeds]
    )
    monkeypatch.setattr("swarm_pz.evaluation.match.play_match", lambda *given, games, config: (*given, games))
    run(f"sweep --seeds 4 6 --games 8 --out {OUT}")
    assert shown == [("print_matches", [("seed-4", "uniform", 8), ("seed-6", "uniform", 8)])]
    assert "benchmark runs/mine/seed-4 runs/mine/seed-6 --name mine)" in capsys.readouterr().out


def test_held_out_prints_both_suites_and_writes_them(shown, monkeypatch, capsys):
    suites = Generalisation([match("ring", 0.75), match("halo", 0.25)], [match("drifting", 0.875)])
    monkeypatch.setattr("swarm_pz.policies.held_out.play_suites", lambda *_, **__: suites)
    run("evaluate lasso --held-out --json e.json --game.time-limit 7")
    assert [([one.opponent for one in matches], title) for _, matches, title in shown] == [
        (["ring", "halo"], "lasso against the scripts: score 0.500"),
        (["drifting"], "lasso against the held-out suite: score 0.875"),
    ]
    assert "generalisation (held-out score less in-suite score): +0.375\n" in capsys.readouterr().out
    figures = json.loads(Path("e.json").read_text())
    assert (figures["in_suite_score"], figures["held_out_score"], figures["generalisation"]) == (0.5, 0.875, 0.375)
    assert figures["rules_hash"] == GameConfig(time_limit=7.0).rules_hash


def test_exploit_measures_what_was_found_and_writes_it_twice(shown, monkeypatch):
    monkeypatch.setattr(exploitability, "attack", lambda *_, **__: "attackers")
    monkeypatch.setattr(exploitability, "measure", lambda *given, show, threads: (*given[:2], threads))
    monkeypatch.setattr(exploitability, "figures", lambda *given: {"best": "seed-1"})
    run("evaluate lasso --exploit --json e.json --threads 3 --exploit-steps 640")
    assert shown == [("print_exploitability", ("lasso", "attackers", 3), "lasso", 640)]
    for place in ("runs/exploiter/exploitability.json", "e.json"):
        figures = json.loads(Path(place).read_text())
        assert (figures["best"], figures["rules_hash"]) == ("seed-1", GameConfig().rules_hash)
