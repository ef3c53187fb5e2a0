"""The page's library of drawings in a real browser, and automatic responses."""

import json

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from swarm_pz.play.recordings.format import CommandLine
from tests.play.test_page import Hand, begin, commands, eventually, latest

pytestmark = pytest.mark.browser
expect.set_options(timeout=30_000)
STORE = "swarm-pz.drawings"


def drawing(name="Line", kind="strokes", **stroke):
    """Return a drawing as a file holds it."""
    return {
        "name": name,
        "kind": kind,
        "strokes": [{"brush": "attract", "width": 0.1, "points": [[0.5, 0.5]]} | stroke],
    }


def import_(page, content):
    """Give the page a file of drawings, and return what it says."""
    text = content if isinstance(content, str) else json.dumps({"format": "swarm-pz.drawings.v1", "drawings": content})
    page.locator("#imported").evaluate("said => { said.textContent = ''; }")
    page.locator("#file").set_input_files({"name": "d.json", "mimeType": "application/json", "buffer": text.encode()})
    expect(page.locator("#imported")).not_to_be_empty()
    return page.inner_text("#imported")


def open_tools(page):
    if page.locator("#library").is_hidden():
        page.click("#shelf")
    page.click("#manage")


def names(page):
    return page.locator("#drawings input").evaluate_all("fields => fields.map(field => field.value)")


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


def test_a_drawing_is_named_and_deleted_and_its_name_is_text_alone(open_page):
    page = open_page()
    begin(page)
    for y in (0.3, 0.7):
        Hand(page).draw((0.2, y), (0.4, y))
        page.keyboard.press("s")
    expect(page.locator("#saved button")).to_have_count(2)
    open_tools(page)
    name = page.locator("#drawings input").first
    name.fill("<b>left‮</b>")
    name.press("Tab")
    expect(page.locator("#drawings button").first).to_have_attribute("aria-label", "Delete <b>left </b>")
    assert page.locator("#drawings b, #saved b").count() == 0
    page.locator("#drawings button").first.click()
    expect(page.locator("#drawings button")).to_have_count(1)
    assert names(page) == ["Drawing 2"]
    expect(page.locator("#close-tools")).to_be_focused()


def test_no_more_are_saved_than_there_are_digits(open_page):
    page = open_page()
    begin(page)
    Hand(page).draw((0.2, 0.3), (0.4, 0.3))
    page.click("#shelf")
    for _ in range(9):
        page.click("#save")
    expect(page.locator("#saved button")).to_have_count(9)
    page.click("#save")
    expect(page.locator("#told")).to_have_text("9 are saved: delete one first")
    expect(page.locator("#saved button")).to_have_count(9)


def test_drawings_are_exported_and_come_back_in_another_browser(open_page):
    page = open_page()
    begin(page)
    Hand(page).draw((0.2, 0.3), (0.4, 0.3))
    page.keyboard.press("s")
    open_tools(page)
    with page.expect_download() as download:
        page.click("#export")
    text = download.value.path().read_text()
    (entry,) = json.loads(text)["drawings"]
    assert download.value.suggested_filename == "drawings.json" and entry["strokes"][0]["brush"] == "attract"
    other = open_page()
    begin(other)
    open_tools(other)
    assert import_(other, text) == "1 of 1 drawings added."
    assert import_(other, text) == "0 of 1 drawings added.", "it is there already"
    assert names(other) == ["Drawing 1"]
    assert json.loads(other.evaluate(f"localStorage.getItem('{STORE}')")) == [entry]


@pytest.mark.parametrize(
    "content",
    [
        "no JSON",
        json.dumps([drawing()]),
        [None, 3, "drawing", []],
        [drawing(width=7), drawing(brush="constructor"), drawing(points=[]), drawing(points=[[0.5, 1e9]])],
        [
            drawing(points=[[0.5, "0.5"]]),
            drawing(points=[[0.5, 0.5]] * 4001),
            drawing(kind={}),
            drawing(kind="leaders"),
        ],
        [drawing(brush={"toString": 1}), drawing(brush=["attract"])],
        [{"name": "None", "kind": "strokes", "strokes": []}, {"name": "Null", "kind": "strokes", "strokes": [None]}],
    ],
)
def test_what_is_no_drawing_is_not_imported(content, open_page):
    page = open_page()
    begin(page)
    open_tools(page)
    assert import_(page, content).startswith("0 of ")
    assert names(page) == []


def test_of_a_file_as_many_are_taken_as_there_is_room_for_and_only_what_is_known(open_page):
    page = open_page()
    begin(page)
    open_tools(page)
    entries = [drawing(f"{'n' * 60}{i}", points=[[i / 20, 0.5]], more="x") for i in range(12)]
    entries[0]["name"] = {"toString": 1}
    assert import_(page, entries) == "9 of 12 drawings added."
    kept = json.loads(page.evaluate(f"localStorage.getItem('{STORE}')"))
    assert kept[0]["name"] == "Drawing" and {len(one["name"]) for one in kept[1:]} == {40}
    assert {*kept[0]["strokes"][0]} == {"brush", "width", "points"}


@pytest.mark.parametrize("kept", ["{", "3", "[[]]", '{"length": 1e9}', '[{"kind": "strokes", "strokes": 3}]'])
def test_a_broken_store_is_an_empty_library(kept, open_page):
    page = open_page()
    page.evaluate("([key, kept]) => localStorage.setItem(key, kept)", [STORE, kept])
    page.reload()
    begin(page)
    Hand(page).draw((0.2, 0.3), (0.4, 0.3))
    page.keyboard.press("s")
    expect(page.locator("#told")).to_have_text("Saved as 1")


def test_a_browser_that_keeps_nothing_says_so_and_the_game_goes_on(open_page, table):
    page = open_page()
    page.evaluate(
        "() => { Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError'); }; }"
    )
    room = begin(page)
    Hand(page).draw((0.2, 0.3), (0.4, 0.3))
    page.keyboard.press("s")
    expect(page.locator("#told")).to_have_text("Saved as 1, until this page closes: the browser keeps no more")
    commands(page, table, room, 1)
    page.keyboard.press("1")
    assert commands(page, table, room, 2) == [[0.3], [0.3]]


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
    room = begin(page, "uniform")
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


def test_a_saved_drawing_is_sent_when_its_condition_holds(open_page, table):
    page = open_page(width=390, height=844)
    room = begin(page, "uniform")
    Hand(page).draw((0.2, 0.3), (0.4, 0.3))
    page.keyboard.press("s")
    expect(page.locator("#told")).to_have_text("Saved as 1")
    respond(page, "fewer", "200", "Drawing 1")
    expect(page.locator("#acting-text")).to_have_text("Drawing 1 acts for you")
    eventually(page, lambda: "auto:saved" in senders(table, room))


def test_responses_are_listed_in_words_and_removed_and_no_more_are_added_than_a_seat_may_have(open_page):
    page = open_page(width=390, height=844)
    begin(page)
    open_tools(page)
    for when, number in (("fewer", "4"), ("nobody_within", "0.2"), ("silent_s", "5")):
        page.select_option("#rule-when", when)
        expect(page.locator("#rule-number")).to_have_value(number)
        page.select_option("#rule-do", "uniform")
        page.click("#rule-add")
    said = ["fewer than 4 drones: uniform", "nobody within 0.2: uniform", "nothing sent for 5 s: uniform"]
    expect(page.locator("#rules li")).to_contain_text(said)
    for _ in range(5):
        page.click("#rule-add")
    expect(page.locator("#rules li")).to_have_count(8)
    expect(page.locator("#rules li").last).to_contain_text(said[-1])  # what was chosen stays chosen
    expect(page.locator("#rule-add")).to_be_disabled()
    offered = page.locator("#rule-do option").evaluate_all("options => options.map(({ value }) => value)")
    assert "ring" in offered and "besiege" not in offered, "it answers other commands"
    page.locator("#rules button").first.click()
    expect(page.locator("#rules li")).to_have_count(7)
    expect(page.locator("#close-tools")).to_be_focused()
    expect(page.locator("#rules-fault")).to_be_empty()
