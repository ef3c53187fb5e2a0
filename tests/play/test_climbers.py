"""What people reached is kept: by code, game by game, whatever becomes of the server."""

import csv
from dataclasses import replace

import pytest

from swarm_pz.errors import ConfigError, RecordingError
from swarm_pz.play.climbers import REACHED_S, TABLE, Climbed, Climber, reached, rows_of, write_table
from swarm_pz.play.levels import level_of

GAME = Climbed(
    at=1.0,
    system="ergodic",
    opponent="uniform",
    rating=1000.0,
    side="red",
    seed=3,
    outcome="win",
    ended_by="capture",
    seconds=60.0,
    recording="a.jsonl",
)


def test_games_are_there_for_who_comes_back_and_nothing_for_who_has_only_asked(tmp_path):
    climber = Climber(tmp_path, "P01")
    games = [GAME, replace(GAME, outcome="loss", ended_by="left"), replace(GAME, outcome="draw", system="direct")]
    for game in games:
        climber.add(game)
    again = Climber(tmp_path, "P01")  # while the first is there: what was added is in the file at once
    assert again.games == climber.games == games and again.of("direct") == games[2:]
    assert [game.met.points for game in games] == [1.0, 0.0, 0.5]
    assert Climber(tmp_path / "levels", "P02").games == [] and not (tmp_path / "levels").exists()


@pytest.mark.parametrize("code", ["", "../P01", ".seats", "P\n", "x" * 33, "é"])
def test_what_is_no_code_is_refused(code, tmp_path):
    with pytest.raises(ConfigError, match="code"):
        Climber(tmp_path, code)


def test_a_line_that_was_not_written_to_its_end_is_none(tmp_path):
    Climber(tmp_path, "P01").add(GAME)
    with (tmp_path / "P01.jsonl").open("ab") as file:
        file.write(b'{"at": 2.0, "system": "er')
    climber, second = Climber(tmp_path, "P01"), replace(GAME, at=3.0)
    assert climber.games == [GAME]
    climber.add(second)
    assert Climber(tmp_path, "P01").games == [GAME, second]


@pytest.mark.parametrize("line", [b'{"at": 1}', b"\xff\xfe", b"[]"])
def test_a_corrupt_file_is_named_and_left_as_it_is(line, tmp_path):
    path = tmp_path / "P01.jsonl"
    Climber(tmp_path, "P01").add(GAME)
    before = path.read_bytes() + line + b"\n"
    path.write_bytes(before)
    with pytest.raises(RecordingError, match=r"line 2 of P01\.jsonl"):
        Climber(tmp_path, "P01")
    assert path.read_bytes() == before


def test_a_game_that_cannot_be_written_is_not_kept(tmp_path):
    climber = Climber(tmp_path, "P01")
    (tmp_path / "P01.jsonl").mkdir()
    with pytest.raises(OSError, match="P01"):
        climber.add(GAME)
    assert climber.games == []


def test_systems_are_compared_by_the_games_that_began_within_twenty_minutes(tmp_path):
    climber, most = Climber(tmp_path, "P01"), 0.6 * REACHED_S
    games = [replace(GAME, seconds=most), replace(GAME, seconds=most), replace(GAME, outcome="loss")]
    for game in games:
        climber.add(game)
    (row,) = rows_of(climber)
    assert (row.games, row.won, row.lost, row.games_20min) == (3, 2, 1, 2)
    assert row.level_20min == level_of([game.met for game in games[:2]]).value > row.level == reached(games).value


def test_the_table_has_a_row_for_each_code_and_system_and_tells_what_it_could_not_read(tmp_path):
    assert write_table(tmp_path) == []
    assert (tmp_path / TABLE).read_text().startswith("code,system,games,")
    Climber(tmp_path, "P02").add(GAME)
    first = Climber(tmp_path, "P01")
    first.add(GAME)
    first.add(replace(GAME, system="direct", outcome="draw"))
    (tmp_path / "P03.jsonl").write_text("nonsense\n")
    (fault,) = write_table(tmp_path)
    assert "P03" in fault
    with (tmp_path / TABLE).open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["code"], row["system"]) for row in rows] == [("P01", "direct"), ("P01", "ergodic"), ("P02", "ergodic")]
    assert rows[1]["level"] == rows[2]["level"] == str(round(reached([GAME]).value, 1))
    assert [row["drawn"] for row in rows] == ["1", "0", "0"]
