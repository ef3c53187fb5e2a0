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
from swarm_pz.errors import RecordingError
from swarm_pz.play.factors import Factors
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import (
    SIDES,
    CapturedMessage,
    EndMessage,
    InForceMessage,
    RecordedSeat,
    SeatCommand,
    SeatMessage,
    Timing,
)
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.recordings.tables import read_folder, write_tables
from tests.play.recordings.games import BEGAN_MS, record
from tests.play.recordings.games import header as header_of

CONFIG = TableConfig(
    game=GameConfig(drones_per_team=(5, 3), time_limit=60.0),
    min_command_interval=0.25,
    mapping="paper",
    speed=2.0,
    factors=(Factors(command_delay_ms=300.0, hide=("opponents", "trails")), Factors(share=0.5, helper="ring")),
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
    """Return the times of a command that was made `before_ms` before it was sent."""
    return Timing(input_ms=100.0, sent_ms=100.0 + before_ms, round_trip_ms=round_trip_ms, drawing_ms=drawing_ms)


PLAYED = [  # at twice the speed
    seat(0, "connected", 0.0),
    seat(0, "hidden", 1000.0),
    command(0, 1, 60, 2000.0, timing(30.0, 20.0, 400.0)),  # made at 1960, drawn from 1560 on
    in_force(0, 1, 60, 2050.0),
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
    command(0, 2, 210, 5000.0, timing(0.0, 10.0, 0.0)),  # made at 4995, and not drawn
    in_force(0, 2, 210, 5100.0),
    command(0, 3, 240, 6000.0, timing(0.0, 0.0, 800.0)),
    in_force(0, 3, 240, 6300.0),
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
    both |= {"display_delay_ms": 0.0, "frame_rate": 30}
    red = {"side": "red", "kind": "person", "player": "P1", "opponent_kind": "policy", "opponent": "ring"}
    red |= {"start_size": 5, "command_delay_ms": 300.0, "hide": "opponents+trails", "share": 0.0, "helper": ""}
    red |= {"outcome": "loss", "final_share": 0.5, "commands": 4, "commands_per_minute": 12.0, "first_command_s": 2.0}
    # The median of 90, 105 and 300 ms from an input to its command in force.
    red |= {"drawing_s_per_command": pytest.approx(0.6), "input_to_in_force_ms": pytest.approx(105.0)}
    red |= {"disconnections": 1, "away_s": pytest.approx(0.75), "hidden_s": pytest.approx(1.75)}
    blue = {"side": "blue", "kind": "policy", "player": "ring", "opponent_kind": "person", "opponent": "P1"}
    blue |= {"start_size": 3, "command_delay_ms": 0.0, "hide": "", "share": 0.5, "helper": "ring"}
    blue |= {"outcome": "win", "final_share": 0.5, "commands": 1, "commands_per_minute": 3.0}
    blue |= {"first_command_s": pytest.approx(5.2), "drawing_s_per_command": None, "input_to_in_force_ms": None}
    blue |= {"disconnections": 2, "away_s": pytest.approx(5.7), "hidden_s": pytest.approx(2.0)}
    assert [asdict(row) for row in seat_rows(recording)] == [both | red, both | blue]


def test_a_table_holds_every_row_and_no_spreadsheet_takes_a_label_for_a_formula(tmp_path):
    base = replace(seat_rows(Recording("a.jsonl", header(), PLAYED))[0], left_out="")
    labels = ["=1+1", "+1", "-1", "@sum", "\t=1+1", "\r=1", "P1"]
    rows = [replace(base, player=label, outcome="win", final_share=1 / 3) for label in labels]
    seats, schema = write_tables(rows, tmp_path / "deep" / "er", command="swarm-pz study")
    sidecar = json.loads(schema.read_text())
    assert sidecar["command"] == "swarm-pz study" and set(sidecar["versions"]) >= {"swarm-pz", "python"}
    read = list(csv.DictReader(io.StringIO(seats.read_bytes().decode(), newline="")))
    assert list(read[0]) == list(sidecar["columns"])
    assert [row["player"] for row in read] == ["'=1+1", "'+1", "'-1", "'@sum", "'\t=1+1", "'\r=1", "P1"]
    for name, text in read[-1].items():
        value = getattr(rows[-1], name)
        if isinstance(value, float):
            assert float(text) == pytest.approx(value, abs=1e-6), name
        else:
            assert text == ("" if value is None else json.dumps(value).strip('"')), name


AWAY = [seat(0, "disconnected", 3000.0)]


@pytest.mark.parametrize(
    ("reason", "outcome", "ended_by", "more"),
    [
        ("", "red", "capture", {}),
        ("", "draw", "time", {"lines": [*AWAY, seat(0, "connected", 5500.0)]}),
        ("lesson", "red", "capture", {"lesson": True}),
        ("lesson", "draw", "time", {"lesson": True, "commands": 0}),
        ("left", "blue", "left", {"lines": AWAY}),
        ("left", "stopped", "left", {"lines": AWAY}),
        ("stopped", "stopped", "server", {}),
        ("forfeit", "blue", "forfeit", {}),
        ("no command", "blue", "capture", {"commands": 0}),
        ("unfinished", None, None, {}),
        ("no opponent", "stopped", "server", {"blue": RecordedSeat(kind="free")}),
    ],
)
def test_a_row_says_why_its_game_should_not_count(reason, outcome, ended_by, more):
    log = [command(0, 1, 0, 0.0)] * more.pop("commands", 1) + more.pop("lines", [])
    log += [EndMessage(outcome, 900, (1, 1), BEGAN_MS + 30_000.0, ended_by)] if outcome is not None else []
    assert {row.left_out for row in seat_rows(Recording("a.jsonl", header(**more), log))} == {reason}


def test_a_folder_is_read_in_order_and_what_is_no_game_is_said(tmp_path, capsys):
    for name in ("3", "1"):
        record(tmp_path / f"{name}.jsonl", ticks=3, outcome="red")
    record(tmp_path / "2.jsonl", ticks=3, outcome="red")
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
    printed = capsys.readouterr()
    assert "seats.csv" in printed.out and "5.jsonl" in printed.err
    assert "\\udcff.jsonl" in (tmp_path / "tables" / "seats.csv").read_text()
