"""The page in a browser: how fast it answers, and how smooth it is."""

from __future__ import annotations

import contextlib
import json
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.table.clients import CHANCE, server

BROWSERS = ("chromium", "chromium-headless-shell", "google-chrome")
CHROMIUM = next(filter(None, map(shutil.which, BROWSERS)), None)
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update")
WATCH = """() => {
    const arena = document.getElementById("arena");
    window.seen = { up: [], target: [], frames: [], ages: [] };
    arena.addEventListener("pointerup", () => seen.up.push(performance.now()), true);
    new MutationObserver((changes) => {
        for (const { attributeName } of changes) {
            if (attributeName === "data-target") seen.target.push([Number(arena.dataset.target), performance.now()]);
            if (attributeName === "data-tick") {
                seen.frames.push([Number(arena.dataset.tick), performance.now()]);
                seen.ages.push(Number(arena.dataset.age));
            }
        }
    }).observe(arena, { attributes: true });
}"""


@contextlib.contextmanager
def page(address: str, hash_: str, width: int = 900, height: int = 700) -> Iterator[Any]:
    """Open the table's page in a browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        opened = browser.new_page(viewport={"width": width, "height": height})
        opened.goto(f"http://{address}/#{hash_}")
        yield opened
        browser.close()


def draw_ring(opened: Any, x: float, y: float, radius: float, points: int = 24) -> None:
    """Draw a ring with the mouse, in map widths."""
    box = opened.locator("#arena").bounding_box()
    for k in range(points + 1):
        angle = 2 * np.pi * k / points
        px = box["x"] + (x + radius * np.cos(angle)) * box["width"]
        py = box["y"] + (1 - y - radius * np.sin(angle)) * box["height"]
        opened.mouse.move(px, py)
        if k == 0:
            opened.mouse.down()
    opened.mouse.up()


def latency(sends: int) -> None:
    """Send at random moments, and print how long it takes until it is seen."""
    with tempfile.TemporaryDirectory() as folder, server(Path(folder)) as (address, _):
        with page(address, "play=none") as opened:
            opened.wait_for_selector("#send:not([disabled])")
            opened.locator("#on-lift").check()
            opened.evaluate(WATCH)
            for _ in range(sends):
                x, y = CHANCE.uniform(0.3, 0.7, 2)
                draw_ring(opened, float(x), float(y), 0.2, 6)
                opened.wait_for_timeout(600 + 400 * CHANCE.random())
            seen = opened.evaluate("seen")
        (path,) = Path(folder).glob("*.jsonl")
        events = [json.loads(line) for line in path.read_text().splitlines()]
    arrived = {e["number"]: e["received_ms"] for e in events if e["type"] == "command"}
    timing = {e["number"]: e["timing"] for e in events if e["type"] == "command"}
    forced = {e["number"]: (e["tick"], e["ms"]) for e in events if e["type"] == "in_force"}
    targets = dict(map(tuple, reversed(seen["target"])))  # when each was first painted
    to_target, to_force, to_frame = [], [], []
    for number in sorted(forced.keys() & targets.keys() & timing.keys()):
        up = max(at for at in seen["up"] if at <= timing[number]["sent_ms"])
        to_target.append(targets[number] - up)
        sent = timing[number]["sent_ms"] - up + timing[number]["round_trip_ms"] / 2
        to_force.append(sent + forced[number][1] - arrived[number])
        to_frame.append(next(at for tick, at in seen["frames"] if tick > forced[number][0]) - up)
    for name, values in (
        ("acknowledged target painted", to_target),
        ("in force", to_force),
        ("changed frame", to_frame),
    ):
        p50, p95 = np.quantile(values, [0.5, 0.95])
        print(f"pointer-up to {name}: median {p50:.0f} ms, 95 % {p95:.0f} ms, of {len(values)}")
    _print_gaps(seen)


def _print_gaps(seen: dict[str, Any]) -> None:
    ticks, times = np.array(seen["frames"]).T
    gaps = np.diff(times)
    rate = 1000 * (ticks[-1] - ticks[0]) / (times[-1] - times[0])
    print(
        f"paintings of new frames: gaps 95 % {np.quantile(gaps, 0.95):.0f} ms, most {gaps.max():.0f} ms; "
        f"{rate:.2f} ticks a second shown; oldest frame painted {max(seen['ages'])} ms"
    )


def smooth(drones: int, seconds: float) -> None:
    """Watch a game with this many drones a team, stall the page for 20 s, and print gaps and ages."""
    with tempfile.TemporaryDirectory() as folder, server(Path(folder)) as (address, _), page(address, "") as opened:
        opened.wait_for_selector("#opponent option", state="attached")
        opened.click("#more summary")
        opened.fill("#red-drones", str(drones))
        opened.fill("#blue-drones", str(drones))
        opened.click("#create button[type=submit]")
        opened.click("#ready")
        opened.wait_for_selector("#cover", state="hidden")
        opened.wait_for_timeout(1000)
        opened.evaluate(WATCH)
        opened.wait_for_timeout(1000 * seconds)
        _print_gaps(opened.evaluate("seen"))
        opened.evaluate("() => { seen.frames = []; seen.ages = []; }")
        opened.evaluate("() => { const end = performance.now() + 20000; while (performance.now() < end); }")
        opened.wait_for_timeout(3000)
        print("after a stall of 20 s:")
        _print_gaps(opened.evaluate("seen"))
