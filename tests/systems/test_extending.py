"""The control system of docs/tutorials/system.md: installed as a package, found, and played."""

from __future__ import annotations

import json
import pickle
import re
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import gymnasium
import numpy as np
import pytest

from swarm_pz.cli import main
from swarm_pz.config import GameConfig, registry
from swarm_pz.errors import ConfigError
from swarm_pz.evaluation.tournament import TournamentConfig
from swarm_pz.play.game import TableConfig
from swarm_pz.simulator import Simulator
from swarm_pz.systems import ControlSystem
from swarm_pz.training.config import TrainConfig

PAGE = (Path(__file__).parents[2] / "docs/tutorials/system.md").read_text()


def block(language):
    return re.search(rf"^```{language}\n(.*?)^```", PAGE, re.M | re.S).group(1)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """The folder in which the page's package is installed."""
    project = tomllib.loads(block("toml"))["project"]
    ((group, points),) = project["entry-points"].items()
    ((name, value),) = points.items()
    (tmp_path / f"{value.partition(':')[0]}.py").write_text(block("py"))
    dist = tmp_path / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    dist.mkdir()
    (dist / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    (dist / "entry_points.txt").write_text(f"[{group}]\n{name} = {value}\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "swarm_orbit", raising=False)
    for cached in (registry.system_class, registry._find):
        monkeypatch.setattr(registry, cached.__name__, cached.__wrapped__)
    return tmp_path


def test_it_is_found_plays_a_match_from_the_command_line_and_does_what_it_says(package, capsys):
    (line,) = block("console").splitlines()
    arguments = line.split()[1:]
    arguments[arguments.index("--games") + 1] = "2"
    file = package / "match.json"
    main([*arguments, "--game.time-limit", "5", "--json", str(file)])
    printed = capsys.readouterr().out
    assert "against uniform" in printed and "forfeit" not in printed
    assert json.loads(file.read_text())["games"] == 2
    orbit = registry.system_class("orbit")
    config = GameConfig(controllers=(orbit(speed=0.25), "ergodic"), drones_per_team=4)
    assert GameConfig.from_dict(config.to_dict()) == config
    simulator = Simulator(config.replace(capture=config.capture.replace(enabled=False)))
    simulator.reset([0])
    simulator.command(0, [(0.4, 0.6, 0.25)])
    simulator.advance(450)
    distance = np.linalg.norm(simulator.positions[0, :4] - (0.4, 0.6), axis=1)
    assert abs(distance.mean() - 0.25) < 0.08


def test_it_is_tried_without_being_installed(package):
    """Catches a system that must be installed before it can be tried."""
    (package / "swarm_orbit-1.0.dist-info" / "entry_points.txt").unlink()
    from swarm_orbit import Orbit

    exec(re.findall(r"^```py\n(.*?)^```", PAGE, re.M | re.S)[1].replace("games=10", "games=2"), {})  # noqa: S102
    config = GameConfig(controllers=(Orbit(speed=0.3), "ergodic"), time_limit=3.0)
    assert config.replace(time_limit=4.0).team_controllers == ("orbit", "ergodic")
    assert GameConfig(controllers=(Orbit, "ergodic")) == GameConfig(controllers=(Orbit(), "ergodic"))
    assert config.hash != config.replace(controllers=(Orbit(), "ergodic")).hash
    assert pickle.loads(pickle.dumps(config)) == config  # noqa: S301
    assert gymnasium.make("swarm_pz/Capture-v0", config=config, side="blue").action_space.shape == (3,)
    for writes in (TableConfig, TrainConfig, TournamentConfig):
        with pytest.raises(ConfigError, match="orbit is not installed: register it"):
            writes(game=config)

    @dataclass(frozen=True, kw_only=True)
    class Wide(Orbit):
        """Sets no name."""

    @dataclass(frozen=True, kw_only=True)
    class Taken(Orbit):
        """Has the name of another system."""

        name: ClassVar[str] = "flocking"

    assert GameConfig(controllers=Wide).team_controllers[0].startswith(f"{__name__}:test_it_is_tried_")
    plain = type("Plain", (Orbit,), {})
    for bad, message in ((Taken(), "'flocking' is"), (plain, "frozen dataclass"), (ControlSystem, "cannot be|frozen")):
        with pytest.raises(ConfigError, match=message):
            GameConfig(controllers=bad)
