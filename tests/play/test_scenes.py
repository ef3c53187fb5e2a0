"""The pixels that the page's modules paint, on a page without a server."""

import pytest

from tests.play.conftest import new_page
from tests.play.test_static import STATIC

pytestmark = pytest.mark.browser
ORIGIN = "http://page.test"
SCENE = """
    const load = (name) => import(`/static/${name}.js`);
    const canvas = (width = 500, height = width) => Object.assign(document.createElement("canvas"), { width, height });
    const { Arena } = await load("arena");
    const arena = new Arena(canvas(), canvas(), () => 1000);
    arena.isLive = arena.isCalm = true;
    const pixels = (of, ...box) => of.getContext("2d").getImageData(...box).data;
    const at = (of, x, y) => [...pixels(of, 500 * x, 500 * (1 - y), 1, 1)];
    const field = (...cells) => {
        const field = new Uint8Array(2500);
        for (const [column, row, value] of cells) field[50 * row + column] = value;
        return field;
    };
    const frame = (tick, teams, how = {}) => ({
        tick, serverMs: 1000, teams: Uint8Array.from(teams), fields: null,
        positions: Float32Array.from([0.25, 0.11, 0.75, 0.91]), velocities: new Float32Array(4), ...how,
    });
"""
"""An arena of 500 pixels a side, 10 a cell, with two drones."""


@pytest.fixture(scope="module")
def page(chromium):
    """Give a page with the table's elements, without its script."""
    page = new_page(chromium)
    body = (STATIC / "index.html").read_text().replace('type="module"', 'type="text/plain"')
    page.route(f"{ORIGIN}/**", lambda route: route.fulfill(path=STATIC / route.request.url.rpartition("/")[2]))
    page.route(f"{ORIGIN}/", lambda route: route.fulfill(body=body, content_type="text/html"))
    page.goto(f"{ORIGIN}/", wait_until="domcontentloaded")
    yield page
    page.context.close()


@pytest.fixture
def scene(page):
    """Give a function that runs a script in the page and returns its result."""
    return lambda script: page.evaluate(f"async () => {{ {SCENE} {script} }}")


def test_drones_and_the_ground_that_captures_have_their_teams_colour(scene):
    drones, inside, nearly, below, beside, other, bottom = scene(
        """
        const fields = [field([10, 20, 192], [30, 20, 191], [34, 20, 127], [5, 0, 255]), field([10, 40, 255])];
        arena.take(frame(3, [0, 1], { fields }));
        arena.paint();
        const reds = (column, row) => {
            const data = pixels(arena.ground.canvas, 10 * column, 490 - 10 * row, 10, 10);
            const marked = [...Array(100).keys()].filter((i) => data[4 * i] !== 255 || data[4 * i + 2] !== 255);
            const mean = (channel) => [...Array(100).keys()].reduce((sum, i) => sum + data[4 * i + channel] / 100, 0);
            return [marked.length, mean(0), mean(2)];
        };
        const drones = [[0.25, 0.11], [0.75, 0.91], [0.25, 0.91]].map((place) => at(arena.drones, ...place));
        return [drones, reds(10, 20), reds(30, 20), reds(34, 20), reds(12, 20), reds(10, 40), reds(5, 0)];
        """
    )
    red, blue, nothing = drones
    assert red[:3] == [0xD6, 0x28, 0x39] and blue[:3] == [0x1D, 0x62, 0xD6] and nothing[3] == 0
    assert inside[0] == other[0] == bottom[0] == 100, "the whole cell, and row 0 is at the bottom"
    assert below[0] == beside[0] == 0, "nothing leaks out"
    assert 255 - nearly[2] < (255 - inside[2]) / 2
    assert inside[1] > inside[2] and bottom[1] > bottom[2] and other[2] > other[1], "red and blue"


def test_a_target_is_one_outline_and_the_whole_square_none(scene):
    pieces = scene(
        """
        const count = (value) => {
            const picture = new Uint8Array(2500).map((_, i) => value(i % 50, Math.floor(i / 50)));
            arena.ground.setTarget({ number: 1, cells: 50, picture });
            arena.paint();
            const data = pixels(arena.ground.canvas, 0, 255, 500, 1);
            const dark = [...Array(500).keys()].filter((x) => data[4 * x] < 128);
            return dark.filter((x, i) => x - dark[i - 1] !== 1).length;
        };
        return [count((column, row) => Math.max(255 - 12 * Math.hypot(column - 25, row - 25), 0)), count(() => 255)];
        """
    )
    assert pieces == [2, 0], "a line is crossed going in, and going out"
