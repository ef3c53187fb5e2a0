"""Markers over Lab Streaming Layer: whether all arrive, in order, and how late: `python -m benchmarks.lsl`.

A table plays `ring` against `uniform`, game after game; an inlet of another process records; what it heard is compared
with the recordings.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pylsl
from websockets import Subprotocol
from websockets.sync.client import connect

from benchmarks.table.clients import ACKNOWLEDGE_EVERY, server
from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, decode_frame
from swarm_pz.play.recordings.format import CapturedLine, ClockLine, EndLine, InForceLine, Recording

_WAIT_S = 300.0


def main() -> None:
    """Play for some minutes, and print what became of the markers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=300.0)
    seconds = parser.parse_args().seconds
    name = f"benchmark-{os.getpid()}"
    heard: list[tuple[dict[str, object], float, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        with server(Path(folder), 1.0, ["--lsl", name]) as (address, _):
            stop = threading.Event()
            listening = threading.Thread(target=_listen, args=(name, heard, stop))
            listening.start()
            _play(address, seconds)
            time.sleep(2.0)
            stop.set()
            listening.join()
        recordings = [Recording.read(path) for path in sorted(Path(folder).glob("*.jsonl"))]
    print(json.dumps(_compare(recordings, heard) | {"seconds": seconds}, indent=2))


def _listen(name: str, heard: list[tuple[dict[str, object], float, float]], stop: threading.Event) -> None:
    inlet = pylsl.StreamInlet(pylsl.resolve_byprop("name", name, 1, _WAIT_S)[0])
    while not stop.is_set():
        sample, stamp = inlet.pull_sample(0.2)
        if sample is not None:
            heard.append((json.loads(sample[0]), stamp, pylsl.local_clock()))
    inlet.close_stream()


def _play(address: str, seconds: float) -> None:
    """Let two policies play until the time is over and a game has ended."""
    settings = protocol.Settings(red=8, blue=8, time_limit=30.0)
    protocols = [Subprotocol(protocol.SUBPROTOCOL)]
    end, frames = time.monotonic() + seconds, 0
    with connect(f"ws://{address}/socket", subprotocols=protocols, compression=None, max_size=None) as socket:
        for message in (
            protocol.Hello(),
            protocol.Create(settings=settings, seat="watch", opponent="uniform", player="ring"),
            protocol.Ready(),
        ):
            socket.send(protocol.encode(message))
        while True:
            data = socket.recv(timeout=_WAIT_S)
            if isinstance(data, bytes):
                frames += data[0] == FRAME
                if data[0] == FRAME and frames % ACKNOWLEDGE_EVERY == 0:
                    socket.send(protocol.encode(protocol.Acknowledge(decode_frame(data).sequence)))
                continue
            told = protocol.decode_server(data)
            if isinstance(told, protocol.Refused):
                raise SystemExit(f"refused: {told.reason}")
            if isinstance(told, protocol.RoomState) and told.phase == "over":
                if time.monotonic() > end:
                    return
                socket.send(protocol.encode(protocol.Ready()))


def _compare(recordings: list[Recording], heard: list[tuple[dict[str, object], float, float]]) -> dict[str, object]:
    """Return how many markers there are, how many were lost or out of order, and how the clocks agree."""
    wanted: list[tuple[object, ...]] = []
    apart, drifts, unsure = [], [], []
    stamps = {(one["game"], one["event"], one["tick"], one.get("side"), one.get("number")): at for one, at, _ in heard}
    for recording in recordings:
        game, clocks = recording.name.removesuffix(".jsonl"), recording.of(ClockLine)
        wanted.append(("start", game, 0))
        for line in recording.events:
            if isinstance(line, InForceLine):
                wanted.append(("command", game, line.tick))
                stamp = stamps.get((game, "command", line.tick, ("red", "blue")[line.team], line.number))
                if stamp is not None:
                    apart.append(1000.0 * (stamp - clocks[0].seconds) - (line.ms - clocks[0].ms))
            elif isinstance(line, CapturedLine):
                wanted.append(("capture", game, line.tick))
            elif isinstance(line, EndLine):
                wanted.append(("end", game, line.tick))
        first, last = clocks[0], clocks[-1]
        drifts.append(1000.0 * (last.seconds - first.seconds) - (last.ms - first.ms))
        unsure += [clock.uncertainty_ms for clock in clocks]
    got = [(one["event"], one["game"], one["tick"]) for one, _, _ in heard]
    late = [1000.0 * (arrived - stamp) for _, stamp, arrived in heard]
    return {
        "games": len(recordings),
        "markers": len(wanted),
        "received": len(got),
        "all_in_order": got == wanted,
        "stamps_in_order": all(before <= after for (_, before, _), (_, after, _) in itertools.pairwise(heard)),
        "arrived_after_ms": {"median": float(np.median(late)), "most": max(late)},
        "stamp_less_recording_ms": {"median": float(np.median(apart)), "most": max(map(abs, apart))},
        "clock_uncertainty_ms_most": max(unsure),
        "drift_of_a_game_ms_most": max(map(abs, drifts)),
    }


if __name__ == "__main__":
    main()
