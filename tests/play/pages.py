"""Steps and checks for tests of the page in a real browser."""

import re
import time
from pathlib import Path

import pytest
from axe_playwright_python.base import AXE_SCRIPT
from playwright.sync_api import expect

from swarm_pz.play.protocol import SeatCommand
from swarm_pz.play.recordings.recording import Recording
from tests.play.conftest import SLOW_MS

INK = """async () => {
    for (let frame = 0; frame < 2; frame++) await new Promise(requestAnimationFrame);  // what is new has been painted
    const ink = document.getElementById("ink");
    const { data } = ink.getContext("2d").getImageData(0, 0, ink.width, ink.height);
    return data.filter((value, i) => i % 4 === 3 && value).length;
}"""
OUT_OF_PLACE = """() => {
  const view = document.querySelector("dialog[open]") ?? document.querySelector(".view:not([hidden])") ?? document.body;
  const name = one => one.id || one.textContent.trim();
  const fields = [...view.querySelectorAll("button, input, select, textarea, .button, .score > :first-child, #time")]
    .filter(one => one.checkVisibility());
  const faults = fields.flatMap(one => {
    const box = one.getBoundingClientRect(), isCut = one.matches("button") && one.scrollWidth > one.clientWidth + 1;
    const inside = box.left >= 0 && box.right <= innerWidth;
    return [...(inside ? [] : [`${name(one)} is beyond the edge`]), ...(isCut ? [`${name(one)} is cut`] : [])];
  });
  if (document.documentElement.scrollWidth > innerWidth) faults.push("the page is too wide");
  if (view.id !== "table") return faults;
  if (view.scrollHeight > innerHeight) faults.push("the table is too high");
  const news = document.getElementById("news");  // cuts lines that are longer than what is seen of them
  const log = document.getElementById("log").getBoundingClientRect(), end = news.getBoundingClientRect().bottom;
  if (log.height && log.bottom > end + 1) faults.push("the end of the log cannot be seen");
  const apart = fields.filter(one => !one.closest("#arena, #news")).concat(news?.checkVisibility() ? [news] : []);
  const covered = apart.map(one => [name(one), one.getBoundingClientRect()]);
  return faults.concat(covered.flatMap(([one, a], i) => covered.slice(i + 1).filter(([, b]) =>
    a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1)
    .map(([other]) => `${one} and ${other} overlap`)));
}"""
"""Names elements of the visible view that lie beyond its edge, are cut off, or overlap."""
AXE = """async () => {
  const { violations, incomplete } = await axe.run(document, { resultTypes: ["violations", "incomplete"] });
  const faults = violations.map(({ id, nodes }) => [id, ...nodes.map(({ html }) => html)]);
  return faults.concat(incomplete.filter(({ id }) => id !== "color-contrast").map(({ id }) => [`${id} is unclear`]));
}"""
"""axe cannot compute contrast over a canvas; `test_static` tests the colours."""
SMALL = """() => [...document.querySelectorAll("#table button, #table input:not([type=checkbox])")]
  .filter(one => one.checkVisibility() && Math.min(one.offsetHeight, one.offsetWidth) < 44)
  .map(one => one.id || one.outerHTML)"""
"""Names controls that are too small for a finger."""


class Hand:
    """Draws on a page, in map widths, with the mouse or a finger."""

    def __init__(self, page, touch=False):
        self.page = page
        self.touches = page.context.new_cdp_session(page) if touch else None

    def draw(self, *points):
        box = self.page.locator("#arena").bounding_box()
        places = [(box["x"] + x * box["width"], box["y"] + (1 - y) * box["height"]) for x, y in points]
        if self.touches is not None:
            for kind, (x, y) in zip(["touchStart", *["touchMove"] * (len(places) - 1)], places, strict=True):
                self.touches.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y}]})
            self.touches.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
            return
        self.page.mouse.move(*places[0])
        self.page.mouse.down()
        for place in places[1:]:
            self.page.mouse.move(*place)
        self.page.mouse.up()


# --- experiments ----------------------------------------------------------------------------------

DIST = Path(__file__).parent / "npm" / "node_modules" / "jspsych" / "dist"
EXPERIMENT = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>An experiment</title>
<script src="jspsych.js"></script>
<script src="SITE/static/jspsych-plugin-swarm-pz.js"></script></head><body></body>
<script>
  const jsPsych = initJsPsych({ on_finish: () => { window.rows = jsPsych.data.get().values(); } });
  RUN
</script></html>"""


def write_experiment(folder, site, run):
    """Write a jsPsych page that loads the plug-in from `site`, a site or a table, and runs the script `run`."""
    if not DIST.is_dir():
        pytest.skip("jsPsych is not here: scripts/browser installs it, with npm")
    (folder / "jspsych.js").write_bytes((DIST / "index.browser.min.js").read_bytes())
    (folder / "index.html").write_text(EXPERIMENT.replace("SITE", site).replace("RUN", run))


# --- waiting --------------------------------------------------------------------------------------


def eventually(page, holds):
    """Wait until `holds()` is true, even on a slow machine, and return its value."""
    end = time.monotonic() + SLOW_MS / 1000
    while not (held := holds()):
        assert time.monotonic() < end, "it did not come to that"
        page.wait_for_timeout(50)
    return held


def wait_for_play(page):
    """Wait until the game runs and accepts commands."""
    expect(page.locator("#table[data-phase=playing]")).to_be_visible()
    expect(page.locator("#spread")).to_be_enabled()


def room_of(page):
    """Wait until the address names a room, and return its code; `page.url` lags behind `location`."""
    return eventually(page, lambda: page.evaluate("/^#room=(.+)/.exec(location.hash)?.[1]"))


# --- the start ------------------------------------------------------------------------------------


def open_form(page):
    """Open the start page's form with all settings, also those for researchers."""
    page.evaluate("for (const name of ['more', 'lab']) document.getElementById(name).open = true")


def open_room(page, opponent="none", time_limit="", **choices):
    """Open a room with the start page's form, and return its code; the form need not offer the time limit."""
    open_form(page)
    page.locator("#time-limit").evaluate(
        "(field, value) => { field.append(new Option(value, value)); field.value = value; }", time_limit
    )
    for field, value in ({"opponent": opponent} | choices).items():
        page.select_option(f"#{field.replace('_', '-')}", value)
    page.click("#create button[type=submit]")
    return room_of(page) if choices.get("side") != "watch" else page.wait_for_url(re.compile("#watch="))


def begin(page, opponent="none", **choices):
    """Open a room and begin; without a time limit, the game cannot end before the test acts."""
    room = open_room(page, opponent, **choices)
    page.click("#ready")
    wait_for_play(page)
    return room


# --- recordings -----------------------------------------------------------------------------------


def latest(table, room, kind):
    """Return the lines of a kind that a room's latest game has written so far."""
    return Recording.read(table.recording(room)).of(kind)


def commands(page, table, room, count):
    """Wait for `count` commands of red, and return all; of those in quick succession, only the latest may count."""
    return eventually(
        page,
        lambda: (
            (lines := [one for one in latest(table, room, SeatCommand) if one.team == 0])
            and len(lines) >= count
            and lines
        ),
    )


def heights(lines):
    """Return the heights at which the strokes of each command began."""
    return [[round(stroke.points[0][1], 1) for stroke in line.strokes] for line in lines]


# --- what is wrong with a page --------------------------------------------------------------------


def check_axe(page, where, scheme):
    """Check that axe finds no fault in a colour scheme."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE_SCRIPT)
    page.emulate_media(color_scheme=scheme)
    assert page.evaluate(AXE) == [], f"{where}, {scheme}"


def check_places(page, where):
    """Check that nothing is off-screen, cut off, overlapping or too small for a finger."""
    faults = page.evaluate(OUT_OF_PLACE) + page.evaluate(SMALL)
    assert faults == [], f"{where}: {faults}"
