"""Tables of recorded games, computed by hand from a few lines."""

import csv
import io
import json
import os
from dataclasses import asdict, replace

import msgspec
import pytest

from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import Timing
from swarm_pz.play.recordings.format import (
    VERSION,
    CapturedLine,
    CommandLine,
    EndLine,
    Header,
    InForceLine,
    Origin,
    PaintedLine,
    RecordedSeat,
    Recording,
    SeatLine,
)
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.recordings.study import left_out, read_folder, summarise, write_tables
from tests.play.recordings.test_format import plain_lines, record, write_chained

CONFIG = TableConfig(
    game=GameConfig(drones_per_team=(5, 3), time_limit=60.0), min_command_interval=0.25, mapping="paper", speed=2.0
)


def header(**more):
    return Header(
        version=VERSION,
        software="test",
        started="2026-01-01T00:00:00.000+00:00",
        table=CONFIG.to_dict(),
        config_hash=CONFIG.hash,
        seed=1,
        rules_hash=CONFIG.game.rules_hash,
        **{"red": RecordedSeat(kind="person", label="P1"), "blue": RecordedSeat(kind="policy", policy="ring")} | more,
    )


def command(team, number, tick, received_ms, timing=None):
    return CommandLine(team=team, number=number, density=[], received_ms=received_ms, tick=tick, timing=timing)


def in_force(team, number, tick, ms):
    return InForceLine(team=team, number=number, tick=tick, ms=ms)


def captured(drone, team, tick):
    return CapturedLine(tick=tick, drone=drone, team=team)


def seat(team, event, ms):
    return SeatLine(team=team, event=event, ms=ms)


def timing(before_ms, round_trip_ms, drawing_ms):
    """Tell that a command was made so long before it was sent."""
    return Timing(input_ms=100.0, sent_ms=100.0 + before_ms, round_trip_ms=round_trip_ms, drawing_ms=drawing_ms)


PAST = [command(0, 1, 3, 40.0, timing(30.0, 20.0, 900.0)), in_force(0, 1, 3, 100.0), captured(0, 1, 150)]
TAKEN_OVER = [  # from tick 300 on, at twice the speed
    seat(0, "connected", 0.0),
    seat(0, "hidden", 1000.0),
    command(0, 1, 360, 2000.0, timing(30.0, 20.0, 400.0)),  # made at 1960, drawn from 1560 on
    in_force(0, 1, 360, 2050.0),
    PaintedLine(team=0, number=1, ms=2100.0),
    captured(1, 1, 405),  # at 1750
    captured(7, 0, 405),
    seat(0, "shown", 2500.0),
    captured(2, 1, 450),  # at 2500
    command(1, 1, 456, 3000.0),
    in_force(1, 1, 456, 3050.0),
    seat(1, "disconnected", 3100.0),
    seat(1, "connected", 3200.0),
    seat(1, "displaced", 3300.0),
    seat(1, "disconnected", 3400.0),
    command(0, 1, 480, 4000.0),  # the page was reloaded, and tells no times
    in_force(0, 1, 480, 4050.0),
    PaintedLine(team=0, number=1, ms=4100.0),
    command(0, 2, 510, 5000.0, timing(0.0, 10.0, 0.0)),  # made at 4995, and not drawn
    in_force(0, 2, 510, 5100.0),
    PaintedLine(team=0, number=2, ms=5205.0),
    command(0, 3, 540, 6000.0, timing(0.0, 0.0, 800.0)),
    in_force(0, 3, 540, 6300.0),
    PaintedLine(team=0, number=3, ms=6020.0),
    seat(1, "hidden", 7000.0),
    seat(0, "hidden", 8000.0),
    seat(0, "disconnected", 8250.0),
    EndLine(outcome="blue", tick=900, sizes=(3, 5), ms=9000.0, ended_by="left"),
]


def test_games_are_summed_up_by_who_played_whom_by_which_rules():
    base, _ = seat_rows(Recording("a.jsonl", header(), TAKEN_OVER))
    assert base.left_out == "left"
    base = replace(base, left_out="")
    games = [
        replace(base, outcome=outcome, seconds=seconds, final_share=share, commands_per_minute=often)
        for outcome, seconds, share, often in (
            ("win", 10.0, 1.0, 6.0),
            ("draw", 60.0, 0.5, 8.0),
            ("win", 30.0, 0.9, 1.0),
        )
    ]
    left_out = [
        replace(base, outcome="stopped"),
        replace(base, taken_over=True),
        replace(base, opponent_kind="free", opponent=""),
    ]
    others = [
        replace(base, **{name: value})
        for name, value in (
            ("kind", "program"),
            ("player", "P2"),
            ("opponent_kind", "person"),
            ("opponent", "uniform"),
            ("system", "direct"),
            ("opponent_system", "direct"),
            ("config_hash", "0" * 16),
        )
    ]
    rows = summarise([*left_out, *others, *games])
    assert [row.games for row in rows].count(1) == 7 and len(rows) == 8
    (row,) = [row for row in rows if row.games == 3]
    assert (row.kind, row.player, row.opponent_kind, row.opponent) == ("person", "P1", "policy", "ring")
    assert (row.config_hash, row.rules_hash) == (CONFIG.hash, CONFIG.game.rules_hash)
    assert (row.min_command_interval, row.wins, row.draws, row.losses) == (0.25, 2, 1, 0)
    assert row.win_rate == pytest.approx(2 / 3) and row.win_rate_low < row.win_rate < row.win_rate_high
    assert row.final_share == pytest.approx(0.8) and row.commands_per_minute == pytest.approx(5.0)
    assert row.median_s == 30.0 and row.restricted_mean_s == pytest.approx((10 + 30 + 60) / 3)


@pytest.mark.parametrize("parquet", [False, True])
def test_tables_hold_every_row_and_no_spreadsheet_takes_a_label_for_a_formula(parquet, tmp_path):
    base, _ = seat_rows(Recording("a.jsonl", header(), TAKEN_OVER))
    base = replace(base, left_out="")
    labels = ["=1+1", "+1", "-1", "@sum", "\t=1+1", "\r=1", "P1"]
    rows = [replace(base, player=label, outcome="win", final_share=1 / 3) for label in labels]
    seats, summary, schema = write_tables(rows, tmp_path / "deep" / "er", parquet=parquet)
    suffix = "parquet" if parquet else "csv"
    assert [path.name for path in (seats, summary, schema)] == [f"seats.{suffix}", f"summary.{suffix}", "schema.json"]
    tables = json.loads(schema.read_text())["tables"]
    for path, expected in ((seats, rows), (summary, summarise(rows))):
        if parquet:
            import pyarrow.parquet

            assert pyarrow.parquet.read_table(path).to_pylist() == [asdict(row) for row in expected]
            continue
        read = list(csv.DictReader(io.StringIO(path.read_bytes().decode(), newline="")))
        assert list(read[0]) == list(tables[path.stem])
        assert {row["player"] for row in read} == {"'=1+1", "'+1", "'-1", "'@sum", "'\t=1+1", "'\r=1", "P1"}
        assert "apostrophe" in json.loads(schema.read_text())["notes"]["text"]
        for name, text in read[-1].items():
            value = getattr(expected[-1], name)
            if isinstance(value, float):
                assert float(text) == pytest.approx(value, abs=1e-6), name
            elif name != "player":
                assert text == ("" if value is None else str(value)), name


def test_games_of_a_folder_come_in_the_order_of_their_names_and_what_cannot_be_read_is_named(tmp_path):
    for name in ("20260102-b", "20260101-a", "20260103-c"):
        Recorder(tmp_path / f"{name}.jsonl", header(blue=RecordedSeat(kind="free"))).close()
    (tmp_path / "20260104-d.jsonl").write_text("{}\n")
    (tmp_path / "notes.txt").write_text("not a game")
    rows, faults = read_folder(tmp_path)
    assert [row.recording[:8] for row in rows] == ["20260101", "20260102", "20260103"]
    assert len(faults) == 1 and "20260104-d.jsonl" in faults[0]


# --- a folder counted by hand ---------------------------------------------------------------------

FAIR = TableConfig()
SLOW = TableConfig(speed=0.5)
LARGE = TableConfig(game=GameConfig(drones_per_team=(12, 5)))
END = {"red": "capture", "blue": "capture", "draw": "time", "stopped": "server"}


def write_game(folder, name, label, outcome, seconds, *, config=FAIR, commands=1, lines=(), ended_by=None, **more):
    """Write a game of a person against ring; what it shows is nobody's business here."""
    told = msgspec.structs.replace(
        header(red=RecordedSeat(kind="person", label=label), **more),
        table=config.to_dict(),
        config_hash=config.hash,
        rules_hash=config.game.rules_hash,
    )
    recorder = Recorder(folder / f"{name}.jsonl", told)
    recorder.write(seat(0, "connected", 0.0))
    for number in range(commands):
        recorder.write(command(0, number + 1, 0, 100.0 * number))
    recorder.write(command(1, 1, 0, 50.0))
    for line in lines:
        recorder.write(line)
    if outcome is not None:
        reason = ended_by or END[outcome]
        recorder.write(EndLine(outcome=outcome, tick=30 * seconds, sizes=(1, 1), ms=1000.0 * seconds, ended_by=reason))
    recorder.close()


GONE = [seat(0, "disconnected", 3000.0)]
AND_BACK = [seat(0, "disconnected", 3000.0), seat(0, "connected", 5500.0)]


@pytest.fixture
def folder(tmp_path):
    """Give a folder of 19 games and of five other things."""
    folder = tmp_path / "games"
    # P1 at the usual table: 2 won, 1 drawn, 1 lost; once away, and back.
    write_game(folder, "01", "P1", "red", 40)
    write_game(folder, "02", "P1", "red", 60, commands=6)
    write_game(folder, "03", "P1", "draw", 300, lines=AND_BACK)
    write_game(folder, "04", "P1", "blue", 20)
    # At half the speed 1 won, with other sizes 1 lost.
    write_game(folder, "05", "P1", "red", 80, config=SLOW)
    write_game(folder, "06", "P1", "blue", 50, config=LARGE)
    # Odd labels, a game each.
    for number, label in enumerate(("[/p1]", "\x1b[31mred", "\t=1+1"), 7):
        write_game(folder, f"{number:02}", label, "red", 30)
    # What nobody played to its end, or not in earnest.
    write_game(folder, "10", "P1", "red", 10, lesson=True)
    write_game(folder, "11", "P1", "draw", 300, lesson=True, commands=0)
    write_game(folder, "12", "P1", "draw", 300, lines=GONE, ended_by="left")
    write_game(folder, "13", "P1", "blue", 90, lines=GONE, ended_by="left")
    write_game(folder, "14", "P1", "stopped", 5, lines=GONE, ended_by="left")
    write_game(folder, "15", "P1", "stopped", 7)
    write_game(folder, "16", "P1", "blue", 15, commands=0)
    write_game(folder, "17", "P1", None, 0)
    write_game(folder, "18", "P1", "red", 30, origin=Origin(recording="01.jsonl", tick=0, lines=0))
    write_game(folder, "19", "P1", "stopped", 30, blue=RecordedSeat(kind="free"), lines=[])
    # And what is no game.
    write_game(folder, "20", "P1", "red", 30, lines=[captured(20, 0, 9)])
    (folder / "21.jsonl").write_bytes((folder / "01.jsonl").read_bytes().replace(b'"red"', b'"blue"', 2))
    (folder / "22.jsonl").symlink_to(folder / "01.jsonl")
    os.mkfifo(folder / "23.jsonl")
    (folder / "24.jsonl").mkdir()
    return folder


def result(rows):
    return {
        (row.player, row.config_hash): (row.games, row.wins, row.draws, row.losses)
        for row in rows
        if row.kind == "person"
    }


def test_the_table_of_a_folder_is_that_of_a_careful_hand_count(folder):
    rows, faults = read_folder(folder)
    assert len({row.recording for row in rows}) == 19 and len(rows) == 37
    assert [f"{number}.jsonl" in fault for number, fault in enumerate(faults, 20)] == [True] * 5
    odd = {(label, FAIR.hash): (1, 1, 0, 0) for label in ("[/p1]", "\x1b[31mred", "\t=1+1")}
    others = {("P1", SLOW.hash): (1, 1, 0, 0), ("P1", LARGE.hash): (1, 0, 0, 1)}
    assert result(summarise(rows)) == {("P1", FAIR.hash): (4, 2, 1, 1), **others, **odd}
    # With the lessons (1 won, 1 drawn), two of three that were left (1 drawn, 1 lost) and one without a command (lost).
    assert result(summarise(rows, every_game=True)) == {("P1", FAIR.hash): (9, 3, 3, 3), **others, **odd}
    missing = {"lesson": 2, "left": 3, "stopped": 1, "no command": 1, "unfinished": 1, "taken over": 1}
    assert left_out(rows) == {**missing, "no opponent": 1}
    assert left_out(rows, every_game=True) == {
        "left": 1,
        "no opponent": 1,
        "stopped": 1,
        "taken over": 1,
        "unfinished": 1,
    }
    ring = [row for row in summarise(rows) if row.kind == "policy" and row.opponent == "P1"]
    assert sorted((row.games, row.wins, row.draws, row.losses) for row in ring) == [
        (1, 0, 0, 1),
        (1, 1, 0, 0),
        (4, 1, 1, 2),
    ]
    (usual,) = [row for row in summarise(rows) if (row.player, row.config_hash) == ("P1", FAIR.hash)]
    assert (usual.rules, usual.median_s) == ("paper", 40.0)
    assert usual.restricted_mean_s == pytest.approx((20 + 40 + 60 + 300) / 4)
    by_name = {row.recording: row for row in rows if row.side == "red"}
    assert by_name["03.jsonl"].away_s == 2.5 and by_name["03.jsonl"].ended_by == "time"
    assert by_name["13.jsonl"].away_s == 87.0 and by_name["13.jsonl"].ended_by == "left"
    assert by_name["02.jsonl"].commands == 6 and by_name["11.jsonl"].lesson and not by_name["17.jsonl"].ended_by


def test_a_game_of_two_equals_is_one_game(tmp_path):
    """Red won 2, blue 1, and 1 is drawn: counted by seats there would be 8 games, 3 of them won."""
    folder, nobody = tmp_path / "games", RecordedSeat(kind="person")
    for name, outcome, seconds, commands in (("1", "red", 60, 2), ("2", "red", 120, 1), ("3", "blue", 30, 1)):
        write_game(folder, name, "", outcome, seconds, blue=nobody, commands=commands)
    write_game(folder, "4", "", "draw", 300, blue=nobody)
    # People who have labels are told apart, and each has a row of the same game.
    write_game(folder, "5", "P1", "red", 40, blue=RecordedSeat(kind="person", label="P2"))
    write_game(folder, "6", "P1", "blue", 50, blue=RecordedSeat(kind="person", label="P2"))
    write_game(folder, "7", "P1", "red", 50, blue=RecordedSeat(kind="person", label="P1"))
    rows = summarise(read_folder(folder)[0])
    counted = {(row.player, row.opponent): (row.games, row.wins, row.draws, row.losses, row.both_seats) for row in rows}
    assert counted == {
        ("", ""): (4, 2, 1, 1, True),
        ("P1", "P2"): (2, 1, 0, 1, False),
        ("P2", "P1"): (2, 1, 0, 1, False),
        ("P1", "P1"): (1, 1, 0, 0, True),
    }
    (equals,) = [row for row in rows if not row.player]
    assert (equals.win_rate, equals.win_rate_low, equals.win_rate_high) == (0.5, *wilson(2, 4))
    assert equals.median_s == 60.0 and equals.restricted_mean_s == pytest.approx((60 + 120 + 30 + 300) / 4)
    # Red gave 2, 0.5, 2 and 0.2 commands a minute, blue 1, 0.5, 2 and 0.2.
    assert equals.commands_per_minute == pytest.approx((2 + 0.5 + 2 + 0.2 + 1 + 0.5 + 2 + 0.2) / 8)


def test_odd_labels_reach_neither_the_terminal_nor_a_spreadsheet(folder, tmp_path, capsys):
    main(["study", "tables", str(folder), "--out", str(tmp_path / "tables")])
    said = capsys.readouterr()
    assert "[/p1]" in said.out and "\\x1b[31mred" in said.out and "\\t=1+1" in said.out
    assert not {sign for sign in said.out + said.err if not sign.isprintable()} - {"\n"}
    assert "games that the summary leaves out: 3 left, 2 lesson, 1 no command" in said.out and "--all" in said.out
    assert FAIR.hash[:6] in said.out and SLOW.hash[:6] in said.out
    schema = json.loads((tmp_path / "tables" / "schema.json").read_text())
    assert schema["left_out"]["lesson"] == 2 and schema["every_game"] is False
    table = (tmp_path / "tables" / "summary.csv").read_bytes().decode()
    assert "'\t=1+1" in table
    main(["study", "tables", str(folder), "--out", str(tmp_path / "tables"), "--all"])
    said = capsys.readouterr().out
    assert "3-3-3" in said and "lesson" not in said
    assert json.loads((tmp_path / "tables" / "schema.json").read_text())["every_game"] is True


def test_games_whose_rules_are_nonsense_are_left_out_and_a_name_that_is_no_text_is_written_as_one(tmp_path):
    record(tmp_path / "a.jsonl", ticks=3)
    first, *rest = plain_lines(tmp_path / "a.jsonl")
    deep = []
    for _ in range(600):
        deep = [deep]
    for name, nonsense in (("b", {}), ("c", deep)):
        write_chained(tmp_path / f"{name}.jsonl", [first | {"table": first["table"] | {"mapping": nonsense}}, *rest])
    (tmp_path / "a.jsonl").rename(tmp_path / "\udcff.jsonl")
    rows, faults = read_folder(tmp_path)
    assert len(faults) == 2 and all("not known here" in fault for fault in faults)
    seats, *_ = write_tables(rows, tmp_path / "out")
    assert "\\udcff.jsonl" in seats.read_text()
