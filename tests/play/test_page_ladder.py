"""The ladder as people climb it: a code, a level, a game, and the level again."""

import json
import re

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from swarm_pz.play import protocol
from swarm_pz.play.climbers import TABLE, Climber
from tests.play.conftest import Table, new_page
from tests.play.test_page import room_of

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def ladder(tmp_path_factory):
    """Give a table with a ladder."""
    server = Table(tmp_path_factory.mktemp("games"), "--ladder")
    yield server
    server.end()


@pytest.fixture
def visit(chromium, ladder):
    """Give a function that opens the ladder's page on a device of its own."""
    contexts, faults = [], []

    def open_(address="#ladder", width=390, height=800):
        page = new_page(chromium, width, height)
        contexts.append(page.context)
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(f"http://{ladder.address}/{address}")
        return page

    yield open_
    for context in contexts:
        context.close()
    assert not faults


def show_level(page, code):
    page.wait_for_selector("#climber-system option", state="attached")
    page.fill("#climber-code", code)
    page.click("#climber button")
    page.wait_for_selector("#reached", state="visible")


def leave(page):
    """Leave a running game for good."""
    page.wait_for_selector("#table[data-phase=playing]")  # one that counts down is left without a question
    page.click("#leave")
    expect(page.locator("#leaving-counts")).to_be_visible()
    page.click("#leave-now")


def test_the_start_leads_to_the_ladder_and_back(visit):
    page = visit("")
    page.click("#start-ladder")
    expect(page.locator("#climber-code")).to_be_focused()
    assert page.locator("#climber-system").bounding_box()["width"] > 250  # what flies can be read
    page.click("#ladder-home")
    expect(page.locator("#start-ladder")).to_be_visible()


def test_somebody_plays_leaves_and_finds_the_level_again(visit, ladder):
    page = visit()
    show_level(page, "P01")
    expect(page.locator("#reached-text")).to_have_text(re.compile("^No game yet"))
    page.click("#climb:has-text('Play against uniform, as red')")
    page.wait_for_selector("#cover", state="hidden")
    leave(page)
    expect(page.locator("#reached-text")).to_have_text(
        re.compile("Your level is [0-9]+ after 1 game; it is likely between")
    )
    expect(page.locator("#climb")).to_have_text(re.compile("as blue$"))
    other = visit()
    show_level(other, "P01")
    assert other.locator("#reached-text").inner_text() == page.locator("#reached-text").inner_text()
    (game,) = Climber(ladder.folder / "levels", "P01").games
    assert (game.outcome, game.ended_by) == ("loss", "left")
    assert "P01,ergodic,1,0,0,1,1" in (ladder.folder / "levels" / TABLE).read_text()


def test_after_a_game_one_sees_the_level_and_goes_on_from_there(visit, ladder):
    """The table's messages of a game's end are told to the page, which waits for none of five minutes."""
    page = visit("")
    sockets, rooms, ended = [], [], []

    def between(socket):
        def forward(message):
            if isinstance(message, str) and '"type":"room"' in message:
                if ended:
                    return  # the table, where the game goes on, would say so
                rooms.append(json.loads(message))
            socket.send(message)

        sockets.append(socket)
        socket.connect_to_server().on_message(forward)

    page.route_web_socket("**/socket", between)
    page.goto(f"http://{ladder.address}/#ladder")
    page.reload()
    show_level(page, "P02")
    page.click("#climb")
    page.wait_for_selector("#send:not([disabled])")
    room = room_of(page)
    other = ladder.visit()  # somebody of the same code, elsewhere
    other.say(protocol.Climb("P02"))
    assert room in other.hear(protocol.Refused).reason
    other.say(protocol.AskLevel("P02"))
    level = json.loads(protocol.encode(other.hear(protocol.Level)))
    other.close()
    ended.append(True)
    sockets[-1].send(json.dumps(rooms[-1] | {"phase": "over", "outcome": "red", "recording": "a.jsonl"}))
    sockets[-1].send(json.dumps(level | {"level": 1212.4, "low": 690.0, "high": 1780.0, "games": 1, "last": "win"}))
    expect(page.locator("#reached-now")).to_have_text(
        "Your level is 1212 after 1 game; it is likely between 690 and 1780."
    )
    for name in ("ready", "swap", "sit"):
        expect(page.locator(f"#{name}")).to_be_hidden()
    page.click("#go-home:has-text('Go on')")
    page.wait_for_selector("#reached", state="visible")


def test_who_says_what_is_no_code_is_told_and_asks_again(visit, ladder):
    (ladder.folder / "levels").mkdir(exist_ok=True)
    (ladder.folder / "levels" / "P09.jsonl").write_text("nonsense\n")
    page = visit()
    page.wait_for_selector("#climber-system option", state="attached")
    page.fill("#climber-code", "../P01")
    assert page.locator("#climber").evaluate("form => !form.checkValidity()")
    page.fill("#climber-code", "P09")
    page.click("#climber button")
    expect(page.locator("#says")).to_have_text(re.compile(r"line 1 of P09\.jsonl is corrupt"))
    show_level(page, "P03")


def test_a_level_outlives_the_server(chromium, tmp_path):
    table = Table(tmp_path, "--ladder")
    client = table.visit()
    client.say(protocol.Climb("P01"))
    client.hear(protocol.Seated)
    client.say(protocol.Ready())
    client.hear(protocol.RoomState, lambda room: room.phase == "playing")
    client.say(protocol.Leave())
    client.say(protocol.AskLevel("P01"))
    level = client.hear(protocol.Level)
    table.kill()
    again = Table(tmp_path, "--ladder")
    visitor = again.visit()
    visitor.say(protocol.AskLevel("P01"))
    assert visitor.hear(protocol.Level) == level
    visitor.close()
    again.end()


def test_a_table_without_a_ladder_says_so(open_page):
    page = open_page("#ladder")
    expect(page.locator("#says")).to_have_text("There is no ladder at this table.")
    expect(page.locator("#quick")).to_be_visible()
    expect(page.locator("#start-ladder")).to_be_hidden()


@pytest.mark.parametrize("width", [390, 1280])
def test_axe_finds_nothing_on_the_ladder(width, visit):
    page = visit(width=width)
    show_level(page, "P04")
    found = Axe().run(page).response
    assert not [(entry["id"], [node["html"] for node in entry["nodes"]]) for entry in found["violations"]]
    assert {entry["id"] for entry in found["incomplete"]} <= {"color-contrast"}
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
