"""The pages of a study in a real browser: what they ask, how to answer, and accessibility."""

import threading
from itertools import cycle

import pytest
from playwright.sync_api import expect

from tests.play.conftest import opening
from tests.play.pages import check_axe
from tests.play.server.test_studies import lines_of, planned
from tests.play.studying import Participant, StudyTable

pytestmark = pytest.mark.browser
WIDTHS = ((1280, 800), (390, 844))
SCHEMES = cycle(["light", "dark"])
"""In turn: `test_static` tests the contrast of text in both."""
FIELDS = "button, textarea, .answers label, input:not([type=radio], [type=checkbox])"
SMALL = """(fields) => [...document.querySelectorAll(fields)]
    .filter((one) => one.checkVisibility() && (one.offsetHeight < 44 || one.offsetWidth < 36))
    .map((one) => one.outerHTML)"""
RESULT = """window.setTimeout = ((later) => (act, ms, ...more) =>
    later(act, ms !== 6000 ? ms : sessionStorage.getItem("hold") ? 1e9 : 100, ...more))(window.setTimeout)"""
"""A result is shown for 0.1 s, or, while `hold` is set, for ever."""
PLAN = """
title = "Two interfaces"
participants = 8
codes = ["P01", "P02", "P03", "P04", "P05", "P06", "P07", "P08"]
games = 1
break_s = 0.1
order = [["drawing", "attractors"]]
consent = "consent.md"
welcome = "consent.md"
debriefing = "consent.md"
completion = "SWARM-1"
rules = { time_limit = 1.0, drones_per_team = 3 }
practice = { wins = 1, most = 1, opponent = "uniform" }

[[conditions]]
title = "drawing"
text = "consent.md"
opponent = "person"

[[conditions]]
title = "attractors"
system = "flocking"

[[forms]]
name = "nasa-tlx"
when = "start"

[[forms]]
name = "sus"
when = "start"

[[forms]]
name = "own"
title = "Looking back"
when = "start"
items = [
    { id = "age", text = "How old are you?", kind = "number", least = 18, most = 99 },
    { id = "hand", text = "Your hand?", kind = "choice", choices = ["left", "right", "both"] },
    { id = "mood", text = "How are you?", low = "bad", high = "well" },
    { id = "free", text = "Anything else?", kind = "text", optional = true },
]

[[forms]]
name = "quiz"
title = "Is it clear?"
when = "welcome"
tries = 2
items = [{ id = "goal", text = "Your goal?", kind = "choice", choices = ["own all", "flee"], correct = "own all" }]

[[forms]]
name = "after"
title = "How was that?"
items = [{ id = "word", text = "In a word?", kind = "text", optional = true }]
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    table = StudyTable(planned(folder / "plan", PLAN), folder / "data")
    yield table
    table.end()


@pytest.fixture
def visit(chromium, study):
    """Give a function that opens an address of the study in a browser of its own."""
    with opening(chromium) as open_:
        yield lambda address, width=390, height=844: open_(
            f"{study.address}/{address}", script=RESULT, width=width, height=height
        )


def check(page, where):
    """Check that a page passes axe and, narrow or wide, has nothing off-screen or too small to touch."""
    for width, height in WIDTHS:
        page.set_viewport_size({"width": width, "height": height})
        assert page.evaluate("document.documentElement.scrollWidth") <= width, f"{where}, {width} wide"
        small = page.evaluate(SMALL, FIELDS)
        assert not small, f"{where}, {width} wide: too small to be touched: {small}"
    check_axe(page, where, next(SCHEMES))


GONE_ON = "document.querySelector('main') && document.getElementById('heading')?.textContent !== 'Do you want to stop?'"
"""True on the page of the game, or of the next step if the game is over by then."""


def at_heading(page, text):
    expect(page.locator("#heading")).to_have_text(text)


def go_on(page, name="Go on"):
    page.get_by_role("button", name=name, exact=True).click()


def test_a_participant_goes_through_every_kind_of_page(visit, study):
    page = visit("")
    at_heading(page, "Welcome")
    check(page, "code")
    page.fill("#participant", "../etc")
    page.keyboard.press("Enter")
    expect(page.locator("#told")).to_contain_text("letters, digits")
    page.fill("#participant", "p01")
    page.keyboard.press("Enter")

    at_heading(page, "Do you want to take part?")
    check(page, "consent")
    go_on(page)
    expect(page.locator("#told")).to_contain_text("tick that you agree")
    go_on(page, "I do not want to take part")
    at_heading(page, "Thank you for reading this")
    go_on(page, "Back")
    page.get_by_label("I have read this").check()
    go_on(page)

    at_heading(page, "How demanding was it?")
    go_on(page)
    expect(page.locator("#told")).to_have_text("Please answer this question.")
    check(page, "NASA-TLX, unanswered")
    for place, slider in enumerate(page.locator("input[type=range]").all()):
        expect(slider).to_have_attribute("aria-valuetext", "not answered yet")
        slider.focus()
        page.keyboard.press("Enter" if place == 0 else "Home")
        expect(slider).to_have_attribute("aria-valuetext", "50" if place == 0 else "0")
    page.locator("#mental").focus()
    page.keyboard.press("ArrowRight")
    for pair in page.locator("fieldset").all():
        pair.locator("label").first.click()
    page.reload()  # what was answered is still there
    expect(page.locator("#mental")).to_have_value("55")
    go_on(page)

    at_heading(page, "How usable was it?")
    check(page, "SUS")
    for question in page.locator("fieldset").all():
        question.locator("label").nth(2).click()
    go_on(page)

    at_heading(page, "Looking back")
    page.get_by_label("How old are you?").fill("17")
    page.get_by_label("left").check()
    page.locator("label", has_text="7").click()
    go_on(page)
    expect(page.locator("#told")).to_have_text("Please give a number from 18 to 99.")
    check(page, "own questions")
    boxes = [one.bounding_box() for one in page.locator("fieldset", has_text="How are you?").locator("label").all()]
    assert len({(box["y"], round(box["width"])) for box in boxes}) == 1  # all points look alike
    page.get_by_label("How old are you?").fill("18")
    go_on(page)

    at_heading(page, "Please read")
    check(page, "text")
    assert page.locator(".text h2").inner_text() == "Will you?"
    go_on(page)
    at_heading(page, "Is it clear?")
    page.get_by_label("flee").check()
    go_on(page)
    expect(page.locator("#told")).to_contain_text("not right")
    expect(page.locator("h2")).to_have_text("Will you?")  # the text is shown again, beside the questions
    page.get_by_label("own all").check()
    go_on(page)
    at_heading(page, "Please read")
    go_on(page)
    at_heading(page, "Practice game 1")
    kept = {line["step"]: line for line in lines_of(study, "P01")[1:]}
    assert kept["start.form.nasa-tlx"]["answers"]["mental"] == 55
    assert kept["start.form.sus"]["scores"] == {"sus": 50.0}
    own = {"age": 18, "hand": "left", "mood": 7, "free": None}
    assert kept["start.form.own"]["answers"] == own

    expect(page.locator("#asked")).to_contain_text("until you have won 1, or played 1")
    page.evaluate("sessionStorage.setItem('hold', 'yes')")
    go_on(page, "Begin")
    page.wait_for_selector("#table[data-phase=over]")
    assert "/study/p01/game#room=" in page.url
    for name in ("#leave", "#ready", "#practise", "#taught", "#share", "#recording", "#go-home", "#lobby", "#shelf"):
        expect(page.locator(name)).to_be_hidden()
    expect(page.locator("#blue-who")).to_have_text("the opponent")
    assert "uniform" not in page.locator("body").inner_text(), "the opponent has no name"
    check(page, "a game's result")
    page.evaluate("sessionStorage.removeItem('hold')")
    page.reload()

    at_heading(page, "Game 1 of 1")
    (study.folder / "interrupted" / "P01.block1.game1.1.jsonl").touch()
    seat = {"room": "AAAA", "seat": "red", "token": "0" * 32}
    page.evaluate("seat => sessionStorage.setItem('swarm-pz.seat', JSON.stringify(seat))", seat)
    gone = f"http://{study.address}/study/P01/game#room=AAAA"  # a seat that no longer exists
    page.goto(gone, wait_until="commit")
    page.wait_for_url("**/study/P01")
    at_heading(page, "Game 1 of 1")
    expect(page.locator("#asked")).to_contain_text("This game was broken off")
    page.evaluate("sessionStorage.setItem('hold', 'yes')")
    go_on(page, "Begin")
    expect(page.locator("#asked")).to_contain_text("when the other participant is, too")
    meeting = threading.Thread(target=Participant(study, "P02").walk, args=[lambda step: step["kind"] == "break"])
    meeting.start()
    page.wait_for_selector("#table[data-phase=over]")
    page.evaluate("sessionStorage.removeItem('hold')")
    page.reload()  # works even if the seat is gone by now
    page.wait_for_url("**/study/P01")
    at_heading(page, "How was that?")
    meeting.join()
    go_on(page)
    at_heading(page, "Time for a rest")
    go_on(page)

    for game in ("Practice game 1", "Game 1 of 1"):
        at_heading(page, game)
        go_on(page, "Begin")
    at_heading(page, "How was that?")  # the page goes on by itself after the result
    go_on(page)
    at_heading(page, "About this study")
    go_on(page)
    at_heading(page, "Thank you")
    expect(page.locator("#completion")).to_have_text("SWARM-1")
    check(page, "end")
    assert lines_of(study, "P01")[-3]["opponent"] == "uniform"


def test_nobody_goes_on_before_a_break_is_over(visit, study):
    page, step = visit(""), {"id": "break", "kind": "break", "heading": "Time for a rest", "seconds": 3600.0}
    state = {"code": "P06", "title": "A study", "done": 1, "of": 2, "step": step}
    page.route("**/state", lambda route: route.fulfill(json=state))  # a fixed state: only the page's clock runs
    page.clock.install()
    page.goto(f"http://{study.address}/study/P06")
    button = page.get_by_role("button", name="Go on")
    expect(button).to_be_disabled()
    check(page, "break")
    page.clock.fast_forward("01:00:00")
    expect(button).to_be_enabled()


def test_a_second_window_says_so_and_may_take_over_and_the_monitor_follows(visit, study):
    monitor = visit(f"study/monitor#{study.token}", 1280, 800)
    row = monitor.locator("tr[data-name=P03]")
    expect(row).to_contain_text("has not come")
    first = visit("study/P03")
    at_heading(first, "Do you want to take part?")
    expect(row).to_contain_text("consent")
    expect(row).to_contain_text("here")
    check(monitor, "monitor")
    second = visit("study/P03")
    at_heading(second, "This study is open in another window")
    check(second, "elsewhere")
    go_on(second, "Go on here")
    at_heading(second, "Do you want to take part?")
    at_heading(first, "This study is open in another window")
    nobody = visit("study/P77")
    at_heading(nobody, "This does not go on")
    expect(nobody.locator("#told")).to_contain_text("nobody in this study has the code P77")
    check(nobody, "nobody")
    closed = visit("study/monitor")
    expect(closed.locator("#lost")).to_contain_text("as the terminal shows it")


def test_a_participant_stops_from_a_game_and_has_all_deleted_while_the_server_runs(visit, study):
    one = Participant(study, "P05")
    one.walk(lambda step: step["kind"] == "practice")
    page = visit("study/P05")
    go_on(page, "Go on here")
    at_heading(page, "Practice game 1")
    with page.expect_popup() as copy:
        page.get_by_role("link", name="Your consent").click()
    expect(copy.value.locator("body")).to_contain_text("P05")
    page.evaluate("sessionStorage.setItem('hold', 'yes')")
    go_on(page, "Begin")
    page.wait_for_url("**/game#room=*")
    page.get_by_role("link", name="Stop", exact=True).click()
    at_heading(page, "Do you want to stop?")
    check(page, "stop")
    go_on(page, "Go back to the study")
    page.wait_for_function(GONE_ON)
    page.get_by_text("Stop", exact=True).click()
    at_heading(page, "Do you want to stop?")
    go_on(page, "Stop, and delete it")
    at_heading(page, "You have withdrawn")
    assert len(lines_of(study, "P05")) == 1
