"""The page in a real browser, as people use it."""

import math
import re
import time
from pathlib import Path

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

import swarm_pz.play
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import CommandLine, PaintedLine, Recording
from swarm_pz.play.recordings.playback import Playback
from tests.play.conftest import SLOW_MS, Table, new_page

pytestmark = pytest.mark.browser
INK = """async () => {
    for (let frame = 0; frame < 2; frame++) await new Promise(requestAnimationFrame);  // what is new has been painted
    const ink = document.getElementById("ink");
    const { data } = ink.getContext("2d").getImageData(0, 0, ink.width, ink.height);
    return data.filter((value, i) => i % 4 === 3 && value).length;
}"""
STATIC = Path(swarm_pz.play.__file__).parent / "static"


class Hand:
    """Draws on a page, in map widths, with the mouse or a finger."""

    def __init__(self, page, touch=False):
        self.page = page
        self.box = page.locator("#arena").bounding_box()
        self.touches = page.context.new_cdp_session(page) if touch else None

    def at(self, x, y):
        return self.box["x"] + x * self.box["width"], self.box["y"] + (1 - y) * self.box["height"]

    def draw(self, *points):
        if self.touches is None:
            self.page.mouse.move(*self.at(*points[0]))
            self.page.mouse.down()
            for point in points[1:]:
                self.page.mouse.move(*self.at(*point))
            self.page.mouse.up()
            return
        for kind, point in (("touchStart", points[0]), *(("touchMove", p) for p in points[1:])):
            x, y = self.at(*point)
            self.touches.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y}]})
        self.touches.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def ring(self, x, y, radius):
        self.draw(*[(x + radius * math.cos(a / 4), y + radius * math.sin(a / 4)) for a in range(27)])


def choose_time_limit(page, seconds):
    """Set a time limit that the lobby need not offer; the empty one is none."""
    page.locator("#time-limit").evaluate(
        "(field, value) => { field.append(new Option(value, value)); field.value = value; }", seconds
    )


def open_form(page):
    """Show the start's form, with all that a room can be."""
    page.locator("#more").evaluate("more => { more.open = true; }")


def open_room(page, opponent, time_limit=""):
    """Open a room by the lobby's form, and return its code."""
    open_form(page)
    page.select_option("#opponent", opponent)
    choose_time_limit(page, time_limit)
    page.click("#create button[type=submit]")
    return room_of(page)


def begin(page, opponent="none", *, may_send=True):
    """Open a room and begin; against nobody, and without a time limit, no game is over before something was done."""
    room = open_room(page, opponent)
    page.click("#ready")
    page.wait_for_selector("#cover", state="hidden")
    if may_send:
        page.wait_for_selector("#send:not([disabled])", state="attached")  # before that, no stroke counts
    return room


def play_through(page, seconds):
    """Open a room and play a game to its end, too short to be won; return the room."""
    room = open_room(page, "uniform", seconds)
    page.click("#ready")
    page.wait_for_selector("#recording", state="visible")
    return room


def eventually(page, holds):
    """Wait until something holds, however slow the machine is, and return it."""
    end = time.monotonic() + SLOW_MS / 1000
    while not (held := holds()):
        assert time.monotonic() < end, "it did not come to that"
        page.wait_for_timeout(50)
    return held


def room_of(page):
    page.wait_for_url(re.compile("#room="))
    return page.url.split("#room=")[1]


def recordings(table, room):
    return sorted(table.folder.glob(f"*-{room}-*.jsonl"))


def latest(table, room, kind):
    """Return the lines of a kind of the latest game in a room, as far as they are written."""
    return Recording.read(recordings(table, room)[-1]).of(kind)


def commands(page, table, room, count):
    """Return where each command's strokes began, once there are so many: one that is sent before may take its place."""
    lines = eventually(
        page, lambda: len(latest(table, room, CommandLine)) >= count and latest(table, room, CommandLine)
    )
    return [[round(stroke.points[0][1], 1) for stroke in line.strokes] for line in lines]


def in_corner(table, room):
    """Return the share of red's drones in the top right corner, by the recording."""
    *_, frame = [None, *Recording.read(recordings(table, room)[-1]).frames()]
    if frame is None:
        return 0.0
    own = frame.positions[frame.teams == 0]
    return np.mean(np.hypot(*(1 - own).T) < 0.4) if len(own) else 0.0


# --- playing --------------------------------------------------------------------------------------


@pytest.mark.parametrize("touch", [False, True])
def test_drones_go_where_one_draws(open_page, table, touch):
    page = open_page(has_touch=touch, is_mobile=touch)
    room = begin(page)
    Hand(page, touch).draw((0.85, 0.85), (0.92, 0.92))  # and sent, since the hand is lifted
    eventually(page, lambda: in_corner(table, room) >= 0.6)
    (command,) = latest(table, room, CommandLine)
    assert command.strokes[0].brush == "attract" and command.timing.drawing_ms > 0
    assert eventually(page, lambda: latest(table, room, PaintedLine))


def test_a_room_is_as_the_form_says(open_page, table):
    page = open_page()
    open_form(page)
    page.select_option("#opponent", "none")
    page.select_option("#side", "blue")
    page.fill("#blue-drones", "7")
    page.select_option("#time-limit", "120")
    page.select_option("#speed", "0.5")
    page.select_option("#mapping", "paper")
    page.fill("#label", "P3")
    page.click("#create button[type=submit]")
    room = room_of(page)
    page.click("#ready")
    page.wait_for_selector("#cover", state="hidden")
    header = eventually(page, lambda: recordings(table, room) and Recording.read(recordings(table, room)[0])).header
    config = TableConfig.from_dict(header.table)
    assert (config.game.team_sizes, config.game.time_limit, config.speed, config.mapping) == ((0, 7), 120, 0.5, "paper")
    assert (header.blue.kind, header.blue.label, header.red.kind) == ("person", "P3", "free")


def test_two_people_play_each_other_to_the_end(open_page, table):
    red = open_page(width=1000, height=700)
    room = open_room(red, "", "30")
    expect(red.locator("#room-code")).to_have_text(room)
    blue = open_page()
    blue.fill("#code", room.lower())
    blue.click("#join button[type=submit]")
    expect(blue.locator("#blue-who")).to_contain_text("(you)")
    red.click("#ready")
    blue.wait_for_timeout(300)
    assert blue.inner_text("#clock").split() == ["0:00", "of", "0:30"]
    blue.click("#ready")
    for page in (red, blue):
        page.wait_for_selector("#cover", state="hidden")
        Hand(page).draw((0.3, 0.5), (0.7, 0.5))  # a moment's work, of a game of 30 s
        page.click("#send")
    for page in (red, blue):
        page.wait_for_selector("#recording", state="visible")
        expect(page.locator("#cover-text")).to_have_text(re.compile("won|lost|draw"))
    recording = Recording.read(recordings(table, room)[0])
    assert recording.end.outcome in ("red", "blue", "draw") and Playback(recording).verify().verified
    assert {line.team for line in recording.of(CommandLine)} == {0, 1}


def test_a_game_counts_down_with_its_start_in_view_and_one_may_draw(chromium, tmp_path):
    patient = Table(tmp_path, countdown="60")
    page = new_page(chromium, 1000, 700)
    try:
        page.goto(f"http://{patient.address}/")
        page.wait_for_selector("#opponent option", state="attached")
        begin(page)
        expect(page.locator("#countdown")).to_have_text(re.compile(r"\d+"))
        expect(page.locator("#arena")).to_have_attribute("data-tick", "0")
        Hand(page).draw((0.3, 0.5), (0.7, 0.5))
        expect(page.locator("#arena")).to_have_attribute("data-target", "1")
        page.click("#leave")
        eventually(page, lambda: not list(tmp_path.glob("*.jsonl")))
    finally:
        page.context.close()
        patient.end()


KEEP_SAID = """
    globalThis.said = [];
    addEventListener("DOMContentLoaded", () => {
        const says = document.querySelector("#says");
        new MutationObserver(() => globalThis.said.push(says.textContent)).observe(says, { childList: true });
    });
"""
"""What is said goes after six seconds, which may be over before a slow test looks."""


def test_who_comes_back_after_a_restart_sees_their_game(chromium, tmp_path):
    first = Table(tmp_path)
    page = new_page(chromium, 1000, 700)
    try:
        page.goto(f"http://{first.address}/#play=uniform")
        page.wait_for_selector("#send:not([disabled])")
        expect(page.locator("#time")).to_have_text(re.compile("[1-9]"))  # a second is in the file
        room = room_of(page)
        (recording,) = recordings(first, room)
        seat = page.evaluate("localStorage.getItem('swarm-pz.seat')")
        first.kill()
        again = Table(tmp_path)
        try:
            page.goto(f"http://{again.address}/")
            page.evaluate("seat => localStorage.setItem('swarm-pz.seat', seat)", seat)
            page.add_init_script(KEEP_SAID)
            page.goto(f"http://{again.address}/?#room={room}")
            page.wait_for_selector("#scrubber", state="visible")
            assert page.url.endswith(f"#replay={recording.name}")
            page.wait_for_function("() => globalThis.said.some((text) => text.includes('recorded as'))")
        finally:
            again.end()
    finally:
        page.context.close()


def test_a_page_that_was_closed_returns_to_its_seat(open_page, table):
    page = open_page()
    room = begin(page)
    context = page.context
    page.close()
    again = context.new_page()
    again.goto(f"http://{table.address}/")
    again.wait_for_selector("#return", state="visible")
    again.click("#return")
    again.wait_for_selector("#send:not([disabled])")
    expect(again.locator("#red-who")).to_contain_text("(you)")
    assert room_of(again) == room
    another = context.new_page()
    another.goto(f"http://{table.address}/#room={room}")
    another.wait_for_selector("#send:not([disabled])")
    expect(again.locator("#says")).to_contain_text("taken over")
    another.reload()
    another.wait_for_selector("#send:not([disabled])")


HOLDS_THE_FIRST_WELCOME = """
let isFirst = true;
globalThis.WebSocket = class extends WebSocket {
  set onmessage(hear) {
    const holds = isFirst;
    isFirst = false;
    super.onmessage = (event) => {
      if (holds && String(event.data).includes('"welcome"')) globalThis.letGo = () => hear(event);
      else hear(event);
    };
  }
};
"""
"""In the page: what the server says first is kept until it is let go."""


def test_a_seat_that_is_wanted_before_the_table_has_answered_is_returned_to(open_page, table):
    """Whoever asks for it while the first greeting, which asked for no seat, is on its way must greet again."""
    page = open_page()
    room = begin(page)
    context = page.context
    page.close()
    again = context.new_page()
    again.add_init_script(HOLDS_THE_FIRST_WELCOME)
    again.goto(f"http://{table.address}/")
    again.wait_for_function("() => globalThis.letGo")
    again.click("#return")
    again.evaluate("letGo()")
    again.wait_for_selector("#send:not([disabled])")
    assert room_of(again) == room


def test_a_replay_is_scrubbed_and_taken_over(open_page, table):
    page = open_page()
    room = play_through(page, "5")
    page.click("#recording")
    page.wait_for_selector("#scrubber", state="visible")
    page.locator("#moment").fill("90")
    expect(page.locator("#clock")).to_have_text("0:03 of 0:05")
    page.click("#take-over")
    expect(page.locator("#ready")).to_be_visible()  # the room has opened: what comes next was true of the replay, too
    expect(page.locator("#ready")).to_have_text("I am ready")
    expect(page.locator("#arena")).to_have_attribute("data-tick", "90")  # the board is in view while one decides
    expect(page.locator("#time")).to_have_text("0:03")
    card, arena = (page.locator(name).bounding_box() for name in ("#card", "#arena"))
    assert card["y"] >= arena["y"] + arena["height"]
    page.click("#ready")
    page.wait_for_selector("#recording", state="visible")
    taken = Recording.read(recordings(table, room_of(page))[0])
    assert taken.header.origin.recording == recordings(table, room)[0].name
    assert taken.header.origin.tick == 90 and Playback(taken).verify().verified


def test_two_policies_are_watched(open_page):
    def players(page):
        return page.locator("#create label:has(#player, #opponent):visible").evaluate_all(
            "labels => labels.map((label) => label.childNodes[0].textContent.trim())"
        )

    def watch(page, time_limit):
        open_form(page)
        expect(page.locator("#player")).to_be_hidden()
        for side, names in {
            "blue": ["Red, the opponent"],
            "red": ["Blue, the opponent"],
            "watch": ["Red", "Blue"],
        }.items():
            page.select_option("#side", side)
            assert players(page) == names
        page.select_option("#player", "noise")
        choose_time_limit(page, time_limit)
        page.click("#create button[type=submit]")
        expect(page.locator("#red-who")).to_have_text("noise")
        page.click("#ready")

    page = open_page()
    watch(page, "")
    expect(page.locator("#cover")).to_be_hidden()
    expect(page.locator("#send")).to_be_hidden()
    expect(page.locator("#leave")).to_be_visible()
    page = open_page()
    watch(page, "1")
    expect(page.locator("#cover-text")).to_contain_text("A draw")
    expect(page.locator("#ready")).to_have_text("Play again")


# --- how it looks ---------------------------------------------------------------------------------


def test_it_fits_a_phone(open_page):
    page = open_page(width=360, height=640)
    begin(page, "uniform")
    arena = page.locator("#arena").bounding_box()
    assert min(arena["width"], arena["height"]) >= 340
    size = page.evaluate("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]")
    assert size == [360, 640], "nothing to scroll"
    for name in ("attract", "repel", "erase", "send", "undo", "spread", "width"):
        box = page.locator(f"#{name}").bounding_box()
        assert min(box["height"], box["width"]) >= 44, name
        assert box["y"] >= 640 * 2 / 3 and box["y"] + box["height"] <= 640, name
    wide = open_page(width=740, height=360)
    begin(wide, "uniform")
    arena = wide.locator("#arena").bounding_box()
    assert arena["width"] >= 340 and arena["y"] + arena["height"] <= 360
    assert wide.locator("#send").bounding_box()["y"] < 360 - 44


OVERLAPPING = """() => {
  const inked = one => {  // boxes end where they should, their words where they do
    const range = document.createRange(), own = one.getBoundingClientRect();
    range.selectNodeContents(one);
    const words = range.getBoundingClientRect(), all = one.matches("button") || !words.width ? [own] : [own, words];
    return {left: Math.min(...all.map(box => box.left)), right: Math.max(...all.map(box => box.right)),
      top: own.top, bottom: own.bottom, width: own.width};
  };
  const shown = [...document.querySelectorAll("#scores button, .score > :first-child, #time, .row button, .row label")]
    .map(one => [one.id || one.textContent.trim(), inked(one)]).filter(([, box]) => box.width);
  return shown.flatMap(([name, a], i) => shown.slice(i + 1).filter(([, b]) =>
    a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1)
    .map(([other]) => `${name} and ${other}`));
}"""
"""Names what lies over something else."""


@pytest.mark.parametrize(("width", "height"), [(320, 640), (390, 844), (800, 500), (1280, 800)])
def test_nothing_lies_over_anything_else(open_page, width, height):
    page = open_page(width=width, height=height)
    begin(page, "uniform")
    page.click("#shelf")
    assert page.evaluate(OVERLAPPING) == []


def test_axe_finds_nothing(open_page):
    def check(page, where):
        found = Axe().run(page).response
        violations = [(entry["id"], [node["html"] for node in entry["nodes"]]) for entry in found["violations"]]
        assert not violations, f"{where}: {violations}"
        # Contrast of what lies over a canvas cannot be computed; it is tested by its colours, below.
        unclear = {entry["id"] for entry in found["incomplete"]}
        assert unclear <= {"color-contrast"}, f"{where}: {unclear}"

    page = open_page()
    check(page, "start")
    open_form(page)
    page.click("#recorded summary")
    page.click("#all-opponents")
    check(page, "start, with all of it")
    begin(page, "uniform")
    check(page, "table")
    page = open_page()
    play_through(page, "2")
    check(page, "result")
    page.click("#recording")
    page.wait_for_selector("#scrubber", state="visible")
    check(page, "replay")
    lesson = open_page()
    lesson.click("#start-lesson")
    lesson.wait_for_selector("#step", state="visible")
    check(lesson, "lesson, held")
    lesson.click("#lesson-next")
    lesson.wait_for_selector("#send:not([disabled])")
    check(lesson, "lesson")


def test_the_page_is_light_and_what_a_game_by_drawing_does_not_need_comes_later(open_page):
    page = open_page()
    begin(page)
    Hand(page).draw((0.2, 0.2), (0.4, 0.2))
    names = page.evaluate("performance.getEntriesByType('resource').map(({ name }) => name.split('/').at(-1))")
    sizes = {path.name: path.stat().st_size for path in STATIC.iterdir()}
    loaded = {"index.html", "icon.svg", *names} & set(sizes)  # which not every browser fetches
    assert sum(sizes[name] for name in loaded) < 150_000
    later = {"climb.js", "embed.js", "lesson.js", "marks.js", "replay.js", "responses.js", "stick.js"}
    of_others = {"jspsych-plugin-swarm-pz.js", "monitor.html", "monitor.js", "study.css", "study.html", "study.js"}
    assert set(sizes) - loaded == later | of_others
