"""The page where an experimenter varies something: what is hidden and shared."""

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe

from swarm_pz.play.frames import FRAME, TARGET, decode_frame
from swarm_pz.play.recordings.format import InForceLine, PaintedLine, Recording
from swarm_pz.play.recordings.playback import Playback
from tests.play.conftest import Table, new_page
from tests.play.test_page import INK, Hand, eventually, latest, open_form, open_room, recordings

pytestmark = pytest.mark.browser
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


@pytest.fixture
def visit(chromium):
    """Give a function that opens a table's page on a phone of its own."""
    pages, faults = [], []

    def open_(table):
        page = new_page(chromium, 390, 844, has_touch=True)
        pages.append(page)
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.sent = []
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
