"""Recorded games: written, read, and refused where they cannot be one."""

import json

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import RecordingError
from swarm_pz.play.frames import Frame, encode_frame
from swarm_pz.play.game import Captured, InForce, LiveGame, TableConfig
from swarm_pz.play.protocol import Timing
from swarm_pz.play.recordings.format import (
    MOST_LINE_BYTES,
    VERSION,
    CapturedLine,
    CommandLine,
    EndLine,
    FrameLine,
    Header,
    InForceLine,
    PaintedLine,
    RecordedSeat,
    Recording,
    SeatLine,
    frame_line,
    reason_of_end,
)
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.strokes import Stroke, density_of

CONFIG = TableConfig(game=GameConfig(drones_per_team=4, capture=CaptureConfig(threshold=0.5), time_limit=20.0))


def header(config, seed, player, own=0, origin=None):
    seats = [RecordedSeat(kind="person", label="P1"), RecordedSeat(kind="policy", policy=player)]
    return Header(
        version=VERSION,
        software="test",
        started="2026-01-01T00:00:00.000+00:00",
        table=config.to_dict(),
        seed=seed,
        red=seats[own],
        blue=seats[1 - own],
        origin=origin,
    )


def record(
    path, ticks=300, seed=1, outcome=None, player="ring", config=CONFIG, own=0, both=False, delays=None, every=60,
    strokes=None, moment=None,
):  # fmt: skip
    """Write a game in which a person commands corners, or draws, and the policy does nothing, or commands, too."""
    game = LiveGame(config, seed) if moment is None else moment.game
    recorder = Recorder(path, header(config, seed, player, own, moment.origin if moment is not None else None))
    for line in [frame_line(shown(game), 0)] if moment is None else moment.past:
        recorder.write(line)
    recorder.write(SeatLine(team=own, event="connected", ms=0.0))
    for tick in range(game.tick, ticks):
        for team in (own, 1 - own)[: 1 + both] if tick % every == 0 else ():
            density = np.zeros((10, 10))
            density[(tick // every) % 10, 3] = 1.0
            drawn = strokes if team == own else None
            if drawn is not None:
                lines = [Stroke(brush=one.brush, width=one.width, points=tuple(one.points)) for one in drawn]
                density = density_of(lines, 10, config.mapping)
            number, ms = tick // every + both, 1000 * tick / 30 / config.speed
            plain = game.submit(team, number, density).values.tolist()
            timing = Timing(input_ms=5.0, sent_ms=6.0, round_trip_ms=2.0, drawing_ms=500.0) if team == own else None
            recorder.write(CommandLine(team, number, plain, ms, tick, strokes=drawn, timing=timing))
        for event in game.advance():
            if isinstance(event, InForce):
                team, number = event.command.team, event.command.number
                recorder.write(InForceLine(team=team, number=number, tick=event.tick, ms=ms + 28.0))
                if team == own:
                    recorder.write(PaintedLine(team=team, number=number, ms=ms + 48.0))
            elif isinstance(event, Captured):
                recorder.write(CapturedLine(tick=event.tick, drone=event.drone, team=event.team))
        if game.tick % 3 == 0 or game.over:
            recorder.write(frame_line(shown(game), game.tick))
        if game.over:
            break
    recorder.write(SeatLine(team=own, event="hidden", ms=1000.0))
    recorder.write(SeatLine(team=own, event="shown", ms=3000.0))
    told = outcome or game.outcome or "stopped"
    reason = reason_of_end(told, game.sizes, away=False)
    recorder.write(EndLine(outcome=told, tick=game.tick, sizes=game.sizes, ms=1e4, ended_by=reason, delays=delays))
    recorder.close()
    recorder.join()
    return game


def shown(game):
    """Return a game's present frame."""
    simulator = game.simulator
    places, speeds, teams = simulator.positions[0], simulator.speeds[0], simulator.teams[0]
    return encode_frame(
        Frame(sequence=0, tick=game.tick, server_ms=0.0, positions=places, velocities=speeds, teams=teams)
    )


def plain_lines(path):
    """Return a file's lines as objects."""
    return [json.loads(line) for line in path.read_text().splitlines()]


def write_lines(path, lines):
    path.write_text("".join(json.dumps(line, separators=(",", ":")) + "\n" for line in lines))


# --- files ----------------------------------------------------------------------------------------


def test_a_recording_that_breaks_off_is_read_up_to_there(tmp_path):
    record(tmp_path / "a.jsonl", ticks=90)
    whole = (tmp_path / "a.jsonl").read_bytes()
    followed = whole.rindex(b'"in_force"')  # a command, at the last tick that is known then
    for length in (len(whole) // 3, followed, whole.index(b"\n", followed) + 1, len(whole) - 1):
        (tmp_path / "a.jsonl").write_bytes(whole[:length])
        broken = Recording.read(tmp_path / "a.jsonl")
        assert broken.end is None and Playback(broken).verify().verified


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: b"", "empty"),
        (lambda text: text[text.index(b"\n") + 1 :], "first line"),
        (lambda text: text.replace(b'"version":2', b'"version":3', 1), "version 3, expected 2"),
        (lambda text: text.replace(b'"tick":3,', b'"tick":-3,'), "line"),
        (lambda text: b'{"x":' + b"[" * 60_000 + b"\n" + text, "line 1"),
        (lambda text: b'{"x":"' + b"x" * MOST_LINE_BYTES + b'"}\n' + text, "line 1 of .* at most"),
        (lambda text: b"\n" * 2**20, "line 1"),
    ],
)
def test_what_is_no_recording_is_refused(change, message, tmp_path):
    record(tmp_path / "a.jsonl", ticks=30)
    (tmp_path / "a.jsonl").write_bytes(change((tmp_path / "a.jsonl").read_bytes()))
    with pytest.raises(RecordingError, match=message):
        Recording.read(tmp_path / "a.jsonl")


def test_what_a_later_version_adds_is_passed_over_but_other_rules_are_refused(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30)
    first, *rest = plain_lines(tmp_path / "a.jsonl")
    write_lines(tmp_path / "b.jsonl", [line | {"weather": "fine"} for line in (first, *rest)])
    before, after = (Recording.read(tmp_path / name) for name in ("a.jsonl", "b.jsonl"))
    assert (after.header, after.events) == (before.header, before.events)
    deep = []
    for _ in range(600):
        deep = [deep]
    for changed, said in (
        (first | {"table": first["table"] | {"weather": "fine"}}, "weather"),
        (first | {"table": first["table"] | {"mapping": deep}}, "not known here"),
    ):
        write_lines(tmp_path / "b.jsonl", [changed, *rest])
        with pytest.raises(RecordingError, match=said):
            Recording.read(tmp_path / "b.jsonl")


# --- lines ----------------------------------------------------------------------------------------


def picture(tick, drones=8):
    """Return a frame's bytes that show drones in a row."""
    places = np.stack([np.arange(drones) / 10] * 2, 1)
    teams = (np.arange(drones) >= drones // 2).astype(np.int8)
    return encode_frame(
        Frame(sequence=0, tick=tick, server_ms=0.0, positions=places, velocities=0 * places, teams=teams)
    )


NONSENSE = CommandLine(team=1, number=4, density=[[2.0] * 10] * 10, received_ms=0.0, tick=0)
END = EndLine(outcome="draw", tick=9, sizes=(4, 4), ms=0.0, ended_by="time")
SEAT = SeatLine(team=0, event="connected", ms=0.0)


def of(lines):
    """Return a recording of lines."""
    return Recording("a.jsonl", header(CONFIG, 1, "ring"), lines)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([CapturedLine(tick=1, drone=8, team=0)], "line 2 of a.jsonl: drone must be below 8"),
        ([InForceLine(team=1, number=4, tick=0, ms=0.0)], "lacks command 4 of team 1"),
        ([NONSENSE], "command 4 of team 1"),
        ([FrameLine(tick=3, data="AQID")], "frame at tick 3 is corrupt"),
        ([frame_line(picture(6, drones=7), 6)], "frame at tick 6 has another number of drones"),
        ([frame_line(picture(6), 9)], "frame at tick 9 shows tick 6"),
    ],
)
def test_what_its_game_cannot_have_is_corrupt(lines, message):
    def read_all(lines):
        recording = of(lines)
        return Playback(recording), list(recording.frames())

    read_all([CapturedLine(tick=1, drone=7, team=0), frame_line(picture(3), 3)])
    with pytest.raises(RecordingError, match=message):
        read_all(lines)


@pytest.mark.parametrize("line", [FrameLine(tick=9, data=""), InForceLine(team=0, number=1, tick=9, ms=0.0), END])
def test_whatever_came_last_tells_how_long_a_game_was(line):
    assert of([FrameLine(tick=6, data=""), line]).last_tick == 9


def test_the_past_of_a_moment_is_what_the_game_itself_did_before_its_solve():
    blank = [[1.0] * 10] * 10
    painted = PaintedLine(team=0, number=1, ms=9.0)
    first, second = (
        CommandLine(team=0, number=number, density=blank, received_ms=0.0, tick=6 * number - 6) for number in (1, 2)
    )
    begins, follows = (InForceLine(team=0, number=number, tick=6 * number - 6, ms=0.0) for number in (1, 2))
    taken, retaken = CapturedLine(tick=5, drone=1, team=1), CapturedLine(tick=6, drone=1, team=0)
    shown, after = FrameLine(tick=6, data=""), FrameLine(tick=9, data="")
    recording = of([SEAT, first, begins, painted, taken, retaken, shown, second, follows, after, END])
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
    assert [(tick, command.team, command.values.tolist()) for tick, command in of(lines).in_force()] == [
        (30 * place, place % 2, corners[place]) for place in range(4)
    ]
