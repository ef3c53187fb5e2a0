"""Tests in a real browser, on one server, each in its own rooms; `static/*.test.js` test the logic."""

import json
from itertools import cycle

import pytest
from playwright.sync_api import expect

from swarm_pz.play.protocol import CapturedMessage, InForceMessage, SeatCommand
from swarm_pz.play.recordings.recording import Recording
from tests.kernels.compiled import make
from tests.play.conftest import Table
from tests.play.pages import (
    INK,
    Hand,
    begin,
    check_axe,
    check_places,
    commands,
    eventually,
    heights,
    latest,
    open_form,
    open_room,
    room_of,
    wait_for_play,
    write_experiment,
)

pytestmark = pytest.mark.browser
SYSTEMS = ("ergodic", "formation")
SIZES = [(320, 640), (390, 844), (1366, 768), (800, 500)]


@pytest.fixture(scope="module")
def table(tmp_path_factory, lab):
    """Give a server that most tests share; the lab's pages may embed its page in frames."""
    for kind in ("paper", "variants"):  # else the first game of each waits for a compiler
        make(kind)
    server = Table(tmp_path_factory.mktemp("games"), "--embed", lab[1])
    yield server
    server.end()


def text_of(page, name):
    return page.locator(f"#{name}")


# --- commands -------------------------------------------------------------------------------------


def test_each_kind_of_command_is_given_by_touch(open_page, table):
    page = open_page(has_touch=True, is_mobile=True, width=390, height=844)
    hand = Hand(page, touch=True)
    for system in SYSTEMS:
        room = begin(page, red_system=system)
        if system == SYSTEMS[0]:
            page.click("#shelf")
        check_places(page, system)
        hand.draw((0.7, 0.7), (0.8, 0.8))
        command = commands(page, table, room, 1)[0]
        assert command.strokes if system == "ergodic" else command.command
        eventually(page, lambda: latest(table, room, InForceMessage))  # noqa: B023
        if system != SYSTEMS[-1]:
            page.click("#leave")
    focused = "getComputedStyle(document.getElementById('arena')).outlineStyle"
    assert page.evaluate(focused) == "none", "a finger needs no frame"
    page.keyboard.press("ArrowUp")
    assert page.evaluate(focused) == "solid"


def test_a_whole_game_by_keys(open_page, table):
    page = open_page(width=1000, height=700)

    def tab_to(selector):
        for _ in range(60):
            if page.evaluate("selector => document.activeElement?.matches(selector)", selector):
                return
            page.keyboard.press("Tab")
        raise AssertionError(f"{selector} cannot be reached by keys")

    tab_to("#more summary")
    page.keyboard.press("Enter")
    tab_to("#opponent")
    page.keyboard.type("nobody")
    tab_to("#create button[type=submit]")
    page.keyboard.press("Enter")
    room = room_of(page)
    expect(text_of(page, "ready")).to_be_focused()
    page.keyboard.press("Enter")
    wait_for_play(page)
    expect(text_of(page, "arena")).to_be_focused()
    for key in ("k", "g", "+", "Shift+ArrowRight", "Space", "Shift+ArrowUp", "Shift+ArrowLeft", "Space"):
        page.keyboard.press(key)
    (command,) = commands(page, table, room, 1)
    (stroke,) = command.strokes
    assert stroke.brush == "attract" and stroke.width == pytest.approx(0.12) and len(stroke.points) == 3
    page.keyboard.press("c")
    expect(text_of(page, "told")).to_have_text("Sent: spread out")
    page.keyboard.press("?")
    expect(text_of(page, "close-legend")).to_be_focused()
    page.keyboard.press("Enter")
    expect(text_of(page, "arena")).to_be_focused()  # closing the legend returns the focus
    page.keyboard.press("u")
    assert len(commands(page, table, room, 3)[-1].strokes) == 1


# --- with others ----------------------------------------------------------------------------------


def test_two_people_meet_by_a_link_play_and_part_while_others_look_on(open_page, visit, table):
    page = open_page(width=1000, height=700)
    room = open_room(page, "")
    page.fill("#label", "Ann")
    link = text_of(page, "invitation-link").input_value()
    assert link == f"http://{table.address}/#room={room}"
    eventually(page, lambda: page.locator("#invitation-code").evaluate("image => image.naturalWidth > 0"))
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.click("#copy")
    expect(text_of(page, "copy")).to_have_text("Copied")
    assert page.evaluate("navigator.clipboard.readText()") == link
    watcher = visit(table.address)
    watcher.fill("#code", room.lower())
    watcher.click("#look-on")
    expect(text_of(watcher, "cover-text")).to_have_text("You watch. The blue seat is free.")
    other = visit(link.replace(room, room.lower()))
    expect(text_of(other, "red-seat")).to_have_text("red: Ann, not ready yet")
    expect(text_of(page, "blue-seat")).to_have_text("blue: a person, not ready yet")
    page.click("#ready")
    expect(text_of(other, "cover-text")).to_have_text("Ann is ready. The game begins when you are.")
    other.click("#ready")
    for one, y in ((page, 0.9), (other, 0.1)):  # far apart, so that no capture ends the game
        wait_for_play(one)
        Hand(one).draw((0.3, y), (0.7, y))
    eventually(page, lambda: {line.team for line in latest(table, room, SeatCommand)} == {0, 1})
    expect(text_of(watcher, "watching")).to_have_text("You watch: both seats are taken.")
    eventually(watcher, lambda: watcher.locator("#arena").get_attribute("data-tick"))
    expect(text_of(watcher, "controls")).to_be_hidden()
    other.click("#leave")
    other.click("#leave-now")
    expect(text_of(other, "lobby")).to_be_visible()
    expect(text_of(page, "silence")).to_contain_text("Your opponent has left for good")
    other.goto(link)
    expect(text_of(other, "watching")).to_contain_text("the blue seat was given up for good")
    page.reload()
    wait_for_play(page)
    page.click("#leave")  # not asked to confirm: the opponent has left
    expect(text_of(page, "lobby")).to_be_visible()


# --- coming back ----------------------------------------------------------------------------------


def test_a_page_that_was_closed_returns_to_its_seat_with_what_it_saved(open_page, table):
    page = open_page()
    room = begin(page)
    Hand(page).draw((0.2, 0.3), (0.4, 0.3))  # sent when the hand is lifted
    assert commands(page, table, room, 1)[0].timing.drawing_ms > 0
    eventually(page, lambda: page.evaluate(INK) == 0)  # the ink fades once the command is in force
    page.keyboard.press("s")
    expect(text_of(page, "told")).to_have_text("Saved as 1")
    context = page.context
    page.close()
    again = context.new_page()
    again.goto(f"http://{table.address}/")
    again.click("#return")
    wait_for_play(again)
    assert room_of(again) == room
    expect(text_of(again, "red-who")).to_have_text("(you)")
    expect(again.locator("#saved li")).to_have_count(1)  # the browser may still be writing what the closed page kept
    again.keyboard.press("1")
    assert heights(commands(again, table, room, 2)) == [[0.3], [0.3]]
    another = context.new_page()
    another.goto(f"http://{table.address}/#room={room}")
    wait_for_play(another)
    expect(text_of(again, "says")).to_contain_text("taken over")
    again.reload()
    wait_for_play(again)
    expect(text_of(another, "says")).to_contain_text("taken over")


def test_a_running_game_is_not_left_by_a_slip(open_page):
    page = open_page(width=1000, height=700)
    expect(page.locator("[data-opponent=centre]")).to_be_disabled()  # locked until the opponent before it is beaten
    page.click("#quick")
    wait_for_play(page)
    room = room_of(page)
    for stays in (True, False):
        page.evaluate("history.back()")  # go_back does nothing while the browser has not noted the page's entries yet
        expect(text_of(page, "leaving")).to_be_visible()
        assert room_of(page) == room
        expect(text_of(page, "stay")).to_be_focused()
        page.click("#stay" if stays else "#leave-now")
        expect(text_of(page, "leaving")).to_be_hidden()
        expect(text_of(page, "table")).to_be_visible(visible=stays)
    expect(text_of(page, "quick")).to_be_focused()


# --- every view -----------------------------------------------------------------------------------


def views(page):
    """Open the page's views in turn, and yield their names."""
    open_form(page)
    page.click("#recorded summary")
    yield "start"
    page.click("#start-signs")
    yield "signs"
    page.click("#close-legend")
    page.click("#invite-somebody")
    expect(text_of(page, "invitation")).to_be_visible()
    yield "waiting"
    page.click("#practise")
    expect(text_of(page, "practice")).to_be_visible()
    yield "practice"
    page.click("#practice-stop")
    page.click("#go-home")
    page.click("#start-lesson")
    expect(text_of(page, "step")).to_be_visible()
    yield "lesson, held"
    page.click("#lesson-next")
    wait_for_play(page)
    yield "lesson"
    page.click("#leave")
    begin(page, red_system="formation")  # no opponent, so the game does not end
    page.click("#shelf")
    yield "formation"
    page.evaluate("document.getElementById('leaving').showModal()")
    yield "leaving"
    page.click("#stay")
    page.click("#leave")
    begin(page, red_system="ergodic")
    Hand(page).draw((0.2, 0.3), (0.4, 0.3))
    page.click("#save")
    yield "playing"
    page.click("#leave")
    open_room(page, "uniform", "2")
    page.click("#ready")
    expect(page.locator("#recording")).to_be_visible()
    yield "result"
    page.click("#share")
    expect(text_of(page, "sharing")).to_be_visible()
    yield "sharing"
    page.click("#close-sharing")
    page.click("#recording")
    expect(text_of(page, "scrubber")).to_be_visible()
    yield "replay"
    expect(text_of(page, "arena")).to_be_focused()
    page.keyboard.press("Space")
    expect(text_of(page, "hold")).to_have_text("Play")
    page.goto(page.url.split("#")[0] + "#room=ZZZZ")
    expect(text_of(page, "says")).to_contain_text("no room ZZZZ")


def test_every_view_fits_every_screen_and_axe_finds_no_fault(open_page):
    page = open_page()
    for where, scheme in zip(views(page), cycle(["light", "dark"])):
        lowest = [(320, 568)] if where in ("practice", "lesson", "formation") else []  # the board shrinks for these
        for width, height in lowest + SIZES:
            page.set_viewport_size({"width": width, "height": height})
            check_places(page, f"{where}, {width} wide")
        check_axe(page, where, scheme)  # at the last size only; `test_static` tests the contrast of text in both


# --- in an experiment -----------------------------------------------------------------------------

RUN = """
  jsPsych.pluginAPI.setTimeout = (act) => { window.finish = act; };  // the result stays as long as one looks at it
  jsPsych.run([{ type: jsPsychSwarmPz, table: "TABLE", ...TRIAL }]);"""
SPREAD = "setInterval(() => document.querySelector('#spread:enabled')?.click(), 20)"
"""Sends one command as soon as the game runs; the page does not send the same again."""


@pytest.fixture
def experiment(visit, lab, table):
    """Give a function that opens an experiment of one trial, by any host name of the lab's server."""
    folder, address = lab

    def begin(name="127.0.0.1", **trial):
        served = f"http://{table.address.replace('localhost', '127.0.0.1')}"
        write_experiment(folder, served, RUN.replace("TABLE", served).replace("TRIAL", json.dumps(trial)))
        return visit(address.replace("127.0.0.1", name) + "/index.html", width=1280, height=800, script=SPREAD)

    return begin


def row_of(page):
    """Return the trial's row when the experiment is over."""
    page.wait_for_function("window.rows")
    (row,) = page.evaluate("window.rows")
    return row


def test_a_trial_is_a_game_and_returns_its_row(experiment, table):
    settings = {"time_limit": 4, "speed": 2, "blue_system": "ergodic"}
    page = experiment(opponent="ring", seat="blue", seed=41, settings=settings, load_timeout=1e6)
    page.wait_for_selector("iframe")
    frame = page.frame_locator("iframe").first
    expect(frame.locator("#table")).to_have_attribute("data-phase", "over")
    for name in ("leave", "go-home", "recording"):
        expect(frame.locator(f"#{name}")).to_be_hidden()
    page.wait_for_function("'finish' in window")
    page.evaluate("finish()")
    row = row_of(page)
    recording = Recording.read(table.folder / row["recording"])
    assert row["trial_type"] == "swarm-pz" and row["error"] is None
    outcome = {"draw": "draw", "blue": "win", "red": "loss"}[recording.end.outcome]
    assert (row["outcome"], row["seconds"]) == (outcome, recording.end.tick / 30)
    assert (row["opponent"], row["side"], row["seed"], row["commands"]) == ("ring", "blue", 41, 1)
    taken = [capture.team for capture in recording.of(CapturedMessage)]
    assert (row["captured"], row["lost"]) == (taken.count(1), taken.count(0))
    assert recording.header.seed == 41 and recording.header.red.policy == "ring"
