"""The page's control system: installed as a package, found, and played from the command line."""

from __future__ import annotations

import json
import os
import pickle
import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.evaluation.tournament import TournamentConfig
from swarm_pz.play.game import TableConfig
from swarm_pz.simulator import Simulator
from swarm_pz.systems import ControlSystem
from swarm_pz.training.config import TrainConfig
from tests.systems_of_tests import install

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/tutorials/system.md").read_text()


def block(language):
    return re.search(rf"^```{language}\n(.*?)^```", PAGE, re.M | re.S).group(1)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """The folder in which the page's package is installed."""
    project = tomllib.loads(block("toml"))["project"]
    ((group, points),) = project["entry-points"].items()
    ((name, value),) = points.items()
    (tmp_path / f"{value.partition(':')[0]}.py").write_text(block("py"))
    told = tmp_path / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    told.mkdir()
    (told / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    (told / "entry_points.txt").write_text(f"[{group}]\n{name} = {value}\n")
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_it_is_found_and_plays_a_match_from_the_command_line(package, tmp_path):
    (line,) = block("console").splitlines()
    arguments = line.split()[1:]
    arguments[arguments.index("--games") + 1] = "2"
    file = tmp_path / "match.json"
    arguments += ["--game.time-limit", "5", "--json", str(file)]
    path = os.pathsep.join([str(package), *filter(None, [str(ROOT), os.environ.get("PYTHONPATH")])])
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-c", "from swarm_pz.cli import main; main()", *arguments],
        env=os.environ | {"PYTHONPATH": path},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "against uniform" in done.stdout and "forfeit" not in done.stdout
    assert json.loads(file.read_text())["games"] == 2


def test_it_is_tried_without_being_installed(package):
    """Only what was installed could fly, so that nothing could be tried."""
    (package / "swarm_orbit-1.0.dist-info" / "entry_points.txt").unlink()
    from swarm_orbit import Orbit

    exec(re.findall(r"^```py\n(.*?)^```", PAGE, re.M | re.S)[1].replace("games=10", "games=2"), {})  # noqa: S102
    config = GameConfig(controllers=(Orbit(speed=0.3), "ergodic"), time_limit=3.0)
    assert config.replace(time_limit=4.0).team_controllers == ("orbit", "ergodic")
    assert GameConfig(controllers=(Orbit, "ergodic")) == GameConfig(controllers=(Orbit(), "ergodic"))
    assert config.hash != config.replace(controllers=(Orbit(), "ergodic")).hash
    assert pickle.loads(pickle.dumps(config)) == config  # noqa: S301
    environment = gymnasium.make("swarm_pz/Capture-v0", config=config, side="blue")
    check_env(environment.unwrapped, skip_render_check=True)
    assert environment.action_space.shape == (3,)

    @dataclass(frozen=True, kw_only=True)
    class Wide(Orbit):
        """Says no name."""

    assert GameConfig(controllers=Wide).team_controllers[0].startswith(f"{__name__}:test_it_is_tried_")
    named = r"files name control systems, and orbit is not installed: register it under the entry points"
    for writes in (TableConfig, TrainConfig, TournamentConfig):
        with pytest.raises(ConfigError, match=named):
            writes(game=config)

    @dataclass(frozen=True, kw_only=True)
    class Taken(Orbit):
        """Has another's name."""

        name: ClassVar[str] = "flocking"

    with pytest.raises(ConfigError, match="Taken must have a name of its own: 'flocking' is control system 'flocking'"):
        GameConfig(controllers=Taken())
    for bad, said in ((type("Plain", (Orbit,), {}), "must be a frozen dataclass"), (ControlSystem, "cannot be|frozen")):
        with pytest.raises(ConfigError, match=said):
            GameConfig(controllers=bad)


def test_it_does_what_it_says_alone_and_among_others(package, monkeypatch):
    from swarm_orbit import Orbit

    install(monkeypatch, Orbit)
    config = GameConfig(controllers=(Orbit(speed=0.25), "ergodic"), capture=GameConfig().capture.replace(enabled=False))
    assert GameConfig.from_dict(config.to_dict()) == config
    several, alone = Simulator(config, num_games=3), Simulator(config)
    several.reset(range(3))
    alone.reset([2])
    several.command(0, [(0.5, 0.5, 0.2), (0.4, 0.6, 0.25), (0.6, 0.4, 0.3)])
    alone.command(0, [(0.6, 0.4, 0.3)])
    for simulator in (several, alone):
        simulator.advance(600)
    np.testing.assert_array_equal(several.positions[2], alone.positions[0])
    for row, (x, y, radius) in enumerate([(0.5, 0.5, 0.2), (0.4, 0.6, 0.25), (0.6, 0.4, 0.3)]):
        distance = np.linalg.norm(several.positions[row, :10] - (x, y), axis=1)
        assert abs(distance.mean() - radius) < 0.08
    ring = np.zeros((1, 10, 10))
    ring[0, 1:9, [1, 8]] = ring[0, [1, 8], 1:9] = 1.0
    np.testing.assert_allclose(Orbit().from_densities(ring, config)[0, :2], 0.5, atol=1e-6)
    assert Orbit().from_densities(np.zeros((1, 10, 10)), config).shape == (1, 3)
