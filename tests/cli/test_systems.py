"""What ``systems`` passes on, prints and refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.figures.systems import making
from swarm_pz.figures.systems.making import SystemsConfig

ROW = {
    "entrant": "direct/hem_in",
    "wins": 3,
    "draws": 1,
    "losses": 0,
    "win_rate_ci95": [0.3, 0.95],
    "time_to_win": {"mean": 12.3},
}


@pytest.fixture
def made(monkeypatch):
    """Note what is to be made, instead of making it."""
    notes = []

    def make(config, folder, out, *, processes, progress, asked, command):
        notes.append((config, folder, out, processes, command))
        progress(1, 2)
        return {"standings": [ROW]}

    monkeypatch.setattr(making, "make", make)
    return notes


def test_systems_makes_the_ladder_as_it_was_asked_and_prints_it(made, capsys):
    main(["systems", "--only", "direct", "--games", "4", "--game.time-limit", "9", "--out", "here", "--processes", "1"])
    config = SystemsConfig(systems=("direct",), games=4, game=GameConfig(time_limit=9.0))
    command = "swarm-pz systems --only direct --games 4 --game.time-limit 9 --out here --processes 1"
    assert made == [(config, Path("runs/systems"), Path("here"), 1, command)]
    said = capsys.readouterr().out
    assert "won   3 drawn   1 lost   0 (30 to 95 %), 12 s to a win" in said and "systems: here/systems.md" in said


def test_the_quick_one_is_short_and_stays_in_its_folder(made):
    main(["systems", "--quick", "--folder", "kept"])
    config, folder, out, processes, _ = made[0]
    assert (config, folder, out, processes) == (SystemsConfig().quick, Path("kept"), Path("kept"), 2)


def test_what_is_wrong_is_one_line(capsys):
    for words, said in ((["--only", "nothing"], "there is no control system 'nothing'"), (["--games", "3"], "even")):
        with pytest.raises(SystemExit):
            main(["systems", *words])
        assert said in capsys.readouterr().err
