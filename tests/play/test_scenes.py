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
    """Give a page with the table's elements, whose own script does not run."""
    page = new_page(chromium)
    body = (STATIC / "index.html").read_text().replace('type="module"', 'type="text/plain"')
    page.route(f"{ORIGIN}/**", lambda route: route.fulfill(path=STATIC / route.request.url.rpartition("/")[2]))
    page.route(f"{ORIGIN}/", lambda route: route.fulfill(body=body, content_type="text/html"))
    page.goto(f"{ORIGIN}/", wait_until="domcontentloaded")
    yield page
    page.context.close()


@pytest.fixture
def scene(page):
    """Give a function that plays a scene and returns what it returns."""
    return lambda script: page.evaluate(f"async () => {{ {SCENE} {script} }}")


def test_each_side_is_painted_in_its_colour_and_its_place(scene):
    red, blue, nothing = scene(
        """
        arena.take(frame(3, [0, 1]));
        arena.paint();
        return [[0.25, 0.11], [0.75, 0.91], [0.25, 0.91]].map((place) => at(arena.drones, ...place));
        """
    )
    assert red[:3] == [0xD6, 0x28, 0x39] and blue[:3] == [0x1D, 0x62, 0xD6] and nothing[3] == 0


def test_a_trail_fades_and_ends_where_its_drone_was_five_seconds_ago(scene):
    strengths = scene(
        """
        const x = (tick) => 0.05 + 0.9 * tick / 210, ages = [200, 155, 120, 90, 60, 30];
        for (let tick = 0; tick <= 210; tick += 3) {
            arena.take(frame(tick, [0], { positions: Float32Array.from([x(tick), 0.501]) }));
            arena.paint();
        }
        for (let i = 0; i < 9; i++) arena.paint();               // the past is painted a few pieces at a time
        return ages.map((age) => {
            const column = pixels(arena.drones, Math.round(500 * x(210 - age)), 240, 1, 20);
            return Math.max(...column.filter((_, i) => i % 4 === 3));
        });
        """
    )
    assert strengths == sorted(strengths) and strengths[1] == 0 < strengths[2] < strengths[-1] / 3


def test_ground_that_captures_is_filled_to_its_edge_in_its_teams_colour_and_faintly_where_it_nearly_does(scene):
    inside, nearly, below, beside, other, bottom = scene(
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
        return [reds(10, 20), reds(30, 20), reds(34, 20), reds(12, 20), reds(10, 40), reds(5, 0)];
        """
    )
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


def test_ink_is_seen_and_the_eraser_takes_it_away(scene):
    one, both, undone, erased = scene(
        """
        const { Pen } = await load("pen"), ink = canvas();
        const pen = new Pen(document.body, ink, { lifted() {}, changed() {}, mayDraw: () => true });
        const draw = (y) => {
            pen.extend(pen.start([0.2, y], 0), [0.5, y]);
            pen.paint();
            return pixels(ink, 0, 0, 500, 500).filter((value, i) => i % 4 === 3 && value).length;
        };
        pen.brush = "repel";
        const seen = [draw(0.2), draw(0.8)];
        pen.undo();
        pen.paint();
        const undone = pixels(ink, 0, 0, 500, 500).filter((value, i) => i % 4 === 3 && value).length;
        Object.assign(pen, { brush: "erase", width: 0.3 });
        return [...seen, undone, draw(0.2)];
        """
    )
    assert one > 1000 and both > 1.5 * one and undone == one and erased == 0


def test_each_sign_of_the_legend_has_a_picture_by_day_and_by_night(page, scene):
    counts, corners = [], []
    for look in ("light", "dark"):
        page.emulate_media(color_scheme=look)
        shown = scene(
            """
            const { explain } = await load("legend"), legend = document.getElementById("legend");
            if (!legend.open) explain();
            const signs = [...legend.querySelectorAll("canvas")];
            return signs.map((sign) => [...pixels(sign, 0, 0, sign.width, sign.height)]);
            """
        )
        counts += [len(set(sign)) for sign in shown]
        corners += [sign[0] for sign in shown]
    assert len(counts) == 12 and min(counts) > 10
    assert corners == [255] * 6 + [corners[-1]] * 6 and corners[-1] < 60, "while it is open, too"
