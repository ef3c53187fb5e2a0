"""The page where an experimenter varies something: delays by synthetic touch, and what is hidden."""

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from swarm_pz.play.frames import FRAME, TARGET, decode_frame
from swarm_pz.play.recordings.format import CommandLine, InForceLine, PaintedLine, Recording
from swarm_pz.play.recordings.playback import Playback
from tests.play.conftest import Table, new_page
from tests.play.test_page import INK, Hand, eventually, latest, open_form, open_room, recordings

pytestmark = pytest.mark.browser
TRIPS = """
    const trips = globalThis.trips = [], Socket = WebSocket;
    globalThis.WebSocket = class extends Socket {
        constructor(...given) {
            super(...given);
            this.addEventListener("message", ({ data }) => {
                const told = typeof data === "string" ? JSON.parse(data) : {};
                if (told.type === "pong") trips.push(performance.now() - told.sent_ms);
            });
        }
    };
"""
"""How long each ping took, in milliseconds: the page mistakes the server's clock by half of that at most."""
LATE = """
[red]
command_delay_ms = 100
display_delay_ms = 100
[blue]
command_delay_ms = 300
display_delay_ms = 300
"""
LITTLE = """
[red]
hide = ["opponents", "ground", "trails", "target"]
frame_rate = 10
share = 0.5
helper = "ring"
"""


def serving(folder, factors):
    """Give a table whose rooms have factors."""
    path = folder / "factors.toml"
    path.write_text(factors)
    return Table(folder / "games", "--factors", str(path))


@pytest.fixture(scope="module")
def late(tmp_path_factory):
    table = serving(tmp_path_factory.mktemp("late"), LATE)
    yield table
    table.end()


@pytest.fixture
def visit(chromium):
    """Give a function that opens a table's page on a phone of its own."""
    pages, faults = [], []

    def open_(table):
        page = new_page(chromium, 390, 844, has_touch=True)
        pages.append(page)
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.sent = []
        page.add_init_script(TRIPS)
        page.on("websocket", lambda socket: socket.on("framereceived", lambda data: page.sent.append(data)))
        page.goto(f"http://{table.address}/")
        page.wait_for_selector("#opponent option", state="attached")
        return page

    yield open_
    for page in pages:
        page.context.close()
    assert not faults, f"the page had errors: {faults}"


def sit_down(page, side="red"):
    """Open a room on a side, against one who does nothing, and begin; return its code."""
    open_form(page)
    page.select_option("#side", side)
    room = open_room(page, "uniform")
    page.click("#ready")
    page.wait_for_selector("#cover", state="hidden")
    return room


@pytest.mark.parametrize(("side", "asked"), [(None, 0), ("red", 100), ("blue", 300)])
def test_commands_count_and_moments_are_painted_as_much_later_as_was_asked(side, asked, visit, table, late):
    table = late if side else table
    page = visit(table)
    room = sit_down(page, side or "red")
    team = int(side == "blue")
    expect(page.locator("#varied")).to_be_hidden()
    hand = Hand(page, touch=True)
    for count in range(1, 4):
        hand.draw((0.2, 0.2 + 0.1 * count), (0.4, 0.2 + 0.1 * count))
        eventually(page, lambda count=count: len(latest(table, room, PaintedLine)) >= count)
    mistaken_ms = 1.0 + 0.5 * max(page.evaluate("globalThis.trips"))
    page.click("#leave")
    page.click("#leave-now")
    recording = Recording.read(recordings(table, room)[-1])
    arrived = {line.number: line.received_ms for line in recording.of(CommandLine) if line.team == team}
    forced = {line.number: line.ms for line in recording.of(InForceLine) if line.team == team}
    painted = {line.number: line.ms for line in recording.of(PaintedLine)}
    assert set(painted) == set(arrived) & set(forced) == {1, 2, 3}
    assert all(forced[number] - arrived[number] >= asked - 1 for number in painted)
    assert all(painted[number] - forced[number] >= asked - mistaken_ms for number in painted)


def test_what_is_hidden_is_neither_sent_nor_painted_and_the_page_says_so(visit, tmp_path):
    table = serving(tmp_path, LITTLE)
    try:
        page = visit(table)
        room = sit_down(page)
        assert page.inner_text("#varied") == (
            "Not shown here: your opponents, ground that captures, trails, your target. "
            "ring makes 50 % of each command."
        )
        assert Axe().run(page).response["violations"] == []
        Hand(page, touch=True).draw((0.2, 0.2), (0.4, 0.2))
        eventually(page, lambda: any(line.number == 1 for line in latest(table, room, InForceLine)))
        eventually(page, lambda: page.evaluate(INK) == 0)  # it is followed, by the half of it
        eventually(page, lambda: latest(table, room, PaintedLine))
        blue_pixels = page.evaluate(
            """() => {
                const canvas = document.getElementById("drones"), { width } = canvas;
                const { data } = canvas.getContext("2d").getImageData(0, 0, width, width);
                let count = 0;
                for (let i = 0; i < data.length; i += 4) {
                    count += data[i + 3] > 200 && data[i + 2] > 180 && data[i] < 90;
                }
                return count;
            }"""
        )
        assert blue_pixels == 0
    finally:
        table.end()
    received = [data for data in page.sent if isinstance(data, bytes)]
    frames = [decode_frame(data) for data in received if data[0] == FRAME]
    assert len(frames) > 3 and all(frame.hidden == 1 and frame.fields is None for frame in frames)
    for data, frame in zip((data for data in received if data[0] == FRAME), frames, strict=True):
        told = np.frombuffer(data, np.uint8, 8 * len(frame.teams), 20).reshape(2, -1, 4)  # places, velocities
        assert not told[:, frame.teams == 1].any() and told[:, frame.teams == 0].any()
    assert not [data for data in received if data[0] == TARGET]
    assert all(frame.tick % 3 == 0 for frame in frames), "ten a second"
    recording = Recording.read(recordings(table, room)[-1])
    assert {line.sender for line in recording.of(InForceLine) if line.team == 0} == {"shared:ring"}
    assert Playback(recording).verify().verified
