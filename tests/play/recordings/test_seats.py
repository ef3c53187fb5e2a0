"""A recorded game as rows, computed by hand from a few lines."""

from dataclasses import asdict

import pytest

from swarm_pz.play.recordings.format import EndLine, Origin, RecordedSeat, Recording
from swarm_pz.play.recordings.seats import seat_rows
from tests.play.recordings.test_study import CONFIG, PAST, TAKEN_OVER, command, header, seat


def test_a_row_holds_what_its_seat_did_since_it_was_taken_over():
    origin = Origin(recording="before.jsonl", tick=300, lines=len(PAST))
    rows = seat_rows(Recording("a.jsonl", header(origin=origin), PAST + TAKEN_OVER))
    both = {
        "recording": "a.jsonl",
        "started": "2026-01-01T00:00:00.000+00:00",
        "config_hash": CONFIG.hash,
        "rules_hash": CONFIG.game.rules_hash,
        "rules": "",
        "lesson": False,
        "ended_by": "left",
        "left_out": "taken over",
        "mapping": "paper",
        "min_command_interval": 0.25,
        "speed": 2.0,
        "time_limit": 60.0,
        "taken_over": True,
        "drones": 8,
        "seconds": 30.0,
        "system": "ergodic",
        "opponent_system": "ergodic",
        "automatic_commands": 0,
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
        "final_share": 5 / 8,
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
    assert [asdict(row) for row in rows] == [red, blue]


@pytest.mark.parametrize(
    ("end", "seconds", "outcomes"),
    [
        ([], 18.0, ["stopped", "stopped"]),
        ([EndLine(outcome="stopped", tick=600, sizes=(3, 5), ms=0.0, ended_by="server")], 20.0, ["stopped", "stopped"]),
        ([EndLine(outcome="draw", tick=600, sizes=(3, 5), ms=0.0, ended_by="time")], 20.0, ["draw", "draw"]),
        ([EndLine(outcome="red", tick=600, sizes=(8, 0), ms=0.0, ended_by="capture")], 20.0, ["win", "loss"]),
    ],
)
def test_a_game_lasts_to_its_end_or_as_far_as_it_is_known(end, seconds, outcomes):
    rows = seat_rows(Recording("a.jsonl", header(), TAKEN_OVER[:-1] + end))
    assert [row.outcome for row in rows] == outcomes
    assert {row.seconds for row in rows} == {seconds} and not any(row.taken_over for row in rows)


def test_a_seat_that_nobody_took_has_no_row():
    (row,) = seat_rows(Recording("a.jsonl", header(blue=RecordedSeat(kind="free")), TAKEN_OVER))
    assert (row.side, row.opponent_kind, row.opponent) == ("red", "free", "")


PERSON, POLICY, PROGRAM = (RecordedSeat(kind=kind) for kind in ("person", "policy", "program"))
ASKED = [command(0, 1, 0, 1.0), command(1, 1, 0, 1.0)]
GONE, BACK = seat(0, "disconnected", 5.0), seat(0, "connected", 6.0)


def end(outcome, ended_by):
    return EndLine(outcome=outcome, tick=900, sizes=(3, 5), ms=9000.0, ended_by=ended_by)


@pytest.mark.parametrize(
    ("events", "more", "ended_by", "left_out"),
    [
        ([*ASKED, end("red", "capture")], {}, "capture", ""),
        ([*ASKED, end("draw", "time")], {}, "time", ""),
        ([*ASKED, GONE, BACK, end("draw", "time")], {}, "time", ""),
        (ASKED, {}, "", "unfinished"),
        ([*ASKED, end("stopped", "server")], {}, "server", "stopped"),
        ([*ASKED, GONE, end("red", "left")], {}, "left", "left"),
        ([*ASKED, end("red", "capture")], {"lesson": True}, "capture", "lesson"),
        ([ASKED[1], end("blue", "capture")], {}, "capture", "no command"),
        ([ASKED[1], end("blue", "capture")], {"red": PROGRAM}, "capture", ""),
        ([ASKED[0], end("red", "capture")], {"blue": PERSON}, "capture", "no command"),
        ([end("draw", "time")], {"red": POLICY}, "time", ""),
        ([*ASKED, end("red", "capture")], {"origin": Origin(recording="b", tick=0, lines=0)}, "capture", "taken over"),
        ([ASKED[0], end("draw", "time")], {"blue": RecordedSeat(kind="free")}, "time", "no opponent"),
    ],
)
def test_a_game_counts_if_it_was_played_to_its_end_by_who_sat_there(events, more, ended_by, left_out):
    rows = seat_rows(Recording("a.jsonl", header(**more), events))
    assert {(row.ended_by, row.left_out) for row in rows} == {(ended_by, left_out)}
