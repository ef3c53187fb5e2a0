"""Tables of recorded games, computed by hand from a few lines."""

import csv
import json
from dataclasses import asdict, replace

import pytest

from swarm_pz.config import GameConfig
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
from swarm_pz.play.recordings.study import read_folder, seat_rows, summarise, write_tables

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


def command(team, number, received_ms, timing=None):
    return CommandLine(team=team, number=number, density=[], received_ms=received_ms, timing=timing)


def in_force(team, number, tick, ms):
    return InForceLine(team=team, number=number, tick=tick, ms=ms)


def captured(drone, team, tick):
    return CapturedLine(tick=tick, drone=drone, team=team)


def seat(team, event, ms):
    return SeatLine(team=team, event=event, ms=ms)


def timing(before_ms, round_trip_ms, drawing_ms):
    """Tell that a command was made so long before it was sent."""
    return Timing(input_ms=100.0, sent_ms=100.0 + before_ms, round_trip_ms=round_trip_ms, drawing_ms=drawing_ms)


PAST = [command(0, 1, 40.0, timing(30.0, 20.0, 900.0)), in_force(0, 1, 3, 100.0), captured(0, 1, 150)]
TAKEN_OVER = [  # from tick 300 on, at twice the speed
    seat(0, "connected", 0.0),
    seat(0, "hidden", 1000.0),
    command(0, 1, 2000.0, timing(30.0, 20.0, 400.0)),  # made at 1960, drawn from 1560 on
    in_force(0, 1, 360, 2050.0),
    PaintedLine(team=0, number=1, ms=2100.0),
    captured(1, 1, 405),  # at 1750
    captured(7, 0, 405),
    seat(0, "shown", 2500.0),
    captured(2, 1, 450),  # at 2500
    command(1, 1, 3000.0),
    in_force(1, 1, 456, 3050.0),
    seat(1, "disconnected", 3100.0),
    seat(1, "connected", 3200.0),
    seat(1, "displaced", 3300.0),
    seat(1, "disconnected", 3400.0),
    command(0, 1, 4000.0),  # the page was reloaded, and tells no times
    in_force(0, 1, 480, 4050.0),
    PaintedLine(team=0, number=1, ms=4100.0),
    command(0, 2, 5000.0, timing(0.0, 10.0, 0.0)),  # made at 4995, and not drawn
    in_force(0, 2, 510, 5100.0),
    PaintedLine(team=0, number=2, ms=5205.0),
    command(0, 3, 6000.0, timing(0.0, 0.0, 800.0)),
    in_force(0, 3, 540, 6300.0),
    PaintedLine(team=0, number=3, ms=6020.0),
    seat(1, "hidden", 7000.0),
    seat(0, "hidden", 8000.0),
    seat(0, "disconnected", 8250.0),
    EndLine(outcome="blue", tick=900, sizes=(3, 5), ms=9000.0),
]


def test_a_row_holds_what_its_seat_did_since_it_was_taken_over():
    origin = Origin(recording="before.jsonl", tick=300, lines=len(PAST))
    rows = seat_rows(Recording("a.jsonl", header(origin=origin), PAST + TAKEN_OVER))
    both = {
        "recording": "a.jsonl",
        "started": "2026-01-01T00:00:00.000+00:00",
        "config_hash": CONFIG.hash,
        "rules_hash": CONFIG.game.rules_hash,
        "mapping": "paper",
        "min_command_interval": 0.25,
        "speed": 2.0,
        "time_limit": 60.0,
        "taken_over": True,
        "drones": 8,
        "seconds": 30.0,
    }
    red = both | {
        "side": "red",
        "kind": "person",
        "player": "P1",
        "opponent_kind": "policy",
        "opponent": "ring",
        "start_size": 5,
        "outcome": "loss",
        "final_share": 3 / 8,
        "commands": 4,
        "commands_per_minute": 12.0,
        "first_command_s": 2.0,
        "drawing_s_per_command": pytest.approx(0.6),
        "lost_while_drawing": 1,
        "input_to_in_force_ms": pytest.approx(105.0),  # of 90, 105 and 300
        "input_to_painted_ms": pytest.approx(140.0),  # of 140, 210 and 20
        "disconnections": 1,
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
        "final_share": 5 / 8,
        "commands": 1,
        "commands_per_minute": 3.0,
        "first_command_s": pytest.approx(5.2),
        "drawing_s_per_command": None,
        "lost_while_drawing": 0,
        "input_to_in_force_ms": None,
        "input_to_painted_ms": None,
        "disconnections": 2,
        "hidden_s": pytest.approx(2.0),
    }
    assert [asdict(row) for row in rows] == [red, blue]


@pytest.mark.parametrize(
    ("end", "seconds", "outcomes"),
    [
        ([], 18.0, ["stopped", "stopped"]),
        ([EndLine(outcome="stopped", tick=600, sizes=(3, 5), ms=0.0)], 20.0, ["stopped", "stopped"]),
        ([EndLine(outcome="draw", tick=600, sizes=(3, 5), ms=0.0)], 20.0, ["draw", "draw"]),
        ([EndLine(outcome="red", tick=600, sizes=(8, 0), ms=0.0)], 20.0, ["win", "loss"]),
    ],
)
def test_a_game_lasts_to_its_end_or_as_far_as_it_is_known(end, seconds, outcomes):
    rows = seat_rows(Recording("a.jsonl", header(), TAKEN_OVER[:-1] + end))
    assert [row.outcome for row in rows] == outcomes
    assert {row.seconds for row in rows} == {seconds} and not any(row.taken_over for row in rows)


def test_a_seat_that_nobody_took_has_no_row():
    (row,) = seat_rows(Recording("a.jsonl", header(blue=RecordedSeat(kind="free")), TAKEN_OVER))
    assert (row.side, row.opponent_kind, row.opponent) == ("red", "free", "")


def test_games_are_summed_up_by_who_played_whom_by_which_rules():
    base, _ = seat_rows(Recording("a.jsonl", header(), TAKEN_OVER))
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
            ("config_hash", "0" * 16),
        )
    ]
    rows = summarise([*left_out, *others, *games])
    assert [row.games for row in rows].count(1) == 5 and len(rows) == 6
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
    labels = ["=1+1", "+1", "-1", "@sum", "P1"]
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
        read = list(csv.DictReader(path.read_text().splitlines()))
        assert list(read[0]) == list(tables[path.stem])
        assert {row["player"] for row in read} == {"'=1+1", "'+1", "'-1", "'@sum", "P1"}
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
