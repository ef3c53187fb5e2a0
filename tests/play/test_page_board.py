"""The board of the page in a real browser: what is seen of a game, and how it is steered."""

import re
import signal

import pytest
from coloraide import Color
from playwright.sync_api import expect

from tests.play.test_page import INK, STATIC, Hand, begin, commands, eventually, play_through, room_of

pytestmark = pytest.mark.browser
SCENE = """
    const { Arena } = await import("/static/arena.js");
    const canvas = () => Object.assign(document.createElement("canvas"), { width: 500, height: 500 });
    const arena = new Arena(canvas(), canvas(), () => 1000);
    arena.isLive = arena.isCalm = true;
    const at = (of, x, y) => [...of.getContext("2d").getImageData(500 * x, 500 * (1 - y), 1, 1).data];
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
"""An arena of 500 pixels a side, 10 a cell, with two drones, beside the page."""


def scene(page, script):
    return page.evaluate(f"async () => {{ {SCENE} {script} }}")


# --- modules of the page, by themselves -----------------------------------------------------------


def test_the_arena_tells_captures_forgets_jumps_and_paints_each_side_in_its_place(open_page):
    seen = scene(
        open_page(),
        """
        const seen = { captured: [[0, 1], [0, 0], [0, 1]].map((teams, i) => arena.take(frame(3 * i, teams))) };
        seen.flashes = arena.flashes.map(({ drone, team }) => [drone, team]);
        arena.flashes = [];
        seen.shown = arena.paint() === arena.frame;
        seen.drones = [[0.25, 0.11], [0.75, 0.91], [0.25, 0.91]].map((place) => at(arena.drones, ...place));
        arena.ground.setTarget({ number: 4, cells: 2, picture: Uint8Array.from([0, 0, 255, 255]) });
        arena.paint();
        seen.target = arena.shownTarget;
        seen.jumped = [arena.take(frame(40, [1, 0])), arena.trails.kept.length];
        arena.take(frame(43, [1, 0], { serverMs: 700 }));
        seen.old = arena.paint();
        arena.forget();
        seen.forgotten = [arena.frame, arena.ground.fields, arena.ground.target, arena.paint()];
        return seen;
        """,
    )
    assert seen["captured"] == [[], [1], [1]] and seen["flashes"] == [[1, 0], [1, 1]]
    assert seen["shown"] and seen["old"] is None and seen["target"] == 4
    red, blue, nothing = seen["drones"]
    assert red[:3] == [0xD6, 0x28, 0x39] and blue[:3] == [0x1D, 0x62, 0xD6] and nothing[3] == 0
    assert seen["jumped"] == [[], 1] and seen["forgotten"] == [None] * 4


def test_ground_that_captures_is_filled_to_its_edge_in_its_teams_colour_and_nothing_else_is(open_page):
    inside, below, beside, other, bottom = scene(
        open_page(),
        """
        const fields = [field([10, 20, 192], [30, 20, 191], [5, 0, 255]), field([10, 40, 255])];
        arena.take(frame(3, [0, 1], { fields }));
        arena.paint();
        const reds = (column, row) => {
            const { data } = arena.ground.canvas.getContext("2d").getImageData(10 * column, 490 - 10 * row, 10, 10);
            const marked = [...Array(100).keys()].filter((i) => data[4 * i] !== 255 || data[4 * i + 2] !== 255);
            return [marked.length, data[4 * 44], data[4 * 44 + 2]];
        };
        return [reds(10, 20), reds(30, 20), reds(12, 20), reds(10, 40), reds(5, 0)];
        """,
    )
    assert inside[0] == other[0] == bottom[0] == 100, "the whole cell, and row 0 is at the bottom"
    assert below[0] == beside[0] == 0, "up to 191 it does not capture, and nothing leaks out"
    assert inside[1] > inside[2] and bottom[1] > bottom[2] and other[2] > other[1], "red and blue"


def test_own_drones_in_danger_are_marked_and_no_others(open_page):
    on_it, others, flying, watching = scene(
        open_page(),
        """
        const told = (guarded, cells, velocities) => {
            arena.forget();
            arena.guarded = guarded;
            const fields = [field(), field(cells)];
            arena.take(frame(3, [0, 1], { fields, velocities: Float32Array.from(velocities) }));
            arena.paint();
            return arena.endangered;
        };
        const still = [0, 0, 0, 0], under = [12, 5, 255], ahead = [22, 5, 255];
        return [told([0], under, still), told([1], under, still),
            [told([0], ahead, still), told([0], ahead, [0.5, 0, 0, 0])], told([0, 1], under, still)];
        """,
    )
    assert (on_it, others, watching) == (1, 0, 1)
    assert flying == [0, 1], "a drone that will be there at once is warned"


@pytest.mark.parametrize("speed", [0.5, 1, 2])
def test_trails_end_where_drones_are_shown_at_any_speed(speed, open_page):
    place, painted = scene(
        open_page(),
        f"""
        arena.speed = {speed};
        const at_ = (x, serverMs) => (
            {{ serverMs, positions: Float32Array.from([x, 0.5]), velocities: Float32Array.from([2, 0]) }});
        arena.take(frame(0, [0], at_(0.1, 990)));
        arena.take(frame(6, [0], at_(0.2, 950)));  // 50 ms ago
        arena.paint();
        const pen = arena.drones.getContext("2d"), row = pen.getImageData(0, 250, 500, 1).data;
        const painted = [...Array(500).keys()].filter((x) => row[4 * x + 3] > 0);
        return [arena.places[0], [painted.at(0), painted.at(-1), painted.length]];
        """,
    )
    assert place == pytest.approx(0.2 + 2 * 0.05 * speed)
    first, last, count = painted
    assert first == pytest.approx(50, abs=2) and last == pytest.approx(500 * place, abs=12)
    assert count == last - first + 1, "there is no gap between a trail and its drone"


def test_the_higher_a_drone_the_farther_its_shadow_and_the_next_game_has_its_own(open_page):
    low, high, kept, forgotten = scene(
        open_page(),
        """
        const told = (altitudes) => {
            arena.take(frame(3, [0, 1], { altitudes }));
            arena.paint();
            const { data } = arena.drones.getContext("2d").getImageData(125, 445, 60, 55);  // red is in its corner
            const dark = [...Array(60 * 55).keys()].filter((i) => data[4 * i + 3] > 20 && data[4 * i + 3] < 120);
            return [Math.max(...dark.map((i) => i % 60)), Math.max(...dark.map((i) => Math.floor(i / 60)))];
        };
        const seen = [told(Uint8Array.of(13, 255)), told(Uint8Array.of(255, 13)), told(null)];
        arena.forget();
        return [...seen, told(null)];
        """,
    )
    assert low[0] + 4 < high[0] < 30 and high[0] == pytest.approx(high[1], abs=1)
    assert kept == high, "altitudes come once, and stay"
    assert forgotten[0] < low[0]


def test_trails_are_fainter_than_drones(open_page):
    trail, drone = scene(
        open_page(),
        """
        const at_ = (x) => ({ positions: Float32Array.from([x, 0.5]), velocities: new Float32Array(2) });
        arena.take(frame(0, [0], at_(0.1)));
        arena.take(frame(6, [0], at_(0.6)));
        arena.paint();
        const trail = Math.max(...[0.498, 0.5, 0.502].map((y) => at(arena.drones, 0.3, y)[3]));
        return [trail, at(arena.drones, 0.6, 0.5)[3]];
        """,
    )
    assert 0 < trail < 0.4 * drone


def test_a_target_is_one_outline_and_the_whole_square_none(open_page):
    pieces = scene(
        open_page(),
        """
        const count = (value) => {
            const picture = new Uint8Array(2500).map((_, i) => value(i % 50, Math.floor(i / 50)));
            arena.ground.setTarget({ number: 1, cells: 50, picture });
            arena.paint();
            const { data } = arena.ground.canvas.getContext("2d").getImageData(0, 255, 500, 1);
            const dark = [...Array(500).keys()].filter((x) => data[4 * x] < 128);
            return dark.filter((x, i) => x - dark[i - 1] !== 1).length;
        };
        return [count((column, row) => Math.max(255 - 12 * Math.hypot(column - 25, row - 25), 0)), count(() => 255)];
        """,
    )
    assert pieces == [2, 0], "a line is crossed going in, and going out"


def test_the_chart_fills_in_seconds_and_paints_red_from_below(open_page):
    sizes, label, low, high, marks = open_page().evaluate(
        """async () => {
            const { Chart } = await import("/static/chart.js");
            const canvas = Object.assign(document.createElement("canvas"), { width: 300, height: 400 });
            const chart = new Chart(canvas), given = [[10, 10], [15, 5]];
            chart.set(given);
            chart.add(30, 15, 5);
            chart.add(5 * 30 + 29, 5, 15);
            given[0][0] = 99;
            const mean = (y) => {
                const { data } = canvas.getContext("2d").getImageData(10, y, 40, 40);
                return [0, 2].map((k) => data.filter((_, i) => i % 4 === k).reduce((a, b) => a + b) / 1600);
            };
            const seen = [chart.sizes, canvas.getAttribute("aria-label"), mean(340), mean(20)];
            const blue = (x) => canvas.getContext("2d").getImageData(x, 3, 1, 1).data[2];
            const darkest = () => Math.min(blue(34), blue(35));
            const before = darkest();
            chart.set(chart.sizes, 3);
            return [...seen, darkest() < before - 60];
        }"""
    )
    assert sizes == [[10, 10], [15, 5], [15, 5], [15, 5], [15, 5], [5, 15]]
    assert label == "Team sizes over time: now red 5, blue 15"
    assert low[0] > low[1] and high[1] > high[0] and marks


@pytest.mark.parametrize(
    ("leads", "second", "kind"),
    [
        ([0, 2, -4, -2, 0, 2, 6], 5, "lead"),  # behind, then ahead for good
        ([0, 2, -2, -6], 2, "lead"),  # the other side's
        ([0, 1, 1, 1, 6, 6], 4, "swing"),  # ahead from the start: the greatest gain
        ([0, 0, 0], None, None),
        ([0, 8, 0], 1, "swing"),  # nobody ahead at the end
        ([], None, None),
    ],
)
def test_the_turn_is_where_the_lead_was_won_for_good(leads, second, kind, open_page):
    turn = open_page().evaluate(
        """async (leads) => {
            const { turningPoint } = await import("/static/chart.js");
            return turningPoint(leads.map((lead) => [10 + lead / 2, 10 - lead / 2]));
        }""",
        leads,
    )
    assert turn == (None if second is None else {"second": second, "kind": kind})


def test_captures_and_scores_are_told_together_and_not_too_often(open_page):
    page = open_page()
    listed, told, toast = page.evaluate(
        """async () => {
            const { News } = await import("/static/news.js");
            const played = [], news = new News({ play: (kind) => played.push(kind) });
            const frame = (tick, ...teams) => ({ tick, teams });
            news.forget(0);
            news.captures([1], frame(60, 0, 0, 1));
            news.captures([], frame(63, 0, 0, 1));
            news.captures([2], frame(66, 0, 0, 0));
            news.captures([0], frame(120, 1, 0, 0));
            const text = (id) => document.getElementById(id).textContent;
            const listed = [...document.querySelectorAll("#log li")].map((line) => [line.className, line.textContent]);
            return [listed, [text("told"), played], text("toast")];
        }"""
    )
    assert listed == [["blue", "0:04 Blue took 1 of yours"], ["red", "0:02 You took 2 drones"]]
    assert told == ["", ["took", "took", "lost"]] and toast == "Blue took 1 of yours"
    expect(page.locator("#told")).to_have_text("You took 2 drones, Blue took 1 of yours. Red 2, blue 1.")


def test_what_one_did_oneself_is_answered_for_two_seconds_whatever_is_captured(open_page):
    page = open_page()
    seen = page.evaluate(
        """async () => {
            const { News } = await import("/static/news.js");
            const news = new News({ play: () => {} }), now = performance.now.bind(performance);
            let later = 0;
            performance.now = () => now() + later;
            news.forget(0);
            news.answer("Undone");
            const seen = [], text = (id) => document.getElementById(id).textContent;
            const look = () => seen.push(["toast", "told"].map(text));
            news.captures([0], { tick: 30, teams: [1, 0] });
            news.tell();
            look();
            later = 2100;
            news.captures([1], { tick: 90, teams: [1, 0] });
            news.tell();
            look();
            return [...seen, document.querySelectorAll("#log li").length];
        }"""
    )
    told = "You took 1 drone, Blue took 1 of yours. Red 1, blue 1."
    assert seen == [["Undone", "Undone"], ["You took 1 drone", told], 2]


def test_a_moment_is_told_as_it_is(open_page):
    page = open_page()
    said = page.evaluate(
        """async () => {
            const { Replay } = await import("/static/replay.js");
            const chart = { set: () => {}, show: () => {} };
            const replay = new Replay({ send: () => {} }, chart), moment = document.getElementById("moment");
            replay.show({ phase: "replay", last_tick: 9000, verified: true, sizes: [[10, 10]], outcome: "draw" });
            replay.follow(90);
            const said = [moment.getAttribute("aria-valuetext")];
            moment.value = 4500;
            moment.dispatchEvent(new Event("input"));
            return [...said, moment.getAttribute("aria-valuetext")];
        }"""
    )
    assert said == ["3 seconds of 5 minutes 0 seconds", "2 minutes 30 seconds of 5 minutes 0 seconds"]


def test_a_recorded_games_captures_are_places_to_go_to_and_its_moment_is_in_the_chart(open_page):
    page = open_page()
    lines, sent, label, moved = page.evaluate(
        """async () => {
            const { Chart } = await import("/static/chart.js"), { Replay } = await import("/static/replay.js");
            const canvas = Object.assign(document.createElement("canvas"), { width: 300, height: 100 });
            const sent = [], link = { send: (message) => sent.push(message) };
            const chart = new Chart(canvas), replay = new Replay(link, chart);
            const sizes = [...Array(40).fill([10, 10]), [9, 11], ...Array(20).fill([12, 8])];
            replay.show({ phase: "replay", last_tick: 1820, verified: true, sizes, outcome: "red" });
            const lines = [...document.querySelectorAll("#log li")].map((line) => [line.className, line.textContent]);
            const at = (x) => [...canvas.getContext("2d").getImageData(x, 40, 1, 1).data];
            const before = at(242);
            document.querySelectorAll("#log button")[1].click();
            replay.follow(1500);
            const cursor = chart.cursor, moved = String(at(242)) !== String(before);
            const pace = document.getElementById("pace");
            pace.value = "4";
            pace.dispatchEvent(new Event("change"));
            replay.hold(true);
            replay.hold(true);
            replay.hold(false);
            return [lines, sent, [cursor, canvas.getAttribute("aria-label")], moved];
        }"""
    )
    assert lines == [
        ["blue", "0:39 Blue +1: red 9, blue 11"],
        ["red", "0:40 Red +3: red 12, blue 8, the turn"],
        ["red", "1:00 Red +8: red 20, blue 0"],
    ]
    assert sent == [{"type": "seek", "tick": 1170}, *({"type": "pace", "speed": speed} for speed in (4, 0, 4))]
    assert label == [50, "Team sizes over time: now red 12, blue 8"] and moved


@pytest.mark.parametrize("sight", ["", "protan", "deutan", "tritan"])
def test_colours_differ_for_everybody(sight):
    script = (STATIC / "ground.js").read_text()
    red, blue = re.search(r'COLOURS = \["(#\w+)", "(#\w+)"\]', script).groups()
    shades = re.search(r'SHADES = \["(#\w+)", "(#\w+)"\]', script).groups()

    def seen(colour):
        return Color(colour).filter(sight) if sight else Color(colour)

    pairs = [
        (red, blue),
        (red, "white"),
        (blue, "white"),
        *((drone, shade) for drone in (red, blue) for shade in shades),
    ]
    for one, other in pairs:
        assert seen(one).delta_e(seen(other), method="2000") >= 20, (one, other)


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


def test_a_stroke_by_keys_is_sent_when_the_brush_is_lifted(open_page, table):
    page = open_page(width=1000, height=700)
    room = begin(page)
    page.focus("#arena")
    for key in ("Space", "Shift+ArrowUp", "Space", "Enter"):
        page.keyboard.press(key)
    commands(page, table, room, 1)
    page.keyboard.press("c")
    assert commands(page, table, room, 2) == [[0.5], []]


def test_spread_out_sends_a_drawing_of_nothing(open_page, table):
    page = open_page(width=1000, height=700)
    room = begin(page)
    Hand(page).draw((0.2, 0.2), (0.4, 0.2))
    assert commands(page, table, room, 1) == [[0.2]]
    page.click("#spread")
    expect(page.locator("#told")).to_have_text("Sent: spread out")
    page.click("#spread")
    commands(page, table, room, 2)
    Hand(page).draw((0.2, 0.8), (0.4, 0.8))
    assert commands(page, table, room, 3) == [[0.2], [], [0.8]]


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


def test_undoing_what_was_not_sent_sends_nothing(open_page, table):
    page = open_page(width=1000, height=700)
    room = begin(page)
    hand = Hand(page)
    hand.draw((0.2, 0.2), (0.4, 0.2))
    commands(page, table, room, 1)
    page.locator("#on-lift").set_checked(False)
    hand.draw((0.2, 0.5), (0.4, 0.5))
    page.click("#undo")
    page.click("#send")  # what was sent before is in force
    hand.draw((0.2, 0.8), (0.4, 0.8))
    page.click("#send")
    assert commands(page, table, room, 2) == [[0.2], [0.8]]


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


def test_a_server_that_falls_silent_is_noticed(own_table, open_page):
    page = open_page()
    page.goto(f"http://{own_table.address}/")
    page.wait_for_selector("#opponent option", state="attached")
    begin(page)
    page.wait_for_selector("#arena[data-tick]")
    own_table.process.send_signal(signal.SIGSTOP)
    try:
        expect(page.locator("#silence")).to_have_text(re.compile("silent"))
    finally:
        own_table.process.send_signal(signal.SIGCONT)
    expect(page.locator("#silence")).to_be_empty()


LATE = """(() => {
    const send = WebSocket.prototype.send, way = 400;
    const say = (socket, data) => socket.readyState === WebSocket.OPEN && send.call(socket, data);
    WebSocket.prototype.send = function (data) { setTimeout(say, way, this, data); };
    const handler = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
    const set = function (hear) { handler.set.call(this, (event) => setTimeout(() => hear.call(this, event), way)); };
    Object.defineProperty(WebSocket.prototype, "onmessage", { ...handler, set });
})()"""


def test_who_is_far_away_sees_the_game_too(own_table, open_page):
    page = open_page()
    page.add_init_script(LATE)
    page.goto(f"http://{own_table.address}/")
    page.wait_for_selector("#opponent option", state="attached")
    begin(page)
    expect(page.locator("#time")).to_have_text(re.compile("[1-9]"))
    # Not at once: a page that is busy while it loads knows the server's clock from a later answer only.
    eventually(page, lambda: int(page.locator("#arena").get_attribute("data-age")) >= 390)


def test_sound_is_off_by_one_switch_that_is_remembered(open_page):
    page = open_page()
    made = """() => {
        window.made = 0;
        const Real = window.AudioContext;
        window.AudioContext = class extends Real { constructor() { super(); window.made++; } };
    }"""
    begin(page)
    page.evaluate(made)
    page.click("#sound")
    expect(page.locator("#sound")).to_have_attribute("aria-pressed", "false")
    assert page.evaluate("window.made") == 0
    page.reload()
    expect(page.locator("#sound")).to_have_attribute("aria-pressed", "false")
    page.evaluate(made)
    page.wait_for_selector("#send:not([disabled])")
    page.click("#sound")
    expect(page.locator("#sound")).to_have_attribute("aria-pressed", "true")
    assert page.evaluate("window.made") == 1, "and is heard when it is turned on"


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
