"""What ``train``, ``sweep``, ``league`` and the searches of ``evaluate`` print and leave behind."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from swarm_pz.cli import compare, learn, main
from swarm_pz.config import GameConfig
from swarm_pz.policies.held_out import Generalisation
from swarm_pz.policies.scripted import SCRIPTS
from swarm_pz.standard import exploitability
from swarm_pz.training.config import TrainConfig

OUT = Path("runs/mine")


class Trained:
    """A policy that notes where it is written, and with what."""

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


def test_train_compares_films_and_says_how_to_try_the_policy(shown, monkeypatch, capsys):
    given = {}
    baseline = SimpleNamespace(match=match("uniform"), difference=0.25, low=-0.125, high=0.5)

    def compared(*args, **options):
        given["compared"] = (args[1:], options)
        return match("uniform"), [baseline]

    def film(*args, progress, **options):
        given["filmed"] = (args[1:], options)
        return "won in no time"

    monkeypatch.setattr("swarm_pz.training.report.compare", compared)
    monkeypatch.setattr("swarm_pz.training.report.plot_learning_curve", lambda *args: given.update(curve=args))
    monkeypatch.setattr("swarm_pz.analysis.video.film_game", film)
    words = f"train --out {OUT} --games 6 --threads 3 --opponents ring noise --game.drones-per-team 3"
    main(words.split())
    game = TrainConfig().game.replace(drones_per_team=3)
    assert given == {
        "curve": ("history", "ring", OUT / "learning_curve.png"),
        "compared": (("untrained", game), {"games": 6, "seed": 0, "threads": 3}),
        "filmed": (("uniform", OUT / "game.mp4"), {"config": game, "seed": 1, "speed": 4.0}),
    }
    assert json.loads((OUT / "results.json").read_text())["against"] == "uniform"
    assert (OUT / "evaluation.json").read_text() == f"swarm-pz {words}"
    assert [(name, len(matches)) for name, matches in shown] == [("print_matches", 2)]
    printed = capsys.readouterr().out
    for said in (
        f"rules: {game.rules_hash}\n", "training for 2,400,000 steps in runs/mine", "+0.250 (95 % interval -0.125 to",
        f"one game, won in no time: {OUT / 'game.mp4'}", f"evaluate {OUT} --opponent ring)\n",
    ):  # fmt: skip
        assert said in printed, said
    main([*words.split(), "--game.controllers", "direct", "ergodic"])
    assert "--opponent ring --game.controllers direct ergodic)\n" in capsys.readouterr().out


def test_league_plays_the_scripts_and_says_how_its_exploiters_learn(shown, monkeypatch, capsys):
    played = []

    def play_match(policy, opponent, **options):
        played.append((policy.name, opponent.name, options))
        return match(opponent.name)

    monkeypatch.setattr("swarm_pz.evaluation.match.play_match", play_match)
    main(f"league --out {OUT} --games 6 --learner.threads 3 --learner.game.drones-per-team 3".split())
    names, game = [script.__name__ for script in SCRIPTS], TrainConfig().game.replace(drones_per_team=3)
    assert played == [("mine", name, {"games": 6, "config": game, "threads": 3}) for name in names]
    assert list(json.loads((OUT / "results.json").read_text())) == names
    assert [(len(matches), title) for _, matches, title in shown] == [(len(names), "mine against the scripts")]
    printed = capsys.readouterr().out
    assert "training for 3,000,000 steps in runs/mine" in printed and printed.endswith("policy: runs/mine\n")
    assert "waits for exploiters" not in printed
    for more, is_told in (("", True), (" --async-delay 64", False), (" --exploiter-steps 0", False)):
        main(f"league --out {OUT} --overwrite --processes 3{more}".split())
        assert ("--async-delay 500000" in capsys.readouterr().out) is is_told


def test_sweep_plays_every_policy_and_names_the_benchmark(shown, monkeypatch, capsys):
    def train(config, seeds, *_, show, **__):
        show(1, 2)
        return [SimpleNamespace(name=f"seed-{seed}") for seed in seeds]

    monkeypatch.setattr("swarm_pz.training.sweep.sweep", train)
    monkeypatch.setattr(
        "swarm_pz.evaluation.match.play_match", lambda policy, *given, **how: (policy.name, *given, how["games"])
    )
    main(f"sweep --seeds 4 6 --games 8 --out {OUT}".split())
    assert shown == [("print_matches", [("seed-4", "uniform", 8), ("seed-6", "uniform", 8)])]
    assert "benchmark runs/mine/seed-4 runs/mine/seed-6 --name mine)" in capsys.readouterr().out


def test_held_out_prints_both_suites_and_writes_them(shown, monkeypatch, capsys):
    suites = Generalisation([match("ring", 0.75), match("halo", 0.25)], [match("drifting", 0.875)])
    monkeypatch.setattr("swarm_pz.policies.held_out.play_suites", lambda *_, **__: suites)
    words = "evaluate lasso --held-out --json e.json --game.time-limit 7"
    main(words.split())
    assert [([one.opponent for one in matches], title) for _, matches, title in shown] == [
        (["ring", "halo"], "lasso against the scripts: score 0.500"),
        (["drifting"], "lasso against the held-out suite: score 0.875"),
    ]
    assert "generalisation (held-out score less in-suite score): +0.375\n" in capsys.readouterr().out
    figures = json.loads(Path("e.json").read_text())
    assert (figures["in_suite_score"], figures["held_out_score"], figures["generalisation"]) == (0.5, 0.875, 0.375)
    assert figures["rules_hash"] == GameConfig(time_limit=7.0).rules_hash and figures["command"] == f"swarm-pz {words}"


def test_exploit_measures_what_was_found_and_writes_it_twice(shown, monkeypatch):
    monkeypatch.setattr(exploitability, "attack", lambda *_, **__: "attackers")
    monkeypatch.setattr(exploitability, "measure", lambda *given, show, threads: ("found", given, threads))
    monkeypatch.setattr(exploitability, "figures", lambda *given: {"best": "seed-1", "of": repr(given[1])})
    main(["evaluate", "lasso", "--exploit", "--json", "e.json", "--threads", "3", "--exploit-steps", "640"])
    ((name, (found, given, threads), policy, steps),) = shown
    assert (name, found, threads, policy, steps) == ("print_exploitability", "found", 3, "lasso", 640)
    assert given[:2] == ("lasso", "attackers")
    for place in ("runs/exploiter/exploitability.json", "e.json"):
        figures = json.loads(Path(place).read_text())
        assert (figures["best"], figures["rules_hash"]) == ("seed-1", GameConfig().rules_hash)
    assert compare.tables is learn.tables
