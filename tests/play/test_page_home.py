"""Around a game: the start, the lesson, rooms that wait, invitations, keys, and the browser's Back."""

import re

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from swarm_pz.play.recordings.format import CommandLine
from tests.play.conftest import Table, new_page
from tests.play.test_page import INK, Hand, begin, choose_time_limit, eventually, latest, open_form, room_of

pytestmark = pytest.mark.browser


def stands_on(page, name):
    """Wait until the keys go there: the page moves the focus with its next painting."""
    expect(page.locator(f"#{name}")).to_be_focused()


def is_playing(page):
    page.wait_for_selector("#cover", state="hidden")
    page.wait_for_selector("#send:not([disabled])")


def guest(page, address):
    """Give somebody else's page, on another device."""
    other = new_page(page.context.browser)
    other.goto(address)
    return other


# --- the start ------------------------------------------------------------------------------------


def test_one_click_plays_the_opponent_on_a_card(open_page):
    page = open_page(width=1366, height=768)
    titles = page.locator("#opponents h3").all_inner_texts()
    assert titles == ["Easy", "Fair", "Hard"]
    assert page.locator(".card:visible").count() == 9
    page.click("#all-opponents")
    assert page.locator(".card:visible").count() > 9
    page.click("[data-opponent=centre]")
    is_playing(page)
    expect(page.locator("#blue-who")).to_have_text("centre")
    expect(page.locator("#red-who")).to_contain_text("(you)")
    page.goto(page.url.split("#")[0])
    expect(page.locator("#quick")).to_have_text("Play against centre")


@pytest.mark.parametrize(("width", "height"), [(1366, 768), (1024, 1366), (390, 844), (320, 640), (800, 500)])
def test_the_start_and_a_waiting_room_overflow_on_no_screen(open_page, width, height):
    page = open_page(width=width, height=height)
    wide = "document.documentElement.scrollWidth"
    open_form(page)
    page.click("#all-opponents")
    assert page.evaluate(wide) == width
    box = page.locator("#quick").bounding_box()
    assert box["y"] + box["height"] <= height, "what begins a game is seen at once"
    page.click("#invite-somebody")
    page.wait_for_selector("#invitation", state="visible")
    cover = page.locator("#cover")
    assert cover.evaluate("cover => cover.scrollWidth <= cover.clientWidth")
    for name in ("ready", "copy", "go-home"):
        page.locator(f"#{name}").scroll_into_view_if_needed()
        box = page.locator(f"#{name}").bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= width and box["height"] >= 44, name


def test_a_name_stays_in_the_browser_and_is_seen_at_the_table(own_table, open_page):
    page = open_page()
    expect(page.locator("#label-hint")).to_contain_text("records")
    page.goto(f"http://{own_table.address}/")
    expect(page.locator("#label-hint")).to_contain_text("stays in this browser")
    page.fill("#label", "Ann")
    page.reload()
    expect(page.locator("#label")).to_have_value("Ann")
    page.click("#invite-somebody")
    expect(page.locator("#red-seat")).to_contain_text("Ann (you)")
    room = room_of(page)
    other = guest(page, page.url)
    expect(other.locator("#red-seat")).to_have_text("red: Ann, not ready yet")
    for one in (page, other):
        one.click("#ready")
    is_playing(page)
    other.context.close()
    assert "Ann" not in own_table.recording(room).read_text()
    page.context.close()  # before its table


# --- rooms that wait ------------------------------------------------------------------------------


def test_a_link_leads_straight_into_the_free_seat_and_both_see_who_is_ready(open_page, table):
    page = open_page(width=1000, height=700)
    page.click("#invite-somebody")
    expect(page.locator("#cover-text")).to_contain_text("The blue seat is free")
    room = room_of(page)
    link = page.locator("#invitation-link").input_value()
    assert link == f"http://{table.address}/#room={room}"
    eventually(page, lambda: page.locator("#invitation-code").evaluate("image => image.naturalWidth > 0"))
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.click("#copy")
    expect(page.locator("#copy")).to_have_text("Copied")
    assert page.evaluate("navigator.clipboard.readText()") == link
    other = guest(page, link.replace(room, room.lower()))
    expect(other.locator("#blue-seat")).to_contain_text("you, not ready")
    expect(other.locator("#cover-text")).to_contain_text("Both are here")
    expect(other.locator("#invitation")).to_be_hidden()
    expect(page.locator("#invitation")).to_be_hidden()
    assert other.url.endswith(f"#room={room}")
    page.click("#ready")
    expect(other.locator("#red-seat")).to_have_text("red: a person, ready")
    expect(other.locator("#cover-text")).to_contain_text("is ready. The game begins when you are")
    expect(page.locator("#cover-text")).to_have_text("Waiting for a person to be ready.")
    third = guest(page, link)
    expect(third.locator("#cover-text")).to_contain_text("You watch")
    expect(third.locator("#ready")).to_be_hidden()
    assert third.url.endswith(f"#watch={room}")
    other.click("#ready")
    for one in (page, other):
        is_playing(one)
        stands_on(one, "arena")
    for one in (other, third):
        one.context.close()


def test_who_wants_to_watch_gets_no_seat(open_page):
    page = open_page()
    page.click("#invite-somebody")
    room = room_of(page)
    other = guest(page, page.url.split("#")[0])
    other.fill("#code", room.lower())
    other.click("#look-on")
    expect(other.locator("#cover-text")).to_contain_text("You watch. The blue seat is free.")
    expect(page.locator("#blue-seat")).to_have_text("blue: free")
    other.click("#sit")
    expect(page.locator("#blue-seat")).to_contain_text("a person")
    other.context.close()


@pytest.mark.parametrize(
    "address", ["#room=ZZZZ", "#room=zzzz", "#room=!!", "#play=nobody", "#replay=none.jsonl", "#what"]
)
def test_an_address_that_leads_nowhere_leads_to_the_start(open_page, address):
    page = open_page(address)
    expect(page.locator("#lobby")).to_be_visible()
    expect(page.locator("#table")).to_be_hidden()
    if address.endswith(("ZZZZ", "zzzz")):
        expect(page.locator("#gone-text")).to_contain_text("There is no room ZZZZ any more.")
    elif address != "#what":
        expect(page.locator("#says")).not_to_be_empty()
    assert "#" not in page.url.removesuffix("#")


def test_axe_finds_nothing_in_a_waiting_room_nor_where_one_is_asked(open_page):
    def check(page, where):
        found = Axe().run(page).response
        violations = [(entry["id"], [node["html"] for node in entry["nodes"]]) for entry in found["violations"]]
        assert not violations, f"{where}: {violations}"

    page = open_page()
    page.click("#invite-somebody")
    page.wait_for_selector("#invitation", state="visible")
    check(page, "a waiting room")
    page.click("#go-home")
    page.click("#quick")
    is_playing(page)
    page.click("#leave")
    page.wait_for_selector("#leaving", state="visible")
    check(page, "leaving")
    page = open_page("#room=ZZZZ")
    page.wait_for_selector("#gone", state="visible")
    check(page, "a room that is gone")


# --- going back -----------------------------------------------------------------------------------


def test_back_asks_before_it_leaves_a_running_game(open_page):
    page = open_page(width=1000, height=700)
    page.click("#quick")
    is_playing(page)
    room = room_of(page)
    for stays in (True, False):
        page.go_back()
        page.wait_for_selector("#leaving", state="visible")
        assert room_of(page) == room
        stands_on(page, "stay")
        page.click("#stay" if stays else "#leave-now")
        expect(page.locator("#leaving")).to_be_hidden()
        expect(page.locator("#table")).to_be_visible(visible=stays)
    expect(page.locator("#lobby")).to_be_visible()
    stands_on(page, "quick")


def test_leave_asks_too_and_escape_plays_on(open_page):
    page = open_page(width=1000, height=700)
    page.click("#quick")
    is_playing(page)
    page.click("#leave")
    page.wait_for_selector("#leaving", state="visible")
    page.keyboard.press("Escape")
    expect(page.locator("#leaving")).to_be_hidden()
    expect(page.locator("#table")).to_be_visible()


def test_back_leads_from_a_room_to_the_start_and_forward_again_into_it_or_what_became_of_it(open_page):
    page = open_page()
    page.click("#invite-somebody")
    room = room_of(page)
    page.go_back()
    expect(page.locator("#lobby")).to_be_visible()
    page.go_forward()
    expect(page.locator("#gone-text")).to_contain_text(f"There is no room {room} any more.")
    expect(page.locator("#return")).to_be_hidden()


def test_after_the_server_came_back_the_page_leads_to_the_recording(open_page, own_table):
    page = guest(open_page(), f"http://{own_table.address}/")  # whose console says that it cannot connect
    page.click("#quick")
    is_playing(page)
    room = room_of(page)
    eventually(page, lambda: page.inner_text("#time") >= "0:02")
    own_table.kill()
    expect(page.locator("#says")).to_contain_text("connection is lost")
    expect(page.locator("#send")).to_be_disabled()
    again = Table(own_table.folder, "--port", own_table.address.split(":")[1])
    try:
        page.wait_for_selector("#scrubber", state="visible")
        expect(page.locator("#says")).to_contain_text("recorded as")
        page.click("#leave")
        expect(page.locator("#lobby")).to_be_visible()
        page.click("#recorded summary")
        expect(page.locator("#games a")).to_have_count(1)
        expect(page.locator("#games a")).to_contain_text(f"room {room}, game 1")
        expect(page.locator("#games a")).to_contain_text("person (red) against uniform (blue) not finished")
    finally:
        page.context.close()
        again.end()


# --- keys -----------------------------------------------------------------------------------------


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
    choose_time_limit(page, "15")
    tab_to("#opponent")
    page.keyboard.type("uniform")
    tab_to("#create button[type=submit]")
    page.keyboard.press("Enter")
    room = room_of(page)
    page.wait_for_selector("#ready", state="visible")
    stands_on(page, "ready")  # after a room was opened, its button is where one is
    page.keyboard.press("Enter")
    is_playing(page)
    stands_on(page, "arena")  # at the start of a game one is on the board
    for key in ("k", "g", "+", "Shift+ArrowRight", "Space", "Shift+ArrowUp", "Shift+ArrowLeft", "Space", "Enter"):
        page.keyboard.press(key)
    page.wait_for_selector("#recording", state="visible")
    (command,) = [line for line in latest(table, room, CommandLine) if line.team == 0]
    (stroke,) = command.strokes
    assert stroke.brush == "attract" and stroke.width == pytest.approx(0.12) and len(stroke.points) == 3
    page.keyboard.press("r")
    is_playing(page)
    stands_on(page, "arena")
    page.keyboard.press("Space")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Space")
    expect(page.locator("#undo")).to_be_enabled()
    page.keyboard.press("u")
    expect(page.locator("#undo")).to_be_disabled()


def test_a_card_chosen_by_enter_leads_to_the_board(open_page):
    page = open_page(width=1000, height=700)
    page.locator("[data-opponent=lasso]").focus()
    assert page.locator("[data-opponent=lasso]").evaluate("card => getComputedStyle(card).outlineStyle") == "solid"
    page.keyboard.press("Enter")
    is_playing(page)
    stands_on(page, "arena")
    page.keyboard.press("Space")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Space")
    expect(page.locator("#undo")).to_be_enabled()
    page.keyboard.press("c")
    expect(page.locator("#told")).to_have_text("Sent: spread out")


def test_signs_and_keys_are_explained_where_one_plays_and_a_key_leads_there(open_page):
    page = open_page(width=390, height=844)
    page.click("#start-signs")
    expect(page.locator("#legend")).to_be_visible()
    page.keyboard.press("Escape")
    page.click("#quick")
    is_playing(page)
    page.keyboard.press("?")
    expect(page.locator("#legend")).to_be_visible()
    stands_on(page, "close-legend")
    assert not Axe().run(page).response["violations"]
    for sign in page.locator("#sign-list canvas").all():
        colours = sign.evaluate(
            """sign => {
                const { data } = sign.getContext("2d").getImageData(0, 0, sign.width, sign.height);
                return new Set(data).size;
            }"""
        )
        assert colours > 10, sign.get_attribute("data-sign")
    assert page.evaluate("[legend, legend.querySelector('dl')].every(part => part.scrollWidth <= part.clientWidth)")
    page.click("#close-legend")
    stands_on(page, "arena")  # one plays on where one was
    page.click("#signs")
    assert set(page.locator("#keys kbd").all_inner_texts()) >= {"Space", "Enter", "U", "C", "M", "R", "?"}


# --- the lesson -----------------------------------------------------------------------------------


def test_the_lesson_waits_at_each_step_until_it_is_done(open_page, table):
    page = open_page(width=900, height=700)
    page.click("#start-lesson")
    expect(page.locator("#step-title")).to_contain_text("1 of 3")
    stands_on(page, "lesson-next")
    assert not page.url.split("#")[1].startswith("room")
    page.click("#lesson-next")
    is_playing(page)
    stands_on(page, "arena")
    page.wait_for_timeout(1500)
    expect(page.locator("#lesson")).to_contain_text("1 of 3")  # nothing goes on by itself

    def do(draw, then):
        def is_done():
            if page.locator("#step").is_hidden() and page.locator("#send").is_enabled():
                draw(Hand(page))
                page.evaluate("document.getElementById('send').click()")
                for _ in range(30):  # who draws anew too soon never lets them fly
                    if page.locator("#step").is_visible():
                        break
                    page.wait_for_timeout(200)
            if page.locator("#step").is_visible() and page.inner_text("#step-title") == "Once more":
                page.click("#lesson-next")
            return then in page.inner_text("#step-title")

        eventually(page, is_done)

    do(lambda hand: hand.draw((0.85, 0.85), (0.95, 0.95)), "2 of 3")
    held, ink = page.locator("#arena").get_attribute("data-tick"), page.evaluate(INK)
    page.wait_for_timeout(500)
    assert page.locator("#arena").get_attribute("data-tick") == held, "the board waits"
    Hand(page).draw((0.1, 0.1), (0.2, 0.1))
    assert page.evaluate(INK) == ink, "and takes no drawing"
    page.click("#lesson-next")
    do(lambda hand: hand.ring(0.5, 0.5, 0.27), "3 of 3")
    page.click("#lesson-next")
    is_playing(page)
    expect(page.locator("#blue-who")).to_have_text("uniform")
    do(lambda hand: hand.ring(0.5, 0.5, 0.2), "That is the game")
    page.click("#lesson-next")
    is_playing(page)
    expect(page.locator("#lesson")).to_be_hidden()
    expect(page.locator("#time")).to_have_text(re.compile("0:0"))


def test_the_lesson_is_over_before_it_was_done(open_page):
    page = open_page(width=900, height=700)
    page.click("#start-lesson")
    page.click("#lesson-leave")
    expect(page.locator("#lobby")).to_be_visible()
    page.click("#start-lesson")
    page.click("#lesson-next")
    is_playing(page)
    page.click("#leave")
    expect(page.locator("#lobby")).to_be_visible()
    expect(page.locator("#leaving")).to_be_hidden()
    begin(page)
    expect(page.locator("#lesson")).to_be_hidden()


def test_before_a_game_nothing_is_shown_that_is_of_none(open_page):
    page = open_page("#lesson", width=900, height=700)
    page.wait_for_selector("#step", state="visible")
    for name in ("red-size", "blue-size", "time", "chart"):
        expect(page.locator(f"#{name}")).to_be_hidden()
    page.click("#lesson-next")
    is_playing(page)
    assert page.inner_text("#red-size") == "12" and page.inner_text("#blue-size") == "0"
    assert page.inner_text("#blue-who") == "nobody"


@pytest.mark.parametrize(("width", "height"), [(1366, 768), (390, 844), (360, 640), (800, 500)])
def test_a_step_of_the_lesson_fits_on_the_board(open_page, width, height):
    page = open_page("#lesson", width=width, height=height)
    page.wait_for_selector("#step", state="visible")
    assert page.locator("#step").evaluate("step => step.scrollHeight <= step.clientHeight")
    for name in ("lesson-next", "lesson-leave"):
        box = page.locator(f"#{name}").bounding_box()
        assert box["y"] >= 0 and box["y"] + box["height"] <= height, name


# --- who comes and goes ---------------------------------------------------------------------------


def test_who_stays_is_told_that_the_other_one_has_left_for_good_and_who_comes_back_why_they_watch(open_page, table):
    page = open_page(width=1000, height=700)
    page.click("#invite-somebody")
    room = room_of(page)
    link = f"http://{table.address}/#room={room}"
    other = guest(page, link)
    other.click("#ready")
    page.click("#ready")
    is_playing(page)
    is_playing(other)
    third = guest(page, link)
    expect(third.locator("#watching")).to_have_text("You watch: both seats are taken.")
    expect(page.locator("#notice")).to_be_hidden()
    other.click("#leave")
    other.click("#leave-now")
    expect(page.locator("#notice-text")).to_contain_text("Your opponent has left for good")
    expect(page.locator("#blue-who")).to_have_text("person (left)")
    found = Axe().run(page).response["violations"]
    assert not found, found
    other.goto(link)
    for one in (other, third):
        expect(one.locator("#watching")).to_contain_text("the blue seat was given up for good")
        assert one.url.endswith(f"#watch={room}")
    page.click("#play-on")
    expect(page.locator("#notice")).to_be_hidden()
    stands_on(page, "arena")
    expect(page.locator("#send")).to_be_enabled()
    page.reload()
    page.click("#end-game")  # nobody is left who would miss it: one is not asked again
    expect(page.locator("#lobby")).to_be_visible()
    expect(page.locator("#leaving")).to_be_hidden()
    for one in (other, third):
        one.context.close()


def test_a_code_that_was_mistyped_is_corrected_where_it_was_typed(open_page):
    page = open_page()
    page.fill("#code", "zzzz")
    page.click("#join button[type=submit]")
    expect(page.locator("#code-fault")).to_contain_text("There is no room ZZZZ.")
    expect(page.locator("#gone")).to_be_hidden()
    stands_on(page, "code")
    page.click("#invite-somebody")
    page.wait_for_selector("#invitation", state="visible")
    page.click("#go-home")
    expect(page.locator("#code-fault")).to_be_empty()


@pytest.mark.parametrize("touch", [False, True])
def test_a_frame_shows_where_the_focus_is_to_who_uses_keys(touch, open_page):
    page = open_page("#play", width=390, height=844, has_touch=touch, is_mobile=touch)
    is_playing(page)
    stands_on(page, "arena")
    style = "getComputedStyle(document.getElementById('arena')).outlineStyle"
    assert page.evaluate(style) == ("none" if touch else "solid")
    page.keyboard.press("ArrowUp")
    assert page.evaluate(style) == "solid"
