"""The delays of commands and of display that were asked for, and those that are got, in a browser.

python -m benchmarks.delays --sends 80 --delays 0 100 300

For each delay a table of its own, which has it for both, a page on which one draws by synthetic touches, and another
one that looks on, to whom nothing is late. Of commands, when each came into force less when it would have: at the first
solve after it had arrived. Of display, when the player's page painted each moment less when the other page did, at the
same time on the same machine. Besides, what the table itself has measured.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.table.clients import CHANCE, server
from benchmarks.table.page import CHROMIUM, FLAGS
from swarm_pz.config import TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND
from swarm_pz.play.recordings.format import CommandLine, InForceLine, Recording
from swarm_pz.play.recordings.playback import Playback

_TICK_MS = 1000.0 / TICKS_PER_SECOND
WATCH = """() => {
    const arena = document.getElementById("arena");
    window.painted = [];
    new MutationObserver(() => painted.push([Number(arena.dataset.tick), performance.timeOrigin + performance.now()]))
        .observe(arena, { attributeFilter: ["data-tick"] });
}"""
"""Keeps when each moment was first painted, by the clock that all pages of a machine have."""


def touch(page: Any, touches: Any, x: float, y: float) -> None:
    """Draw a short line with a finger, from a place in map widths."""
    box = page.locator("#arena").bounding_box()
    for step, kind in enumerate(("touchStart", "touchMove", "touchMove", "touchEnd")):
        place = {"x": box["x"] + (x + 0.05 * step) * box["width"], "y": box["y"] + (1 - y) * box["height"]}
        points = [] if kind == "touchEnd" else [place]
        touches.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def play(delay_ms: float, sends: int, folder: Path) -> tuple[Recording, list[float]]:
    """Play a game with a delay, in a browser; return what was recorded of it, and how late each moment was painted."""
    from playwright.sync_api import sync_playwright

    factors = folder / "factors.toml"
    factors.write_text(f"[red]\ncommand_delay_ms = {delay_ms}\ndisplay_delay_ms = {delay_ms}\n")
    with server(folder / "games", options=["--factors", str(factors)]) as (address, _), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        how: Any = {"viewport": {"width": 390, "height": 844}, "has_touch": True}
        page, other = (browser.new_context(**how).new_page() for _ in range(2))
        page.goto(f"http://{address}/#play=none")
        page.wait_for_selector("#send:not([disabled])")
        other.goto(f"http://{address}/#watch={page.url.split('#room=')[1]}")
        other.wait_for_selector("#watching:not([hidden])")
        for one in (page, other):
            one.evaluate(WATCH)
        touches = page.context.new_cdp_session(page)
        for _ in range(sends):
            touch(page, touches, *(float(part) for part in CHANCE.uniform(0.2, 0.7, 2)))
            page.wait_for_timeout(650 + 200 * CHANCE.random())
        page.wait_for_timeout(2 * delay_ms + 500)
        late, early = (dict(map(tuple, one.evaluate("painted"))) for one in (page, other))
        browser.close()
    (path,) = (folder / "games").glob("*.jsonl")
    return Recording.read(path), [late[tick] - early[tick] for tick in sorted(late.keys() & early.keys())]


def command_delays(recording: Recording) -> list[float]:
    """Return by how much each command came into force later than at the first solve after it had arrived."""
    arrived = {line.number: line.received_ms for line in recording.of(CommandLine)}
    late = []
    for line in recording.of(InForceLine):
        if line.number in arrived and line.tick > 0:
            ticks_before = (line.ms - arrived[line.number]) / _TICK_MS
            solves = math.floor(ticks_before / TICKS_PER_CONTROL_PERIOD)
            late.append(solves * TICKS_PER_CONTROL_PERIOD * _TICK_MS)
    return late


def _print(what: str, asked: float, got: list[float]) -> None:
    p50, p95 = np.quantile(got, [0.5, 0.95])
    print(f"{what:8} asked {asked:5.0f} ms: got median {p50:6.1f} ms, 95 % {p95:6.1f} ms, of {len(got)}", flush=True)


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sends", type=int, default=80)
    parser.add_argument("--delays", type=float, nargs="+", default=[0.0, 100.0, 300.0])
    options = parser.parse_args()
    for asked in options.delays:
        with tempfile.TemporaryDirectory() as folder:
            recording, shown = play(asked, options.sends, Path(folder))
        _print("command", asked, command_delays(recording))
        _print("display", asked, shown)
        if recording.end is not None and recording.end.delays is not None:
            own = recording.end.delays[0]
            got = [f"{one.got_ms} ms of {one.count}" for one in (own.command, own.display)]
            print(f"         the table's own medians: command {got[0]}, display {got[1]}")
        print(f"         the recording verifies: {Playback(recording).verify().verified}", flush=True)


if __name__ == "__main__":
    main()
