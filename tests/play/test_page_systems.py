"""Commands that are not drawn: their tools, and whole games by touch."""

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from swarm_pz.play.recordings.format import CommandLine, Recording
from swarm_pz.play.recordings.playback import Playback
from tests.play.test_page import SLOW_MS, Hand, begin, eventually, latest, open_form, open_room, recordings

pytestmark = pytest.mark.browser
expect.set_options(timeout=30_000)


@pytest.mark.parametrize("system", ["flocking", "leader_follower", "formation", "direct"])
def test_the_tools_of_each_kind_fit_and_axe_finds_nothing(system, open_page):
    page = open_page(has_touch=True)
    open_form(page)
    page.select_option("#red-system", system)
    begin(page)
    page.click("#shelf")
    for width, height in ((320, 640), (390, 844), (800, 500), (1280, 800)):
        page.set_viewport_size({"width": width, "height": height})
        reach = page.evaluate("['scrollWidth', 'scrollHeight'].map((side) => document.getElementById('table')[side])")
        assert reach == [width, height]
        over = page.evaluate(
            """() => [...document.querySelectorAll("#table button, #table input")].filter((one) => {
                const box = one.getBoundingClientRect();
                return box.width && (box.right > innerWidth || box.bottom > innerHeight
                    || one.scrollWidth > one.clientWidth + 1);
            }).map((one) => one.id || one.textContent)"""
        )
        assert not over, (width, over)
        if width in (390, 1280):
            found = Axe().run(page).response["violations"]
            assert not found, found


@pytest.mark.parametrize(
    "system", ["coverage", "direct", "flocking", "formation", "leader_follower", "potential_field"]
)
def test_a_whole_game_is_played_by_touch(system, open_page, table):
    page = open_page(has_touch=True, is_mobile=True, width=390, height=844)
    open_form(page)
    systems = page.locator("#red-system option").evaluate_all("options => options.map(({ value }) => value)")
    if system not in systems:
        pytest.skip(f"{system} is not installed")
    page.select_option("#red-system", system)
    room = open_room(page, "uniform", "15")
    page.click("#ready")
    page.wait_for_selector("#cover", state="hidden")
    hand = Hand(page, touch=True)
    places = [(0.15, 0.15), (0.25, 0.2)] if system == "direct" else [(0.7, 0.7), (0.8, 0.8)]
    hand.draw(*places)
    if system == "formation":
        page.locator("#shapes button").first.click()
    commands = eventually(page, lambda: [line for line in latest(table, room, CommandLine) if line.team == 0])
    assert commands[0].strokes or np.isfinite(commands[0].command).all()
    page.wait_for_selector("#recording", state="visible", timeout=SLOW_MS)
    recording = Recording.read(recordings(table, room)[-1])
    assert recording.end.outcome in ("red", "blue", "draw") and Playback(recording).verify().verified


def test_who_swaps_sides_takes_their_system_along(open_page):
    page = open_page()
    open_form(page)
    page.select_option("#red-system", "direct")
    open_room(page, "uniform", "1")
    page.click("#ready")
    page.click("#swap", timeout=SLOW_MS)
    expect(page.locator("#blue-who")).to_have_text("(you)")
    expect(page.locator("#hint")).to_contain_text("The stick flies them", timeout=SLOW_MS)
