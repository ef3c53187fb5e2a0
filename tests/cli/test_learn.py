"""Output of ``sweep``, ``league`` and the searches of ``evaluate``."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from swarm_pz.cli import learn, model_card
from swarm_pz.config import GameConfig
from swarm_pz.policies.scripted import SCRIPTS
from swarm_pz.policy import load
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
    )  # fmt: skip


@pytest.fixture
def shown(monkeypatch):
    """Note tables instead of printing them, and let a league be at its end at once."""
    shown = []

    def begin(config, out, **_):
        out.mkdir(parents=True, exist_ok=True)
        return SimpleNamespace(main=SimpleNamespace(is_finished=False), run=lambda should_stop: Trained())

    monkeypatch.setattr("swarm_pz.training.selfplay.League", begin)
    for name in ("print_matches", "print_opponents", "print_exploitability"):
        monkeypatch.setattr(learn.tables, name, lambda *given, name=name: shown.append((name, *given)))
    return shown


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


def test_exploit_measures_what_was_found_and_writes_it_twice(shown, monkeypatch):
    monkeypatch.setattr(exploitability, "attack", lambda *_, **__: "attackers")
    monkeypatch.setattr(exploitability, "measure", lambda *given, show, threads: (*given[:2], threads))
    monkeypatch.setattr(exploitability, "figures", lambda *given: {"best": "seed-1"})
    run("evaluate lasso --exploit --json e.json --threads 3 --exploit-steps 640")
    assert shown == [("print_exploitability", ("lasso", "attackers", 3), "lasso", 640)]
    for place in ("runs/exploiter/exploitability.json", "e.json"):
        figures = json.loads(Path(place).read_text())
        assert (figures["best"], figures["rules_hash"]) == ("seed-1", GameConfig().rules_hash)


@pytest.mark.parametrize("name", ["champion", "finisher", "hunter"])
def test_the_readme_of_an_exported_policy_has_its_training_and_results_and_metadata_for_hubs(name, tmp_path):
    story = load(name, GameConfig()).card
    model_card.write(tmp_path, "mine", story)
    _, front, text = (tmp_path / "README.md").read_text().split("---\n", 2)
    assert yaml.safe_load(front)["library_name"] == "swarm-pz"
    found = story["results"]["against"]["ring"]
    assert f"| ring | {found['games']} | {found['wins']} | {found['draws']} | {found['losses']} |" in text
    assert story["command"] in text
    model_card.write(tmp_path, "bare", {})
    assert "Trained by `unknown`" in (tmp_path / "README.md").read_text()
