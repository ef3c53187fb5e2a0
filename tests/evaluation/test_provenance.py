"""Every file of results says where it comes from, and the same rules have the same hash everywhere."""

import json
import re
import shlex

from swarm_pz.cli import main
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation.provenance import provenance, versions

RULES = GameConfig(time_limit=5.0, drones_per_team=2)


def test_rules_do_not_hang_on_what_a_learner_sees():
    assert provenance(RULES) == provenance(RULES.replace(observation=ObservationConfig(grid=10)))


def test_commands_print_and_write_the_rules_and_themselves(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.ratings._RESAMPLES", 20)
    for words, files in {
        "evaluate ring --opponent noise --games 2 --json out.json": ["out.json"],
        "tournament ring uniform --processes 1 --games 2 --out 'my ladder'": ["ladder.json", "tournament.json"],
    }.items():
        command = [*shlex.split(words), "--game.time-limit", "5", "--game.drones-per-team", "2"]
        main(command)
        assert f"rules: {RULES.rules_hash}\n" in capsys.readouterr().out
        for file in files:
            found = json.loads((tmp_path / ("my ladder" if "ladder" in words else "") / file).read_text())
            assert GameConfig.from_dict(found["rules"]).rules_hash == found["rules_hash"] == RULES.rules_hash
            assert found["versions"] == versions() and shlex.split(found["command"]) == ["swarm-pz", *command]


def test_the_default_game_has_one_hash_in_every_command(monkeypatch):
    from swarm_pz.training.config import LeagueConfig, TrainConfig

    served = {}
    monkeypatch.setattr("swarm_pz.play.server.serve.serve", lambda *_, **how: served.update(how))
    main(["play"])
    configs = (GameConfig(), TrainConfig().game, LeagueConfig().learner.game)
    assert {config.rules_hash for config in configs} == {(rules := GameConfig.preset("paper").rules_hash)}
    assert re.search(rf"^rules: {rules}\b", served["greeting"])
