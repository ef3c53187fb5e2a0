"""The board of the page in a real browser: what is seen of a game, and how it is steered."""

import re

import pytest
from playwright.sync_api import expect

from tests.play.test_page import INK, Hand, begin, commands, eventually, play_through, room_of

pytestmark = pytest.mark.browser


# --- playing --------------------------------------------------------------------------------------


def test_what_is_drawn_is_sent_when_the_hand_is_lifted_and_its_ink_goes_when_the_swarm_follows(open_page, table):
    page = open_page(width=1000, height=700)
    room = begin(page)
    expect(page.locator("#on-lift")).to_be_checked()
    hand = Hand(page)
    hand.draw((0.2, 0.2), (0.4, 0.2))
    page.click("#send")  # a second time says nothing new
    assert commands(page, table, room, 1) == [[0.2]]
    page.wait_for_selector("#arena[data-target='1']")
    eventually(page, lambda: page.evaluate(INK) == 0)
    hand.draw((0.2, 0.8), (0.4, 0.8))
    assert commands(page, table, room, 2) == [[0.2], [0.8]]


def test_undoing_what_was_sent_sends_the_drawing_before_it_and_says_so(open_page, table):
    page = open_page(width=1000, height=700)
    room = begin(page)
    hand = Hand(page)
    for i, y in enumerate((0.2, 0.8)):
        hand.draw((0.2, y), (0.4, y))
        commands(page, table, room, i + 1)
    page.click("#undo")
    expect(page.locator("#told")).to_have_text("Undone: the drawing before was sent")
    commands(page, table, room, 3)
    page.click("#undo")
    expect(page.locator("#told")).to_have_text("Undone: spread out was sent")
    expect(page.locator("#undo")).to_be_disabled()
    assert commands(page, table, room, 4) == [[0.2], [0.8], [0.2], []]


def test_a_seat_is_given_up_only_when_that_is_meant(open_page):
    page = open_page()
    begin(page, "uniform")
    page.click("#leave")
    expect(page.locator("#leaving")).to_be_visible()
    page.keyboard.press("Enter")  # the first choice is to play on
    expect(page.locator("#leaving")).to_be_hidden()
    expect(page.locator("#send")).to_be_enabled()
    page.click("#leave")
    page.click("#leave-now")
    page.wait_for_selector("#lobby", state="visible")
    expect(page.locator("#return")).to_be_hidden()


def test_a_game_ends_with_a_graph_and_the_other_side_is_a_click_away(open_page):
    page = open_page(width=390, height=844)
    room = play_through(page, "2")
    expect(page.locator("#cover-text")).to_have_text(re.compile("won|lost|draw"))
    expect(page.locator("#result-chart")).to_be_visible()
    expect(page.locator("#toast")).to_be_hidden()
    expect(page.locator("#controls")).to_be_hidden()
    expect(page.locator("#go-home")).to_be_visible()
    card, arena = (page.locator(name).bounding_box() for name in ("#card", "#arena"))
    assert card["y"] >= arena["y"] + arena["height"], "the last board is seen whole"
    assert card["y"] + card["height"] <= 844
    page.click("#swap")
    expect(page.locator("#blue-who")).to_have_text("(you)")
    expect(page.locator("#red-who")).to_have_text("uniform")
    page.wait_for_selector("#cover", state="hidden")
    assert room_of(page) != room


def test_a_recorded_game_on_its_way_is_announced_and_can_be_left(open_page):
    page = open_page()
    asked = []

    def withhold(socket):
        server = socket.connect_to_server()
        socket.on_message(lambda text: asked.append(text) if "open_replay" in text else server.send(text))

    page.route_web_socket("**/socket", withhold)
    page.reload()
    page.wait_for_selector("#opponent option", state="attached")
    play_through(page, "2")
    page.click("#recording")
    expect(page.locator("#cover-text")).to_contain_text("Opening the recorded game")
    assert asked, "and it is still on its way"
    for name in ("controls", "ready", "swap", "scrubber"):
        expect(page.locator(f"#{name}")).to_be_hidden()
    page.click("#leave")
    page.wait_for_selector("#lobby", state="visible")


# --- how it looks ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("width", "height"), [(320, 640), (390, 844), (800, 500), (1024, 1366), (1366, 768)])
def test_nothing_hangs_over_the_edge(width, height, open_page):
    page = open_page(width=width, height=height)

    def check(where):
        reach = page.evaluate("['scrollWidth', 'scrollHeight'].map((side) => document.getElementById('table')[side])")
        assert reach == [width, height], where
        over = page.evaluate(
            """() => [...document.querySelectorAll("#table button, #table input, #table a")].filter((one) => {
                const box = one.getBoundingClientRect();
                return box.width && (box.left < 0 || box.right > innerWidth || box.bottom > innerHeight
                    || one.scrollWidth > one.clientWidth + 1);
            }).map((one) => one.id)"""
        )
        assert not over, where

    play_through(page, "1")
    check("over")
    page.click("#recording")
    page.wait_for_selector("#scrubber", state="visible")
    check("replay")
    page.click("#close-replay")
    begin(page, "uniform")
    check("playing")


@pytest.mark.parametrize(("width", "height"), [(360, 640), (800, 500)])
def test_what_is_said_hides_no_score_and_goes_with_its_view(width, height, open_page):
    page = open_page(width=width, height=height)
    begin(page)
    page.evaluate(
        "document.getElementById('says').textContent = 'Something that is long enough to fill a whole line of it'"
    )
    says, scores, clock = (page.locator(f"#{name}").bounding_box() for name in ("says", "scores", "clock"))
    assert says["y"] >= scores["y"] + scores["height"] or says["x"] + says["width"] <= scores["x"]
    assert clock["width"] > 0
    page.click("#leave")
    expect(page.locator("#says")).to_be_empty()
