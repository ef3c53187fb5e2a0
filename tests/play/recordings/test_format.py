"""Recorded games: written, read, damaged, played again, and turned into tables."""

import csv
import json
from dataclasses import replace

import imageio_ffmpeg
import msgspec
import numpy as np
import pytest

from swarm_pz.cli import main
from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import RecordingError, RenderError
from swarm_pz.play.frames import Frame, encode_frame
from swarm_pz.play.game import Captured, InForce, LiveGame, TableConfig
from swarm_pz.play.protocol import Timing
from swarm_pz.play.recordings.chain import START, chained
from swarm_pz.play.recordings.format import (
    VERSION,
    CapturedLine,
    CommandLine,
    EndLine,
    FrameLine,
    Header,
    InForceLine,
    Origin,
    PaintedLine,
    RecordedSeat,
    Recording,
    SeatLine,
    frame_line,
    reason_of_end,
)
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.recordings.study import read_folder, summarise, write_tables

CONFIG = TableConfig(game=GameConfig(drones_per_team=4, capture=CaptureConfig(threshold=0.5), time_limit=20.0))
MILD = CaptureConfig(threshold=0.9)


def header(config, seed, player):
    return Header(
        version=VERSION,
        software="test",
        started="2026-01-01T00:00:00.000+00:00",
        table=config.to_dict(),
        config_hash=config.hash,
        seed=seed,
        rules_hash=config.game.rules_hash,
        red=RecordedSeat(kind="person", label="P1"),
        blue=RecordedSeat(kind="policy", policy=player),
    )


def record(path, ticks=300, seed=1, outcome=None, player="ring", config=CONFIG):
    """Write a game in which red commands corners and blue's policy does nothing."""
    game = LiveGame(config, seed)
    recorder = Recorder(path, header(config, seed, player))
    recorder.write(frame_line(shown(game), 0))
    recorder.write(SeatLine(team=0, event="connected", ms=0.0))
    for tick in range(ticks):
        if tick % 60 == 0:
            density = np.zeros((10, 10))
            density[(tick // 60) % 10, 3] = 1.0
            ms = 1000 * tick / 30
            command = game.submit(0, tick // 60, density)
            timing = Timing(input_ms=5.0, sent_ms=6.0, round_trip_ms=2.0, drawing_ms=500.0)
            plain = command.values.tolist()
            recorder.write(
                CommandLine(team=0, number=tick // 60, density=plain, received_ms=ms, timing=timing, tick=tick)
            )
            recorder.write(PaintedLine(team=0, number=tick // 60, ms=ms + 48.0))
        for event in game.advance():
            if isinstance(event, InForce):
                recorder.write(InForceLine(team=0, number=event.command.number, tick=event.tick, ms=ms + 28.0))
            elif isinstance(event, Captured):
                recorder.write(CapturedLine(tick=event.tick, drone=event.drone, team=event.team))
        if game.tick % 3 == 0 or game.over:
            recorder.write(frame_line(shown(game), game.tick))
        if game.over:
            break
    recorder.write(SeatLine(team=0, event="hidden", ms=1000.0))
    recorder.write(SeatLine(team=0, event="shown", ms=3000.0))
    told = outcome or game.outcome or "stopped"
    end = EndLine(outcome=told, tick=game.tick, sizes=game.sizes, ms=1e4, ended_by=reason_of_end(told, away=False))
    recorder.write(end)
    recorder.close()
    return game


def shown(game):
    """Return a game's present frame."""
    simulator = game.simulator
    return encode_frame(
        Frame(
            sequence=0,
            tick=game.tick,
            server_ms=0.0,
            positions=simulator.positions[0],
            velocities=simulator.speeds[0],
            teams=simulator.teams[0],
        )
    )


def plain_lines(path):
    """Return a file's lines as objects, without their links."""
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    return [{name: value for name, value in line.items() if name != "chain"} for line in lines]


def write_chained(path, lines):
    """Write lines as a forger would who makes the chain anew."""
    link, text = START, b""
    for line in lines:
        written, link = chained(json.dumps(line, separators=(",", ":")).encode(), link)
        text += written + b"\n"
    path.write_bytes(text)


def test_a_recorded_game_is_simulated_to_any_moment(tmp_path):
    game = record(tmp_path / "a.jsonl", ticks=200)
    playback = Playback(Recording.read(tmp_path / "a.jsonl"))
    assert playback.verify().verified
    playback.seek(10_000)
    np.testing.assert_array_equal(playback.game.simulator.positions, game.simulator.positions)
    playback.seek(30)
    assert playback.game.tick == 30
    playback.seek(31)
    early = playback.game.simulator.positions.copy()
    playback.seek(150)
    playback.seek(31)
    np.testing.assert_array_equal(playback.game.simulator.positions, early)


def test_a_changed_recording_does_not_verify(tmp_path):
    record(tmp_path / "a.jsonl")
    first, *rest = plain_lines(tmp_path / "a.jsonl")
    other_rules = json.loads(json.dumps(first))
    other_rules["table"]["game"]["capture"]["threshold"] = 0.9
    for changed in (other_rules, first | {"rules_hash": GameConfig().rules_hash}):
        write_chained(tmp_path / "b.jsonl", [changed, *rest])
        with pytest.raises(RecordingError, match="hash"):
            Recording.read(tmp_path / "b.jsonl")


@pytest.mark.parametrize("end", ["win", "loss"])
def test_to_lose_ends_a_game_as_to_win_does_and_a_draw_says_only_that_it_would_have_lasted_longer(tmp_path, end):
    record(tmp_path / "a.jsonl", outcome="draw")
    rows, _ = read_folder(tmp_path)
    ends = [(end, 10.0), ("draw", 20.0), (end, 60.0)]
    (summary,) = summarise([replace(rows[0], outcome=outcome, seconds=seconds) for outcome, seconds in ends])
    assert summary.median_s == 60.0
    assert summary.restricted_mean_s == pytest.approx(10 + 50 * 2 / 3)
    assert (summary.wins, summary.draws, summary.losses) == ((2, 1, 0) if end == "win" else (0, 1, 2))


@pytest.mark.parametrize("tick", [0, 59, 60, 61])
def test_what_had_happened_before_a_moment_leads_to_it(tick, tmp_path):
    record(tmp_path / "a.jsonl")  # commands come into force at 0, 60, 120, ...
    recording = Recording.read(tmp_path / "a.jsonl")
    playback = Playback(recording)
    playback.seek(tick)
    kept = recording.until(tick)
    told = msgspec.structs.replace(recording.header, origin=Origin(recording="a.jsonl", tick=tick, lines=len(kept)))
    past = Recording("past.jsonl", told, kept)
    again = Playback(past)
    assert [when for when, _ in past.in_force()] == [when for when in (0, 60) if when < tick]
    again.seek(tick)
    assert again.game.tick <= tick and (tick == 0 or Playback(past).verify().verified)


def test_going_back_leads_where_going_on_led(tmp_path, monkeypatch):
    monkeypatch.setattr("swarm_pz.play.recordings.playback._MARK_TICKS", 30)
    game = record(tmp_path / "a.jsonl", config=CONFIG.replace(game=CONFIG.game.replace(capture=MILD)))
    playback = Playback(Recording.read(tmp_path / "a.jsonl"))
    moments = sorted({game.tick * tenth // 10 for tenth in range(11)} | {30, 31})  # however long the game was
    places = {}
    for tick in moments:
        playback.seek(tick)
        assert playback.game.tick == tick
        places[tick] = playback.game.simulator.snapshot()
    assert len(playback._marks) > 2
    for tick in (*reversed(moments), moments[5], moments[-1], moments[1]):
        playback.seek(tick)
        for array, then in zip(playback.game.simulator.games, places[tick], strict=True):
            np.testing.assert_array_equal(array, then)


def test_a_recording_that_breaks_off_is_read_up_to_there(tmp_path):
    record(tmp_path / "a.jsonl")
    whole = (tmp_path / "a.jsonl").read_bytes()
    for length in (len(whole) // 3, len(whole) // 2, len(whole) - 1):
        (tmp_path / "a.jsonl").write_bytes(whole[:length])
        broken = Recording.read(tmp_path / "a.jsonl")
        assert broken.end is None and Playback(broken).verify().verified


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: b"", "empty"),
        (lambda text: text[text.index(b"\n") + 1 :], "first line"),
        (lambda text: text + text, "first line"),
        (lambda text: text.replace(b'"version":2', b'"version":3', 1), "version 3, expected 2"),
        (lambda text: text.replace(b'"tick":3,', b'"tick":-3,'), "line"),
        (lambda text: b"\xff\xfe" + text, "line 1"),
        (lambda text: b'{"x":' + b"[" * 60_000 + b"\n" + text, "line 1"),
        (
            lambda text: text.replace(b'"team":0,"number":1,"density"', b'"team":0,"number":77,"density"'),
            r"line \d+ .* does not follow the line before it",
        ),
    ],
)
def test_what_is_no_recording_is_refused(change, message, tmp_path):
    record(tmp_path / "a.jsonl", ticks=90)
    (tmp_path / "a.jsonl").write_bytes(change((tmp_path / "a.jsonl").read_bytes()))
    with pytest.raises(RecordingError, match=message):
        Playback(Recording.read(tmp_path / "a.jsonl"))
    with pytest.raises(RecordingError, match="cannot be read"):
        Recording.read(tmp_path / "none.jsonl")


def picture(tick, drones=8):
    """Return a frame's bytes that show drones in a row."""
    x = np.arange(drones) / 10
    places, teams = np.stack([x, x], 1), (np.arange(drones) >= drones // 2).astype(np.int8)
    return encode_frame(
        Frame(sequence=0, tick=tick, server_ms=0.0, positions=places, velocities=0 * places, teams=teams)
    )


NONSENSE = CommandLine(team=1, number=4, density=[[2.0] * 10] * 10, received_ms=0.0, tick=0)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([CapturedLine(tick=1, drone=8, team=0)], "line 2 of a.jsonl: drone must be below 8"),
        ([NONSENSE, InForceLine(team=1, number=4, tick=0, ms=0.0)], "command 4 of team 1"),
        ([NONSENSE], "command 4 of team 1"),
        ([FrameLine(tick=3, data="abc")], "the frame at tick 3 is corrupt"),
        ([FrameLine(tick=3, data="AQID")], "the frame at tick 3 is corrupt"),
        ([frame_line(picture(6, drones=7), 6)], "the frame at tick 6 has another number of drones"),
    ],
)
def test_what_its_game_cannot_have_is_corrupt(lines, message):
    def read_all(lines):
        recording = Recording("a.jsonl", header(CONFIG, 1, "ring"), lines)
        return Playback(recording), list(recording.frames())

    read_all([CapturedLine(tick=1, drone=7, team=0), frame_line(picture(3), 3)])
    with pytest.raises(RecordingError, match=message):
        read_all(lines)


def test_rules_that_are_not_known_here_are_said_to_be(tmp_path):
    told = header(CONFIG, 1, "ring")
    told.table = told.table | {"weather": "fine"}
    with pytest.raises(RecordingError, match=r"rules that are not known here.*weather"):
        Recording("a.jsonl", told, [])


def test_what_a_later_version_adds_is_passed_over(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30)
    write_chained(tmp_path / "b.jsonl", [line | {"weather": "fine"} for line in plain_lines(tmp_path / "a.jsonl")])
    before, after = (Recording.read(tmp_path / name) for name in ("a.jsonl", "b.jsonl"))
    assert (after.header, after.events) == (before.header, before.events)


@pytest.mark.parametrize(
    "line",
    [
        FrameLine(tick=9, data=""),
        InForceLine(team=0, number=1, tick=9, ms=0.0),
        EndLine(outcome="draw", tick=9, sizes=(4, 4), ms=0.0, ended_by="time"),
    ],
)
def test_whatever_came_last_tells_how_long_a_game_was(line):
    assert Recording("a.jsonl", header(CONFIG, 1, "ring"), [FrameLine(tick=6, data=""), line]).last_tick == 9


def test_the_past_of_a_moment_is_what_the_game_itself_did_before_its_solve():
    blank = [[1.0] * 10] * 10
    seat, painted = SeatLine(team=0, event="connected", ms=0.0), PaintedLine(team=0, number=1, ms=9.0)
    first, second = (
        CommandLine(team=0, number=number, density=blank, received_ms=0.0, tick=6 * number - 6) for number in (1, 2)
    )
    begins, follows = (InForceLine(team=0, number=number, tick=6 * number - 6, ms=0.0) for number in (1, 2))
    taken, retaken = CapturedLine(tick=5, drone=1, team=1), CapturedLine(tick=6, drone=1, team=0)
    shown, after = FrameLine(tick=6, data=""), FrameLine(tick=9, data="")
    end = EndLine(outcome="draw", tick=9, sizes=(4, 4), ms=0.0, ended_by="time")
    events = [seat, first, begins, painted, taken, retaken, shown, second, follows, after, end]
    recording = Recording("a.jsonl", header(CONFIG, 1, "ring"), events)
    assert recording.until(0) == [first]
    assert recording.until(5) == [first, begins, taken]
    assert recording.until(6) == [first, begins, taken, retaken, shown, second]
    assert recording.until(9) == [first, begins, taken, retaken, shown, second, follows, after]
    second.tick = 7  # it arrived after the moment, and waits for the next solve
    assert recording.until(6) == [first, begins, taken, retaken, shown]


def test_a_client_that_counts_from_the_start_again_is_followed_in_order():
    corners = [np.eye(1, 100, place).reshape(10, 10).tolist() for place in range(4)]
    lines = []
    for place, (team, number) in enumerate([(0, 1), (1, 1), (0, 1), (1, 2)]):
        lines.append(CommandLine(team=team, number=number, density=corners[place], received_ms=0.0, tick=30 * place))
        lines.append(InForceLine(team=team, number=number, tick=30 * place, ms=0.0))
    followed = Recording("a.jsonl", header(CONFIG, 1, "ring"), lines).in_force()
    assert [(tick, command.team, command.values.tolist()) for tick, command in followed] == [
        (30 * place, place % 2, corners[place]) for place in range(4)
    ]


def test_a_recording_becomes_a_film(tmp_path):
    record(tmp_path / "a.jsonl", ticks=60)
    playback = Playback(Recording.read(tmp_path / "a.jsonl"))
    playback.film(tmp_path / "a.gif", speed=4.0)
    assert (tmp_path / "a.gif").stat().st_size > 1000
    with pytest.raises(RenderError):
        playback.film(tmp_path / "a.avi")


def test_a_film_of_a_recording_runs_as_fast_as_the_command_was_told(tmp_path):
    record(tmp_path / "a.jsonl", ticks=60, config=CONFIG.replace(game=CONFIG.game.replace(capture=MILD)))
    for speed in (2.0, 5.0):
        main(["replay", str(tmp_path / "a.jsonl"), "--film", str(tmp_path / "a.mp4"), "--speed", str(speed)])
        pictures, seconds = imageio_ffmpeg.count_frames_and_secs(tmp_path / "a.mp4")
        assert seconds * (pictures - 1) / pictures == pytest.approx(2.0 / speed, abs=0.02)


# --- tables -----------------------------------------------------------------------------------------


def test_a_seat_as_a_row(tmp_path):
    game = record(tmp_path / "a.jsonl")
    red, blue = seat_rows(Recording.read(tmp_path / "a.jsonl"))
    assert (red.kind, red.player, red.opponent, blue.player) == ("person", "P1", "ring", "ring")
    assert red.seconds == pytest.approx(game.tick / 30)
    assert red.final_share == pytest.approx(game.sizes[0] / 8) and red.final_share + blue.final_share == 1.0
    assert red.commands == -(-game.tick // 60) and blue.commands == 0
    assert red.commands_per_minute == pytest.approx(60 * red.commands / red.seconds)
    assert red.first_command_s == 0.0 and blue.first_command_s is None
    assert red.drawing_s_per_command == 0.5
    assert red.input_to_in_force_ms == pytest.approx(30.0) and red.input_to_painted_ms == pytest.approx(50.0)
    assert red.hidden_s == 2.0 and red.disconnections == 0
    assert red.min_command_interval == 0.5


@pytest.mark.parametrize(("speed", "lost"), [(0.5, 2), (1.0, 1), (2.0, 0)])
def test_drones_are_lost_while_drawing_by_the_tables_clock_which_its_speed_sets(speed, lost):
    timing = Timing(input_ms=0.0, sent_ms=0.0, drawing_ms=1000.0)
    drawn = CommandLine(team=0, number=1, density=[], received_ms=5000.0, tick=0, timing=timing)  # from 4 to 5 s on
    taken = [CapturedLine(tick=tick, drone=drone, team=1) for drone, tick in enumerate((61, 74, 134, 151))]
    own = CapturedLine(tick=151, drone=5, team=0)
    told = header(CONFIG.replace(speed=speed), 1, "ring")
    red, blue = seat_rows(Recording("a.jsonl", told, [drawn, *taken, own]))
    assert (red.lost_while_drawing, blue.lost_while_drawing) == (lost, 0)


@pytest.mark.parametrize("parquet", [False, True])
def test_a_folder_becomes_tables(tmp_path, parquet):
    for number, outcome in enumerate(("red", "red", "draw", "blue", "stopped")):
        record(tmp_path / f"{number}.jsonl", seed=number, outcome=outcome)
    (tmp_path / "bad.jsonl").write_text("{}\n")
    rows, faults = read_folder(tmp_path)
    assert len(rows) == 10 and len(faults) == 1
    person = next(row for row in summarise(rows) if row.kind == "person")
    assert (person.games, person.wins, person.draws, person.losses) == (4, 2, 1, 1)
    assert person.win_rate_low < 0.5 < person.win_rate_high
    paths = write_tables(rows, tmp_path / "tables", parquet=parquet, command="swarm-pz study")
    schema = json.loads((tmp_path / "tables" / "schema.json").read_text())
    assert schema["version"] == 5
    assert schema["command"] == "swarm-pz study" and set(schema["versions"]) >= {"swarm-pz", "python"}
    if parquet:
        import pyarrow.parquet

        read = pyarrow.parquet.read_table(paths[0]).to_pylist()
    else:
        read = list(csv.DictReader(paths[0].read_text().splitlines()))
    assert len(read) == 10 and list(read[0]) == list(schema["tables"]["seats"])
    with pytest.raises(RecordingError, match="no recorded games"):
        read_folder(tmp_path / "tables")
