"""The page's gestures for commands that are not drawn, by synthetic touch, mouse and keys."""

import json
import math

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from swarm_pz.play.recordings.format import CommandLine, Recording
from swarm_pz.play.recordings.playback import Playback
from tests.play.test_page import SLOW_MS, Hand, begin, eventually, latest, open_form, open_room, recordings

pytestmark = pytest.mark.browser
expect.set_options(timeout=30_000)
SHAPES = ["ring", "disc", "line", "wedge", "grid"]
SEATS = {
    "attractors": {
        "shape": [4, 3],
        "low": [[0, 0, 0.1]] * 4,
        "high": [[1, 1, 2.1]] * 4,
        "default": [[0.5, 0.5, 0.1]] * 4,
        "weights": [0.1, 2.1],
    },
    "leaders": {"shape": [2, 2], "low": 0, "high": 1, "default": [[0.25, 0.5], [0.75, 0.5]], "leaders": 2},
    "formation": {
        "shape": [7],
        "low": [0, 0, 0, 0, -math.pi, 0, -1],
        "high": [5, 1, 1, 0.5, math.pi, 64, 1],
        "default": [4.0, 0.5, 0.5, 0.2, 0, 0, 0],
        "shapes": SHAPES,
    },
    "accelerations": {"shape": [10, 2], "low": -1, "high": 1, "default": [[0, 0]] * 10},
    "spells": {"shape": [1], "low": 0, "high": 1, "default": [0]},
}
"""What seats take, by kind."""


class Seat:
    """A page at a table that says that one's seat takes commands of some kind, and hears those that are sent.

    What flies is the table's own system, so that gestures are tried whatever systems are installed.
    """

    def __init__(self, open_page, kind, **how):
        self.commands, self.kind = [], kind
        self.page = open_page(has_touch=True, **how)
        self.page.route_web_socket("**/socket", self.route)
        self.page.reload()
        self.page.wait_for_selector("#opponent option", state="attached")
        begin(self.page, may_send=kind != "spells")
        expect(self.page.locator("#controls")).to_be_visible()
        self.hand = Hand(self.page, touch=True)
        self.page.focus("#arena")

    def route(self, socket):
        server = socket.connect_to_server()
        socket.on_message(lambda message: self.hear(message) or server.send(message))
        server.on_message(lambda message: socket.send(self.tell(message)))

    def hear(self, message):
        """Keep a command, and whether it was one."""
        said = json.loads(message) if isinstance(message, str) else {}
        if said.get("type") != "command":
            return False
        self.commands.append(said.get("command", said.get("strokes")))
        return True

    def tell(self, message):
        said = json.loads(message) if isinstance(message, str) else {}
        if said.get("type") != "seated":
            return message
        bare = {"system": "tried", "takes": self.kind, "serves_densities": False, "shapes": []}
        return json.dumps(said | {"commands": bare | SEATS[self.kind]})

    def sent(self, count):
        """Return the last of so many commands."""
        eventually(self.page, lambda: len(self.commands) >= count)
        assert len(self.commands) == count
        return self.commands[-1]

    def touch(self, *moments, lifts=True):
        """Touch with fingers, at one moment after the other, each moment with a place a finger; and lift them."""
        sends = self.hand.touches.send
        before = 0
        for fingers in moments:
            points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(self.hand.at(*at) for at in fingers)]
            kind = "touchStart" if len(fingers) > before else "touchMove"
            sends("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
            before = len(fingers)
        if lifts:
            sends("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def pinch(self):
        """Put a finger down, and another one; draw them apart to twice their distance, and turn by a quarter."""
        one, other = (0.5, 0.5), (0.6, 0.5)
        self.touch([one], [one, other], [(0.53, 0.47), (0.58, 0.53)], [(0.55, 0.4), (0.55, 0.6)])


@pytest.fixture
def take_seat(open_page):
    """Give a function that takes a seat of some kind, where a game runs."""
    return lambda kind, width=390, height=844: Seat(open_page, kind, width=width, height=height)


# --- attractors -----------------------------------------------------------------------------------


def test_a_tap_places_an_attractor_a_pinch_weighs_it_and_a_drag_moves_it(take_seat):
    seat = take_seat("attractors")
    expect(seat.page.locator("#hint")).to_contain_text("Tap where to go")
    seat.touch([(0.2, 0.8)])
    assert seat.sent(1) == [[pytest.approx(0.2, abs=0.01), pytest.approx(0.8, abs=0.01), pytest.approx(1.1)]]
    seat.touch([(0.2, 0.8)], [(0.4, 0.6)])
    ((x, y, _),) = seat.sent(2)
    assert (x, y) == (pytest.approx(0.4, abs=0.01), pytest.approx(0.6, abs=0.01))
    seat.page.locator("#width").fill("0.5")
    seat.touch([(0.2, 0.2)])
    assert seat.sent(4)[0][2] == pytest.approx(0.5, abs=0.05)
    seat.pinch()
    assert seat.sent(5)[0][2] == pytest.approx(1.0, abs=0.1)
    assert float(seat.page.locator("#width").input_value()) == pytest.approx(1.0, abs=0.1)


def test_further_taps_add_later_attractors_where_that_is_asked_and_no_more_than_there_may_be(take_seat):
    seat = take_seat("attractors")
    seat.page.locator("#keep").set_checked(True)
    for i in range(6):
        seat.touch([(0.1 + 0.15 * i, 0.2)])
        assert len(seat.sent(i + 1)) == min(i + 1, 4)
    seat.page.locator("#keep").set_checked(False)
    seat.touch([(0.5, 0.9)])
    assert len(seat.sent(7)) == 1
    seat.page.click("#undo")
    assert len(seat.sent(8)) == 4
    seat.page.click("#spread")
    assert seat.sent(9) == SEATS["attractors"]["default"]


# --- leaders --------------------------------------------------------------------------------------


def test_the_nearest_leader_is_dragged(take_seat):
    seat = take_seat("leaders")
    seat.touch([(0.7, 0.6)], [(0.8, 0.8)])
    assert seat.sent(1) == [[0.25, 0.5], [pytest.approx(0.8, abs=0.01), pytest.approx(0.8, abs=0.01)]]
    seat.touch([(0.2, 0.2)])
    first, second = seat.sent(2)
    assert first == [pytest.approx(0.2, abs=0.01)] * 2 and second == [pytest.approx(0.8, abs=0.01)] * 2


def test_leaders_are_moved_by_keys_one_after_the_other(take_seat):
    seat = take_seat("leaders")
    for key in ("ArrowUp", "n", "Shift+ArrowRight", "Space"):
        seat.page.keyboard.press(key)
    assert seat.sent(1) == [[0.25, pytest.approx(0.52)], [pytest.approx(0.85), 0.5]]


# --- formations -----------------------------------------------------------------------------------


def test_a_formation_is_chosen_dropped_sized_and_turned(take_seat):
    seat = take_seat("formation")
    shapes = seat.page.locator("#shapes button")
    expect(shapes).to_have_text(SHAPES)
    expect(shapes.nth(4)).to_have_attribute("aria-pressed", "true")
    shapes.nth(3).click()
    expect(shapes.nth(3)).to_have_attribute("aria-pressed", "true")
    assert seat.sent(1) == {"shape": "wedge", "centre": [0.5, 0.5], "size": 0.2, "turn": 0}
    seat.touch([(0.3, 0.3)], [(0.4, 0.7)])
    assert seat.sent(2)["centre"] == [pytest.approx(0.4, abs=0.01), pytest.approx(0.7, abs=0.01)]
    seat.pinch()
    sent = seat.sent(3)
    assert sent["size"] == pytest.approx(0.4, abs=0.02) and sent["turn"] == pytest.approx(math.pi / 2, abs=0.1)
    assert sent["centre"] == [pytest.approx(0.5, abs=0.02)] * 2, (
        "as far from the first finger as the fingers' middle moved"
    )


def test_a_formation_is_sized_and_turned_by_keys_wheel_and_sliders(take_seat):
    seat = take_seat("formation", width=1280, height=800)
    for key in ("ArrowLeft", "+", "[", "[", "Space"):
        seat.page.keyboard.press(key)
    sent = seat.sent(1)
    assert sent["centre"] == [pytest.approx(0.48), 0.5]
    assert sent["size"] == pytest.approx(0.24) and sent["turn"] == pytest.approx(math.pi / 6, abs=1e-3)
    seat.page.mouse.move(*seat.hand.at(0.5, 0.5))
    seat.page.mouse.wheel(0, 100)
    assert seat.sent(2)["size"] == pytest.approx(0.22)
    seat.page.keyboard.down("Shift")
    seat.page.mouse.wheel(0, 100)
    seat.page.keyboard.up("Shift")
    assert seat.sent(3)["turn"] == pytest.approx(math.pi / 12, abs=1e-3)
    seat.page.locator("#turn").fill("1.5")
    assert seat.sent(4)["turn"] == pytest.approx(1.5, abs=1e-3)
    seat.page.click("#undo")
    assert seat.sent(5)["turn"] == pytest.approx(math.pi / 12, abs=1e-3)


def test_a_saved_formation_is_sent_again_but_not_as_a_drawing_or_with_other_bounds(take_seat):
    seat = take_seat("formation")
    kept = [
        {"name": "A", "kind": "strokes", "strokes": [{"brush": "attract", "width": 0.1, "points": [[0.5, 0.5]]}]},
        {"name": "B", "kind": "formation", "strokes": [{"x": 1, "y": 0, "size": 9, "turn": 0, "shape": 77}]},
    ]
    text = json.dumps({"format": "swarm-pz.drawings.v1", "drawings": kept})
    seat.page.locator("#file").set_input_files({"name": "d", "mimeType": "text/plain", "buffer": text.encode()})
    expect(seat.page.locator("#imported")).to_have_text("2 of 2 drawings added.")
    seat.page.keyboard.press("1")
    assert seat.sent(1) == {"shape": "grid", "centre": [1, 0], "size": 0.5, "turn": 0}


# --- accelerations --------------------------------------------------------------------------------


def test_the_stick_flies_all_drones_while_it_is_held(take_seat):
    seat = take_seat("accelerations")
    seat.touch([(0.15, 0.15)], [(0.27, 0.15)], lifts=False)
    right = [[pytest.approx(1, abs=0.05), pytest.approx(0, abs=0.05)]] * 10
    eventually(seat.page, lambda: seat.commands and seat.commands[-1] == right)
    seat.touch()
    eventually(seat.page, lambda: seat.commands[-1] == [[0, 0]] * 10)
    seat.commands.clear()
    seat.page.keyboard.down("ArrowUp")
    eventually(seat.page, lambda: [[0, 1]] * 10 in seat.commands)
    seat.page.keyboard.up("ArrowUp")
    eventually(seat.page, lambda: seat.commands[-1] == [[0, 0]] * 10)


def test_the_stick_flies_one_drone_that_was_chosen(take_seat):
    seat = take_seat("accelerations")
    for _ in range(3):
        seat.page.keyboard.press("n")
    seat.page.keyboard.down("ArrowLeft")
    eventually(seat.page, lambda: seat.commands)
    assert seat.commands[-1] == [[-1, 0] if i == 2 else [0, 0] for i in range(10)]
    seat.page.keyboard.up("ArrowLeft")
    eventually(seat.page, lambda: seat.commands[-1] == [[0, 0]] * 10)


# --- all of them ----------------------------------------------------------------------------------


def test_who_has_no_gesture_is_told_so(take_seat):
    seat = take_seat("spells")
    expect(seat.page.locator("#hint")).to_have_text("This page has no gesture for spells: programs play them.")
    expect(seat.page.locator("#send")).to_be_disabled()
    seat.touch([(0.5, 0.5)], [(0.6, 0.6)])
    assert seat.commands == []


@pytest.mark.parametrize("kind", ["attractors", "leaders", "formation", "accelerations"])
def test_the_tools_of_each_kind_fit_and_axe_finds_nothing(kind, take_seat):
    for width, height in ((320, 640), (390, 844), (800, 500), (1280, 800)):
        seat = take_seat(kind, width, height)
        page = seat.page
        page.click("#shelf")
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
        page.context.close()


# --- whole games ----------------------------------------------------------------------------------


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
