"""What ``systems`` passes on, prints and refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.systems_ladder import making
from benchmarks.systems_ladder.making import SystemsConfig
from swarm_pz.cli import main
from swarm_pz.config import GameConfig

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

    def make(config, folder, out, *, pool, progress, asked, command):
        notes.append((config, folder, out, pool.slots, command))
        progress(1, 2)
        return {"standings": [ROW]}

    monkeypatch.setattr(making, "make", make)
    return notes


def test_systems_makes_the_ladder_as_it_was_asked_and_prints_it(made, capsys):
    words = "--only direct --games 4 --pilot-games 6 --starts 3 --seconds 5 --seed 7 --game.time-limit 9 --out here"
    main(["systems", *words.split(), "--processes", "1"])
    numbers = {"games": 4, "pilot_games": 6, "starts": 3, "seconds": 5, "seed": 7}
    config = SystemsConfig(systems=("direct",), **numbers, game=GameConfig(time_limit=9.0))
    command = f"swarm-pz systems {words} --processes 1"
    assert made == [(config, Path("runs/systems"), Path("here"), 1, command)]
    said = capsys.readouterr().out
    words = " ".join(said.split())
    assert " 3 1 0 30 to 95 % 12 systems: here/systems.md" in words and "won drawn lost won 95 % s to a win" in words


def test_the_quick_one_is_short_and_stays_in_its_folder(made):
    main(["systems", "--quick", "--folder", "kept"])
    config, folder, out, slots, _ = made[0]
    assert (config, folder, out, slots) == (SystemsConfig().quick, Path("kept"), Path("kept"), 4)


def test_who_never_won_has_no_time_to_a_win(made, monkeypatch, capsys):
    monkeypatch.setitem(ROW, "wins", 0)
    main(["systems"])
    assert " 0 1 0 30 to 95 % no win " in " ".join(capsys.readouterr().out.split())


def test_what_is_wrong_is_one_line(capsys):
    for words, said in ((["--only", "nothing"], "there is no control system 'nothing'"), (["--games", "3"], "even")):
        with pytest.raises(SystemExit):
            main(["systems", *words])
        assert said in capsys.readouterr().err


@pytest.mark.parametrize("flown", [["direct"], ["ergodic", "direct"]], ids=" ".join)
def test_who_flies_is_not_for_the_rules_to_say(made, capsys, flown):
    with pytest.raises(SystemExit):
        main(["systems", "--game.controllers", *flown])
    assert "game.controllers must be left at 'ergodic': each system flies in turn" in capsys.readouterr().err
    assert not made
