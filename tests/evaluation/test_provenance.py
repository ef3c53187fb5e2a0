"""Where results come from stands in every file of them, the same for the same rules."""

from __future__ import annotations

import json
import platform
import re
import shlex
from importlib.metadata import PackageNotFoundError, version

import numba
import numpy as np
import pytest
import torch

from swarm_pz.cli import main
from swarm_pz.config import CaptureConfig, GameConfig, ObservationConfig
from swarm_pz.evaluation.provenance import provenance, versions

SHORT = ["--game.time-limit", "5", "--game.drones-per-team", "2"]
RULES = GameConfig(time_limit=5.0, drones_per_team=2)


def check_provenance(found, command, rules=RULES):
    assert found["rules_hash"] == rules.rules_hash
    assert GameConfig.from_dict(found["rules"]).rules_hash == rules.rules_hash
    assert found["versions"]["swarm-pz"] == version("swarm-pz")
    assert found["versions"]["python"] == platform.python_version()
    assert found["versions"]["numpy"] == np.__version__ and found["versions"]["numba"] == numba.__version__
    assert shlex.split(found["command"]) == command


def test_versions_name_torch_where_it_is_installed(monkeypatch):
    assert versions()["torch"].split("+")[0] == torch.__version__.split("+")[0]

    def without(name):
        if name in ("torch", "stable-baselines3"):
            raise PackageNotFoundError(name)
        return version(name)

    monkeypatch.setattr("importlib.metadata.version", without)
    assert list(versions()) == ["python", "swarm-pz", "numpy", "numba"]


def test_several_games_are_told_apart_by_name():
    found = provenance({"one": RULES, "other": GameConfig(capture=CaptureConfig(enabled=False))}, "command")
    assert set(found["rules"]) == set(found["rules_hash"]) == {"one", "other"}
    assert found["rules_hash"]["one"] == RULES.rules_hash != found["rules_hash"]["other"]
    json.dumps(found)


def test_what_a_learner_sees_does_not_count():
    assert provenance(RULES) == provenance(RULES.replace(observation=ObservationConfig(grid=10)))


@pytest.mark.parametrize(
    ("command", "out"),
    [
        (["evaluate", "ring", "--games", "2", "--json"], "my figures.json"),
        (["diagnose", "ring", "noise", "--seconds", "1", "--json"], "my figures.json"),
    ],
)
def test_commands_print_and_write_the_same_rules(command, out, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main([*command, out, *SHORT])
    assert f"rules: {RULES.rules_hash}\n" in capsys.readouterr().out
    check_provenance(json.loads((tmp_path / out).read_text()), ["swarm-pz", *command, out, *SHORT])


def test_a_ladder_says_where_it_comes_from(tmp_path, capsys):
    out = tmp_path / "my ladder"
    command = ["tournament", "ring", "uniform", "--processes", "1", "--games", "2", "--out", str(out), *SHORT]
    main(command)
    assert f"rules: {RULES.rules_hash}\n" in capsys.readouterr().out
    for name in ("ladder.json", "tournament.json"):
        check_provenance(json.loads((out / name).read_text()), ["swarm-pz", *command])
    page = (out / "ladder.md").read_text()
    assert f"Rules: `{RULES.rules_hash}`" in page and shlex.join(["swarm-pz", *command]) in page


def test_a_film_says_its_rules(tmp_path, capsys):
    main(["render", "ring", "noise", "--out", str(tmp_path / "board.png"), "--seconds", "1", *SHORT])
    assert f"rules: {RULES.rules_hash}\n" in capsys.readouterr().out


def test_a_measurement_of_speed_says_where_it_comes_from(tmp_path, monkeypatch):
    monkeypatch.setattr("swarm_pz.bench._SHORTEST", 0.0)
    monkeypatch.setattr("swarm_pz.bench.phases", lambda config: {})
    out = tmp_path / "bench.json"
    command = ["bench", "--games", "1", "--drones", "2", "--threads", "1", "--repeats", "1", "--json", str(out)]
    main(command)
    found = json.loads(out.read_text())
    check_provenance(found, ["swarm-pz", *command], GameConfig())
    assert found["machine"]["swarm-pz"] == version("swarm-pz")


def test_the_table_says_its_rules(monkeypatch):
    served = {}
    monkeypatch.setattr("swarm_pz.play.server.serve.serve", lambda *_, **how: served.update(how))
    main(["play"])
    assert re.search(rf"^rules: {GameConfig().rules_hash}\b", served["greeting"], re.MULTILINE)


def test_the_default_game_has_one_hash_in_every_command():
    from swarm_pz.training.config import LeagueConfig, TrainConfig

    hashes = {config.rules_hash for config in (GameConfig(), TrainConfig().game, LeagueConfig().learner.game)}
    assert hashes == {GameConfig.preset("paper").rules_hash}
