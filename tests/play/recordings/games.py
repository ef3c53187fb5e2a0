"""Recorded games for tests: written without a server."""

import json

import numpy as np

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.play.frames import Frame, encode_frame
from swarm_pz.play.game import Captured, InForce, LiveGame, TableConfig
from swarm_pz.play.protocol import (
    SIDES,
    SUBPROTOCOL,
    CapturedMessage,
    EndMessage,
    FrameMessage,
    Header,
    InForceMessage,
    PosesMessage,
    RecordedSeat,
    SeatCommand,
    SeatMessage,
    Timing,
)
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.recordings.recording import reason_of_end
from swarm_pz.play.strokes import Stroke, density_of

BEGAN_MS = 5000.0
CONFIG = TableConfig(game=GameConfig(drones_per_team=4, capture=CaptureConfig(threshold=0.5), time_limit=20.0))


def header(config, seed, player, own=0):
    seats = [RecordedSeat(kind="person", label="P1"), RecordedSeat(kind="policy", policy=player)]
    return Header(
        protocol=SUBPROTOCOL,
        software="test",
        started="2026-01-01T00:00:00.000+00:00",
        began_ms=BEGAN_MS,
        table=config.to_dict(),
        seed=seed,
        red=seats[own],
        blue=seats[1 - own],
    )


def record(
    path, ticks=300, seed=1, outcome=None, player="ring", config=CONFIG, own=0, both=False, delays=None, every=60,
    strokes=None, robots=False,
):  # fmt: skip
    """Write a game in which a person commands single cells or draws; the policy commands only with `both`.

    Robots fly at random, and each pose is lost with probability 0.1.
    """
    game, generator = LiveGame(config, seed, robots=robots), np.random.default_rng(seed)
    poses = np.pad(game.simulator.positions[0], ((0, 0), (0, 2)))
    recorder = Recorder(path, header(config, seed, player, own))
    recorder.write(FrameMessage(0, shown(game)))
    recorder.write(SeatMessage(SIDES[own], "connected", BEGAN_MS))
    for tick in range(game.tick, ticks):
        for team in (own, 1 - own)[: 1 + both] if tick % every == 0 else ():
            density = np.zeros((10, 10))
            density[(tick // every) % 10, 3] = 1.0
            drawn = strokes if team == own else None
            if drawn is not None:
                lines = [Stroke(brush=one.brush, width=one.width, points=tuple(one.points)) for one in drawn]
                density = density_of(lines, 10, config.mapping)
            number, ms = tick // every + both, BEGAN_MS + 1000 * tick / 30 / config.speed
            plain = game.submit(team, number, density).values.tolist()
            timing = Timing(input_ms=5.0, sent_ms=6.0, round_trip_ms=2.0, drawing_ms=500.0) if team == own else None
            recorder.write(SeatCommand(number, drawn, plain, None, timing, seat=SIDES[team], tick=tick, server_ms=ms))
        if robots:
            poses[:, 2:] = generator.uniform(-1.0, 1.0, (len(poses), 2))
            poses[:, :2] = np.clip(poses[:, :2] + poses[:, 2:] / 30, 0.0, 1.0)
            received = np.where(generator.random((len(poses), 1)) < 0.1, np.float32("nan"), poses)
            recorder.write(PosesMessage(game.tick, received.astype("<f4").tobytes()))
            game.place(received)
        for event in game.advance():
            if isinstance(event, InForce):
                side, number = SIDES[event.command.team], event.command.number
                recorder.write(InForceMessage(side, number, event.tick, ms + 28.0))
            elif isinstance(event, Captured):
                recorder.write(CapturedMessage(SIDES[event.team], event.tick, event.drone))
        if game.tick % 3 == 0 or game.over:
            recorder.write(FrameMessage(game.tick, shown(game)))
        if game.over:
            break
    recorder.write(SeatMessage(SIDES[own], "hidden", BEGAN_MS + 1000.0))
    recorder.write(SeatMessage(SIDES[own], "shown", BEGAN_MS + 3000.0))
    ending = outcome or game.outcome or "stopped"
    reason = reason_of_end(ending, game.sizes, away=False)
    recorder.write(EndMessage(ending, game.tick, game.sizes, BEGAN_MS + 1e4, reason, delays))
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
