"""The pages' snippets run, and pages that a program writes are up to date; names and links: test_pages.py."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import json
import re
import shlex
import sys
import tomllib
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import swarm_pz.play.client
import swarm_pz.training.vec_env
from swarm_pz import GameConfig, cli
from swarm_pz.cli import main
from swarm_pz.evaluation import season
from swarm_pz.play.factors import Factors
from swarm_pz.play.frames import Frame
from swarm_pz.play.studies.design import Condition, Study

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]

FIRST_STEPS = [("git", "clone", "ADDRESS", "swarm-pz"), ("cd", "swarm-pz"), (".", ".venv/bin/activate")]
"""Plain shell commands in the README."""


def snippets(language):
    """Return (page, text) of every fenced block of a language."""
    found = []
    for page in PAGES:
        name = str(page.relative_to(ROOT))
        found += [(name, text) for text in re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.M | re.S)]
    return found


def command_lines():
    """Return (page, line) of every line of a bash block, without comments."""
    lines = [(page, line) for page, text in snippets("bash") for line in text.splitlines()]
    return [(page, line) for page, line in lines if shlex.split(line, comments=True)]


@pytest.mark.parametrize(("page", "line"), command_lines())
def test_commands_of_the_pages_exist(page, line, monkeypatch):
    called, of = [], cli.commands_of

    def stand_ins(program):
        return {name: functools.wraps(one)(lambda *_, **__: called.append(True)) for name, one in of(program).items()}

    monkeypatch.setattr(cli, "commands_of", stand_ins)
    program, *arguments = shlex.split(line, comments=True)
    if (program, *arguments) in FIRST_STEPS:
        assert page == "README.md"
    elif Path(program).name == "swarm-pz":
        main(arguments)
        assert called
    elif program == "python":
        path = f"{arguments[1].replace('.', '/')}.py" if arguments[0] == "-m" else arguments[0]
        path = path if (ROOT / path).is_file() else path.replace(".py", "/__main__.py")  # of a folder
        assert (ROOT / path).is_file()
        options = [argument for argument in arguments if argument.startswith("--")]
        text = (ROOT / path).read_text()
        assert all(f'"{one}"' in text or f"    {one[2:].replace('-', '_')}: " in text for one in options)
    elif program == "pip":
        extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
        assert set(re.search(r"swarm-pz\[([\w,]+)\] @ ", arguments[1])[1].split(",")) <= extras.keys()
    else:
        assert program.startswith("scripts/"), f"{page} calls {program}, which this test cannot check"
        assert (ROOT / program).stat().st_mode & 0o100


def test_the_page_of_commands_lists_all_of_them_as_their_help_does():
    commands = load("commands.py")
    assert commands.PAGE.read_text() == commands.page(), "docs/commands.md is out of date: python docs/commands.py"


def test_every_python_snippet_is_run(monkeypatch, capsys):
    """Run each snippet that is no doctest: it is a client of the server, and here a stand-in plays the game.

    tests/play/studies/test_export.py runs those of docs/data.md, which need an export, and
    tests/play/ros/test_bridge.py that of docs/ros.md.
    """

    def stand_in(address, tactic, **options):
        generator = np.random.default_rng(0)
        positions, teams = generator.random((20, 2)), np.arange(20) // 10
        frame = Frame(sequence=1, tick=0, server_ms=0.0, positions=positions, velocities=np.zeros((20, 2)), teams=teams)
        density = np.array(tactic(frame, 0), float)
        assert density.shape == (10, 10)
        assert density.min() >= 0
        assert density.max() <= 1
        return "red"

    monkeypatch.setattr(swarm_pz.play.client, "play", stand_in)
    programs = [(page, text) for page, text in snippets("python") if ">>>" not in text and "--8<--" not in text]
    programs = [(page, text) for page, text in programs if page not in ("docs/data.md", "docs/ros.md")]
    for page, text in programs:
        assert "swarm_pz.play.client" in text, f"a snippet of {page} is run by no test: make it a doctest"
        exec(compile(text, page, "exec"), {})  # noqa: S102  (our own pages)
    assert capsys.readouterr().out == "red\n" * len(programs)


def test_toml_snippets_are_toml():
    for page, text in snippets("toml"):
        read = tomllib.loads(text)
        if page == "docs/studies.md":
            if "red" in read:
                assert all(Factors.from_dict(read[team]) != Factors() for team in ("red", "blue"))
            assert read.keys() <= {"red", "blue"} | {entry.name for entry in fields(Study)}
            assert all(Condition.from_dict(one).levels for one in read.get("conditions", []))
            continue
        if page == "docs/season.md":
            assert read.keys() <= season.FIELDS.keys()
            continue
        groups = read["project"]["entry-points"]
        assert groups and set(groups) <= {"swarm_pz.policies", "swarm_pz.systems"}


def load(name):
    """Import a file of the documentation."""
    spec = importlib.util.spec_from_file_location(f"docs_{Path(name).stem}", ROOT / "docs" / name)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_ppo_in_one_file_runs(tmp_path, capsys, monkeypatch):
    few = {"steps": 64, "games": 4, "rollout": 8, "threads": 1, "evaluation-games": 2, "out": tmp_path / "ppo.pt"}
    options = [text for name, value in few.items() for text in (f"--{name}", str(value))]
    ppo = load("tutorials/ppo.py")
    monkeypatch.setattr(ppo, "play_match", functools.partial(ppo.play_match, config=GameConfig(time_limit=5.0)))
    monkeypatch.setattr(sys, "argv", ["ppo.py", *options])
    ppo.main()
    assert len(re.findall(r"steps  share", capsys.readouterr().out)) == 2
    assert (tmp_path / "ppo.pt").stat().st_size > 0


def test_ppo_values_time_outs_and_leaves_out_restarts():
    import torch

    ppo = load("tutorials/ppo.py")
    rewards, values, after = torch.zeros(2, 2), torch.zeros(2, 2), torch.ones(2, 2)
    over = torch.tensor([[True, True], [False, False]])
    ended = torch.tensor([[True, False], [False, False]])
    estimates = ppo.advantages(rewards, values, after, ended, over)
    assert estimates[0].tolist() == pytest.approx([0.0, ppo.GAMMA])


def test_ippo_runs_draws_its_curve_and_compares_with_random_accelerations(tmp_path, capsys, monkeypatch):
    few = {"steps": 256, "games": 2, "rollout": 16, "drones": 2, "time-limit": 4, "evaluation-games": 2}
    options = [text for name, value in (few | {"out": tmp_path}).items() for text in (f"--{name}", str(value))]
    monkeypatch.setattr(sys, "argv", ["ippo.py", *options])
    load("tutorials/ippo.py").main()
    assert "share above that of random: " in capsys.readouterr().out
    figures = json.loads((tmp_path / "figures.json").read_text())
    low, high = figures["share_above_random"]["ci95"]
    assert low <= figures["share_above_random"]["mean"] <= high
    assert figures["ippo.py"]["games"] + figures["random"]["games"] >= 2 and figures["steps"] == 256
    assert {path.name for path in tmp_path.iterdir()} == {"figures.json", "learning_curve.png", "model.zip"}
