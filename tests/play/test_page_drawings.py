"""The page's library of drawings in a real browser, and automatic responses."""

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from swarm_pz.play.recordings.format import CommandLine
from tests.play.test_page import Hand, begin, commands, eventually, latest

pytestmark = pytest.mark.browser
expect.set_options(timeout=30_000)


def open_tools(page):
    if page.locator("#library").is_hidden():
        page.click("#shelf")
    page.click("#manage")


# --- the library ----------------------------------------------------------------------------------


def test_a_saved_drawing_survives_a_reload_and_is_sent_at_a_tap_or_by_its_digit(open_page, table):
    page = open_page(width=390, height=844)
    room = begin(page)
    eventually(page, lambda: page.keyboard.press("4") or page.inner_text("#told") == "Nothing is saved as 4")
    page.keyboard.press("s")
    expect(page.locator("#told")).to_have_text("Draw something first")
    for i, y in enumerate((0.3, 0.7)):
        Hand(page).draw((0.2, y), (0.4, y))
        commands(page, table, room, i + 1)
        page.keyboard.press("s")
        expect(page.locator("#told")).to_have_text(f"Saved as {i + 1}")
    page.reload()
    expect(page.locator("#send")).to_be_enabled()
    page.click("#shelf")
    page.locator("#saved button").first.click()
    expect(page.locator("#told")).to_have_text("Sent: Drawing 1")
    commands(page, table, room, 3)
    page.focus("#arena")
    page.keyboard.press("2")
    expect(page.locator("#told")).to_have_text("Sent: Drawing 2")
    assert commands(page, table, room, 4) == [[0.3], [0.7], [0.3], [0.7]]
    page.click("#undo")
    assert commands(page, table, room, 5)[-1] == [0.3]


@pytest.mark.parametrize(("width", "height"), [(320, 640), (360, 640), (390, 844), (800, 500), (1280, 800)])
def test_the_library_has_room_on_every_screen(width, height, open_page):
    page = open_page(width=width, height=height)
    begin(page)
    page.click("#shelf")
    expect(page.locator("#none-saved")).to_be_visible()
    for name in ("save", "manage", "shelf", "send"):
        box = page.locator(f"#{name}").bounding_box()
        assert min(box["width"], box["height"]) >= 44, name
        assert box["x"] + box["width"] <= width and box["y"] + box["height"] <= height, name
    reach = page.evaluate("['scrollWidth', 'scrollHeight'].map((side) => document.getElementById('table')[side])")
    assert reach == [width, height]
    Hand(page).draw((0.2, 0.3), (0.4, 0.3))
    page.click("#save")
    expect(page.locator("#saved button")).to_have_count(1)
    page.click("#manage")
    assert page.locator("#tools").evaluate("tools => tools.scrollWidth <= tools.clientWidth")
    if width in (390, 1280):
        found = Axe().run(page).response["violations"]
        assert not found, found


# --- automatic responses --------------------------------------------------------------------------


def respond(page, when, number, what):
    """Add an automatic response by the form, and go back to the game."""
    open_tools(page)
    page.select_option("#rule-when", when)
    page.fill("#rule-number", number)
    page.select_option("#rule-do", label=what)
    page.click("#rule-add")
    expect(page.locator("#rules li")).not_to_have_count(0)
    page.click("#close-tools")


def senders(table, room):
    return {line.sender for line in latest(table, room, CommandLine)}


def test_a_response_acts_is_shown_is_recorded_as_such_and_is_stopped_by_one_tap(open_page, table):
    page = open_page(width=390, height=844)
    room = begin(page)
    respond(page, "silent_s", "0.5", "ring")
    expect(page.locator("#acting-text")).to_have_text("ring acts for you")
    eventually(page, lambda: "auto:ring" in senders(table, room))
    found = Axe().run(page).response["violations"]
    assert not found, found
    page.reload()
    expect(page.locator("#acting-text")).to_have_text("ring acts for you")
    page.click("#acting-stop")
    expect(page.locator("#acting")).to_be_hidden()
    expect(page.locator("#arena")).to_be_focused()
    open_tools(page)
    expect(page.locator("#rules li")).to_have_count(0)
