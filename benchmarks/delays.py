"""The delays of commands and of display that were asked for, and those that are got, in a browser.

python -m benchmarks.delays --sends 80 --delays 0 100 300

For each delay a table of its own, which has it for both, and a page on which one draws by synthetic touches. Of
commands, when each came into force less when it would have: at the first solve after it had arrived. Of display, from
the tick at which a command came into force to when the page painted the first moment after it, less the median of that
without a delay. Besides, what the table itself has measured.
"""

from __future__ import annotations

import argparse
import math
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.table.clients import CHANCE, server
from benchmarks.table.page import FLAGS
from swarm_pz.config import TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND
from swarm_pz.play.recordings.format import CommandLine, InForceLine, PaintedLine, Recording
from swarm_pz.play.recordings.playback import Playback

_TICK_MS = 1000.0 / TICKS_PER_SECOND


def touch(page: Any, touches: Any, x: float, y: float) -> None:
    """Draw a short line with a finger, from a place in map widths."""
    box = page.locator("#arena").bounding_box()
    for step, kind in enumerate(("touchStart", "touchMove", "touchMove", "touchEnd")):
        place = {"x": box["x"] + (x + 0.05 * step) * box["width"], "y": box["y"] + (1 - y) * box["height"]}
        points = [] if kind == "touchEnd" else [place]
        touches.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def play(delay_ms: float, sends: int, folder: Path) -> Recording:
    """Play a game with a delay, in a browser, and return what was recorded of it."""
    from playwright.sync_api import sync_playwright

    factors = folder / "factors.toml"
    factors.write_text(f"[red]\ncommand_delay_ms = {delay_ms}\ndisplay_delay_ms = {delay_ms}\n")
    executable = shutil.which("chromium") or shutil.which("google-chrome")
    with server(folder / "games", options=["--factors", str(factors)]) as (address, _), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=FLAGS)
        page = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True).new_page()
        page.goto(f"http://{address}/#play=none")
        page.wait_for_selector("#send:not([disabled])")
        touches = page.context.new_cdp_session(page)
        for _ in range(sends):
            touch(page, touches, *(float(part) for part in CHANCE.uniform(0.2, 0.7, 2)))
            page.wait_for_timeout(650 + 200 * CHANCE.random())
        page.wait_for_timeout(2 * delay_ms + 500)
        browser.close()
    (path,) = (folder / "games").glob("*.jsonl")
    return Recording.read(path)


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


def display_delays(recording: Recording) -> list[float]:
    """Return how long after each command came into force its first effect was painted."""
    forced = {line.number: line.ms for line in recording.of(InForceLine) if line.tick > 0}
    return [line.ms - forced[line.number] for line in recording.of(PaintedLine) if line.number in forced]


def _print(what: str, asked: float, got: list[float], base: float = 0.0) -> None:
    p50, p95 = np.quantile(got, [0.5, 0.95]) - base
    print(f"{what:8} asked {asked:5.0f} ms: got median {p50:6.1f} ms, 95 % {p95:6.1f} ms, of {len(got)}", flush=True)


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sends", type=int, default=80)
    parser.add_argument("--delays", type=float, nargs="+", default=[0.0, 100.0, 300.0], help="the first is the base, 0")
    options = parser.parse_args()
    base = math.nan
    for asked in options.delays:
        with tempfile.TemporaryDirectory() as folder:
            recording = play(asked, options.sends, Path(folder))
        shown = display_delays(recording)
        base = float(np.median(shown)) if math.isnan(base) else base
        _print("command", asked, command_delays(recording))
        _print("display", asked, shown, base)
        if recording.end is not None and recording.end.delays is not None:
            own = recording.end.delays[0]
            got = [f"{one.got_ms} ms of {one.count}" for one in (own.command, own.display)]
            print(f"         the table's own medians: command {got[0]}, display {got[1]}")
        verified = Playback(recording).verify().verified
        print(f"         painted {base:.1f} ms after without a delay; verifies: {verified}", flush=True)


if __name__ == "__main__":
    main()
