"""Tables of recorded games, computed by hand from a few lines."""

import csv
import io
import json
import os
from dataclasses import asdict, replace

import msgspec
import pyarrow.parquet
import pytest

from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.errors import RecordingError
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import (
    SIDES,
    CapturedMessage,
    EndMessage,
    InForceMessage,
    RecordedSeat,
    SeatCommand,
    SeatMessage,
    SeatPainted,
    Timing,
)
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.seats import seat_rows, trial_rows
from swarm_pz.play.recordings.tables import left_out, read_folder, summarise, write_tables
from tests.play.recordings.games import BEGAN_MS, plain_lines, record, write_lines
from tests.play.recordings.games import header as header_of

CONFIG = TableConfig(
    game=GameConfig(drones_per_team=(5, 3), time_limit=60.0), min_command_interval=0.25, mapping="paper", speed=2.0
)


def header(config=CONFIG, **more):
    return msgspec.structs.replace(header_of(config, 1, "ring"), **more)


def command(team, number, tick, ms, timing=None):
    return SeatCommand(number, None, [], None, timing, seat=SIDES[team], tick=tick, server_ms=BEGAN_MS + ms)


def in_force(team, number, tick, ms):
    return InForceMessage(SIDES[team], number, tick, BEGAN_MS + ms)


def captured(drone, team, tick):
    return CapturedMessage(SIDES[team], tick, drone)


def seat(team, event, ms):
    return SeatMessage(SIDES[team], event, BEGAN_MS + ms)


def timing(before_ms, round_trip_ms, drawing_ms):
    """Tell that a command was made so long before it was sent."""
    return Timing(input_ms=100.0, sent_ms=100.0 + before_ms, round_trip_ms=round_trip_ms, drawing_ms=drawing_ms)


PLAYED = [  # at twice the speed
    seat(0, "connected", 0.0),
    seat(0, "hidden", 1000.0),
    command(0, 1, 60, 2000.0, timing(30.0, 20.0, 400.0)),  # made at 1960, drawn from 1560 on
    in_force(0, 1, 60, 2050.0),
    SeatPainted(1, BEGAN_MS + 2100.0, "red"),
    captured(1, 1, 105),  # at 1750
    captured(7, 0, 105),
    seat(0, "shown", 2500.0),
    captured(2, 1, 150),  # at 2500
    command(1, 1, 156, 3000.0),
    in_force(1, 1, 156, 3050.0),
    seat(1, "disconnected", 3100.0),
    seat(1, "connected", 3200.0),
    seat(1, "displaced", 3300.0),
    seat(1, "disconnected", 3400.0),
    command(0, 1, 180, 4000.0),  # the page was reloaded, and tells no times
    in_force(0, 1, 180, 4050.0),
    SeatPainted(1, BEGAN_MS + 4100.0, "red"),
    command(0, 2, 210, 5000.0, timing(0.0, 10.0, 0.0)),  # made at 4995, and not drawn
    in_force(0, 2, 210, 5100.0),
    SeatPainted(2, BEGAN_MS + 5205.0, "red"),
    command(0, 3, 240, 6000.0, timing(0.0, 0.0, 800.0)),
    in_force(0, 3, 240, 6300.0),
    SeatPainted(3, BEGAN_MS + 6020.0, "red"),
    seat(1, "hidden", 7000.0),
    seat(0, "hidden", 8000.0),
    seat(0, "disconnected", 8250.0),
    EndMessage("blue", 600, (3, 5), BEGAN_MS + 9000.0, "left"),
]


def test_a_row_holds_what_its_seat_did():
    recording = Recording("a.jsonl", header(), PLAYED)
    both = {"recording": "a.jsonl", "started": "2026-01-01T00:00:00.000+00:00", "rules": "", "mapping": "paper"}
    both |= {"config_hash": CONFIG.hash, "rules_hash": CONFIG.game.rules_hash, "lesson": False, "ended_by": "left"}
    both |= {"left_out": "left", "min_command_interval": 0.25, "speed": 2.0, "drones": 8}
    both |= {"time_limit": 60.0, "seconds": 20.0, "system": "ergodic", "opponent_system": "ergodic"}
    both |= {"automatic_commands": 0}
    red = both | {
        "side": "red",
        "kind": "person",
        "player": "P1",
        "opponent_kind": "policy",
        "opponent": "ring",
        "start_size": 5,
        "outcome": "loss",
        "final_share": 0.5,
        "commands": 4,
        "commands_per_minute": 12.0,
        "first_command_s": 2.0,
        "drawing_s_per_command": pytest.approx(0.6),
        "lost_while_drawing": 1,
        "input_to_in_force_ms": pytest.approx(105.0),  # of 90, 105 and 300
        "input_to_painted_ms": pytest.approx(140.0),  # of 140, 210 and 20
        "disconnections": 1,
        "away_s": pytest.approx(0.75),
        "hidden_s": pytest.approx(1.75),
    }
    blue = both | {
        "side": "blue",
        "kind": "policy",
        "player": "ring",
        "opponent_kind": "person",
        "opponent": "P1",
        "start_size": 3,
        "outcome": "win",
        "final_share": 0.5,
        "commands": 1,
        "commands_per_minute": 3.0,
        "first_command_s": pytest.approx(5.2),
        "drawing_s_per_command": None,
        "lost_while_drawing": 0,
        "input_to_in_force_ms": None,
        "input_to_painted_ms": None,
        "disconnections": 2,
        "away_s": pytest.approx(5.7),
        "hidden_s": pytest.approx(2.0),
    }
    assert [asdict(row) for row in seat_rows(recording)] == [red, blue]
    counts = {"captured": 1, "lost": 2, "seed": 1}, {"captured": 2, "lost": 1, "seed": 1}
    assert trial_rows(recording) == [red | counts[0], blue | counts[1]], "as experiments keep them"


@pytest.mark.parametrize(("speed", "lost"), [(0.5, 2), (2.0, 0)])
def test_drones_are_lost_while_drawing_by_the_tables_clock_which_its_speed_sets(speed, lost):
    drawn = command(0, 1, 0, 5000.0, Timing(input_ms=0.0, sent_ms=0.0, drawing_ms=1000.0))  # from 4 to 5 s on
    lines = [drawn, *(captured(drone, 1, tick) for drone, tick in enumerate((61, 74, 134, 151))), captured(7, 0, 151)]
    red, blue = seat_rows(Recording("a.jsonl", header(CONFIG.replace(speed=speed)), lines))
    assert (red.lost_while_drawing, blue.lost_while_drawing) == (lost, 0)


PERSON, POLICY, PROGRAM, FREE = (RecordedSeat(kind=kind) for kind in ("person", "policy", "program", "free"))
GONE, BACK = seat(0, "disconnected", 5.0), seat(0, "connected", 6.0)


@pytest.mark.parametrize("parquet", [False, True])
def test_tables_hold_every_row_and_no_spreadsheet_takes_a_label_for_a_formula(parquet, tmp_path):
    base = replace(seat_rows(Recording("a.jsonl", header(), PLAYED))[0], left_out="")
    labels = ["=1+1", "+1", "-1", "@sum", "\t=1+1", "\r=1", "P1"]
    rows = [replace(base, player=label, outcome="win", final_share=1 / 3) for label in labels]
    seats, summary, schema = write_tables(rows, tmp_path / "deep" / "er", parquet=parquet, command="swarm-pz study")
    suffix = "parquet" if parquet else "csv"
    assert [path.name for path in (seats, summary, schema)] == [f"seats.{suffix}", f"summary.{suffix}", "schema.json"]
    told = json.loads(schema.read_text())
    assert told["command"] == "swarm-pz study" and set(told["versions"]) >= {"swarm-pz", "python"}
    for path, expected in ((seats, rows), (summary, summarise(rows))):
        if parquet:
            assert pyarrow.parquet.read_table(path).to_pylist() == [asdict(row) for row in expected]
            continue
        read = list(csv.DictReader(io.StringIO(path.read_bytes().decode(), newline="")))
        assert list(read[0]) == list(told["tables"][path.stem])
        assert {row["player"] for row in read} == {"'=1+1", "'+1", "'-1", "'@sum", "'\t=1+1", "'\r=1", "P1"}
        for name, text in read[-1].items():
            value = getattr(expected[-1], name)
            if isinstance(value, float):
                assert float(text) == pytest.approx(value, abs=1e-6), name
            elif name != "player":
                assert text == ("" if value is None else json.dumps(value).strip('"')), name


# --- games counted by hand ------------------------------------------------------------------------

FAIR, SLOW, LARGE = TableConfig(), TableConfig(speed=0.5), TableConfig(game=GameConfig(drones_per_team=(12, 5)))
ENDED_BY = {"red": "capture", "blue": "capture", "draw": "time", "stopped": "server"}
AWAY = [seat(0, "disconnected", 3000.0)]


def game(label, outcome, seconds, *, config=FAIR, commands=1, lines=(), ended_by=None, **more):
    """Return the rows of a game of a person against ring; what it shows does not matter."""
    given = [command(0, number + 1, 0, 100.0 * number) for number in range(commands)]
    events = [seat(0, "connected", 0.0), *given, command(1, 1, 0, 50.0), *lines]
    if outcome is not None:
        told, ms = ended_by or ENDED_BY[outcome], 1000.0 * seconds
        events.append(EndMessage(outcome, 30 * seconds, (1, 1), BEGAN_MS + ms, told))
    told = header(config, red=RecordedSeat(kind="person", label=label), **more)
    return seat_rows(Recording("a.jsonl", told, events))


def counts(row):
    return row.games, row.wins, row.draws, row.losses


def test_the_summary_is_that_of_a_careful_hand_count():
    games = [
        # P1 at the usual table: 2 won, 1 drawn, 1 lost; once away, and back.
        game("P1", "red", 40),
        game("P1", "red", 60, commands=6),
        game("P1", "draw", 30, lines=[*AWAY, seat(0, "connected", 5500.0)]),
        game("P1", "blue", 20),
        # At half the speed 1 won, with other sizes 1 lost.
        game("P1", "red", 80, config=SLOW),
        game("P1", "blue", 50, config=LARGE),
        # What nobody played to its end, or not in earnest.
        game("P1", "red", 10, lesson=True),
        game("P1", "draw", 300, lesson=True, commands=0),
        game("P1", "draw", 300, lines=AWAY, ended_by="left"),
        game("P1", "blue", 90, lines=AWAY, ended_by="left"),
        game("P1", "stopped", 5, lines=AWAY, ended_by="left"),
        game("P1", "stopped", 7),
        game("P1", "blue", 15, commands=0),
        game("P1", None, 0),
        game("P1", "stopped", 30, blue=FREE),
    ]
    rows = [replace(row, recording=f"{number}.jsonl") for number, seats in enumerate(games) for row in seats]

    def result(**how):
        return {row.config_hash: counts(row) for row in summarise(rows, **how) if row.kind == "person"}

    others = {SLOW.hash: (1, 1, 0, 0), LARGE.hash: (1, 0, 0, 1)}
    assert result() == {FAIR.hash: (4, 2, 1, 1), **others}
    # With the lessons (1 won, 1 drawn), two of three that were left (1 drawn, 1 lost) and one without a command (lost).
    assert result(every_game=True) == {FAIR.hash: (9, 3, 3, 3), **others}
    nobody = {"stopped": 1, "unfinished": 1, "no opponent": 1}
    assert left_out(rows) == nobody | {"lesson": 2, "left": 3, "no command": 1}
    assert left_out(rows, every_game=True) == nobody | {"left": 1}
    ring = [row for row in summarise(rows) if row.kind == "policy"]
    assert sorted(map(counts, ring)) == [(1, 0, 0, 1), (1, 1, 0, 0), (4, 1, 1, 2)]
    (usual,) = [row for row in summarise(rows) if (row.kind, row.config_hash) == ("person", FAIR.hash)]
    assert (usual.rules, usual.median_s, usual.win_rate) == ("paper", 40.0, 0.5)
    assert usual.restricted_mean_s == pytest.approx(20 + 20 * 3 / 4 + 20 * 3 / 8), "a draw would have lasted longer"
    assert (usual.win_rate_low, usual.win_rate_high) == wilson(2, 4)
    assert games[2][0].away_s == 2.5 and games[9][0].away_s == 87.0


def test_a_game_of_two_equals_is_one_game():
    """Red won 2, blue 1, and 1 is drawn: counted by seats there would be 8 games, 3 of them won."""
    equals = [("red", 60, 2), ("red", 120, 1), ("blue", 30, 1), ("draw", 300, 1)]
    games = [game("", outcome, seconds, blue=PERSON, commands=count) for outcome, seconds, count in equals]
    # People who have labels are told apart, and each has a row of the same game.
    for outcome, label in (("red", "P2"), ("blue", "P2"), ("red", "P1")):
        games.append(game("P1", outcome, 40, blue=RecordedSeat(kind="person", label=label)))
    rows = summarise([row for rows in games for row in rows])
    assert {(row.player, row.opponent): (*counts(row), row.both_seats) for row in rows} == {
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


def test_a_folder_is_read_in_order_and_what_is_no_game_is_said(tmp_path, capsys):
    for name in ("3", "1"):
        record(tmp_path / f"{name}.jsonl", ticks=3, outcome="red")
    first, *rest = plain_lines(tmp_path / "1.jsonl")
    odd = {"lesson": True, "red": {"kind": "person", "label": "[/p1]\x1b[31m"}}
    write_lines(tmp_path / "2.jsonl", [first | odd, *rest])
    (tmp_path / "4.jsonl").symlink_to(tmp_path / "1.jsonl")
    os.mkfifo(tmp_path / "5.jsonl")
    (tmp_path / "6.jsonl").mkdir()
    (tmp_path / "notes.txt").write_text("not a game")
    (tmp_path / "3.jsonl").rename(tmp_path / "\udcff.jsonl")
    rows, faults = read_folder(tmp_path)
    assert [row.recording for row in rows[::2]] == ["1.jsonl", "2.jsonl", "\\udcff.jsonl"] and len(rows) == 6
    assert [f"{number}.jsonl" in fault for number, fault in enumerate(faults, 4)] == [True] * 3
    with pytest.raises(RecordingError, match="no recorded games"):
        read_folder(tmp_path / "6.jsonl")
    main(["study", "tables", str(tmp_path), "--out", str(tmp_path / "tables")])
    said = capsys.readouterr().out
    assert "1 lesson" in said and "--all" in said and "2-0-0" in said and "/p1" not in said
    main(["study", "tables", str(tmp_path), "--out", str(tmp_path / "tables"), "--all"])
    said = capsys.readouterr()
    assert "[/p1]\\x1b[31m" in said.out and "lesson" not in said.out
    assert not {sign for sign in said.out + said.err if not sign.isprintable()} - {"\n"}, "labels reach no terminal"
    assert "\\udcff.jsonl" in (tmp_path / "tables" / "seats.csv").read_text()
    assert json.loads((tmp_path / "tables" / "schema.json").read_text())["every_game"] is True
