// A seat at the table: drawings and commands that are placed, by fingers and keys, as they are
// sent; and what is said of them. Seats are as the server describes them, and it reads afterwards what was sent.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, bytes, fixtures, Line, reload, settled, time } from "./page.js";
import { decode } from "../../../swarm_pz/play/static/frames.js";
import { Table } from "../../../swarm_pz/play/static/table.js";
import "../../../swarm_pz/play/static/marks.js";
import "../../../swarm_pz/play/static/replay.js";
import "../../../swarm_pz/play/static/responses.js";

beforeEach(() => {
  reload();
  localStorage.removeItem("swarm-pz.drawings");
});

// Sit down at a table where a game runs.
async function sit(system = "ergodic", has = {}) {
  const line = Object.assign(new Line(), { system });
  const table = new Table(line, { left() {}, begin() {} });
  line.hear("welcome", { policies: [], opponents: [], addresses: [] });
  line.hear("seated", { ...fixtures.seats[system], ...has });
  await settled();
  line.hear("room", fixtures.room);
  const commands = () => line.said.filter(({ type }) => type === "command");
  return { table, line, commands, sent: () => commands().at(-1)?.command ?? commands().at(-1)?.strokes };
}

function point(type, [x, y], pointerId = 1) {
  at("arena").fire(type, { button: 0, pointerId, clientX: 100 * x, clientY: 100 * (1 - y) });
}

function draw(...points) {
  point("pointerdown", points[0]);
  for (const place of points.slice(1)) point("pointermove", place);
  point("pointerup", points.at(-1));
}

// Put a finger down, and another one; draw them apart to twice their distance, and turn by a quarter.
function pinch() {
  const moves = [[[0.5, 0.5], [0.6, 0.5]], [[0.53, 0.47], [0.58, 0.53]], [[0.55, 0.4], [0.55, 0.6]]];
  moves.forEach((places, i) => places.forEach((place, finger) => point(i ? "pointermove" : "pointerdown", place, finger)));
  moves.at(-1).forEach((place, finger) => point("pointerup", place, finger));
}

function press(...keys) {
  for (const key of keys) {
    const [name, ...held] = key.split("+").reverse(), has = { key: name || "+", shiftKey: held.includes("Shift") };
    for (const element of ["arena", "table"]) at(element).fire("keydown", has);
  }
}

const rounded = (value) => JSON.parse(JSON.stringify(value, (_, v) => (typeof v === "number" ? Math.round(v * 1e3) / 1e3 : v)));
const firsts = (commands) => commands.map(({ strokes }) => strokes.map(({ points }) => points[0][1]));

// --- drawings ---------------------------------------------------------------------------------------

test("a drawing is sent when the hand is lifted, and a second time says nothing new", async () => {
  const { commands } = await sit();
  draw([0.2, 0.2], [0.4, 0.2]);
  at("send").click();
  const [{ number, strokes, timing }, ...more] = commands();
  assert.deepEqual([number, strokes, more], [1, [{ brush: "attract", width: 0.1, points: [[0.2, 0.2], [0.4, 0.2]] }], []]);
  assert.deepEqual(Object.keys(timing), ["input_ms", "sent_ms", "offset_ms", "round_trip_ms", "drawing_ms"]);
});

test("two fingers draw one drawing, sent when both are lifted, and points that say nothing new are left out", async () => {
  const { commands } = await sit();
  point("pointerdown", [0.1, 0.1], 1);
  point("pointerdown", [0.9, 0.9], 2);
  point("pointermove", [0.103, 0.1], 1);
  point("pointermove", [0.2, 0.1], 1);
  point("pointerup", [0.2, 0.1], 1);
  assert.equal(commands().length, 0);
  point("pointerup", [0.9, 0.9], 2);
  assert.deepEqual(commands().map(({ strokes }) => strokes.map(({ points }) => points)), [[[[0.1, 0.1], [0.2, 0.1]], [[0.9, 0.9]]]]);
});

test("what the system takes away is not drawn", async () => {
  const { commands } = await sit();
  at("on-lift").checked = false;
  for (const [finger, y, end] of [[1, 0.7, "pointerup"], [2, 0.3, "pointercancel"]]) {
    point("pointerdown", [0.3, y], finger);
    point("pointermove", [0.5, y], finger);
    point(end, [0.5, y], finger);
  }
  at("send").click();
  assert.deepEqual(firsts(commands()), [[0.7]]);
});

test("a drawing that was sent is added to if that is asked, and else begun anew", async () => {
  for (const [isKept, counts] of [[true, [1, 2]], [false, [1, 1]]]) {
    reload();
    const { commands } = await sit();
    at("keep").checked = isKept;
    at("keep").fire("change");
    draw([0.2, 0.2]);
    draw([0.2, 0.8]);
    assert.deepEqual(commands().map(({ strokes }) => strokes.length), counts);
  }
});

test("undo sends the drawing before what was sent, and of what was not sent nothing", async () => {
  const { commands } = await sit();
  draw([0.2, 0.2]);
  draw([0.2, 0.8]);
  at("undo").click();
  assert.equal(at("told").textContent, "Undone: the drawing before was sent");
  at("undo").click();
  assert.equal(at("told").textContent, "Undone: spread out was sent");
  assert.equal(at("undo").disabled, true);
  assert.deepEqual(firsts(commands()), [[0.2], [0.8], [0.2], []]);
  at("on-lift").checked = false;
  draw([0.2, 0.5]);
  at("undo").click();
  at("send").click();
  draw([0.2, 0.3]);
  draw([0.2, 0.4]);
  at("undo").click();
  at("send").click();
  assert.deepEqual(firsts(commands()).slice(4), [[0.3]]);
});

test("clear empties the drawing and sends nothing, by button and by key, and undo brings it back", async () => {
  const { table, commands } = await sit();
  draw([0.2, 0.2]);
  at("on-lift").checked = false;
  at("keep").checked = true;
  at("keep").fire("change");
  for (const clear of [() => at("clear").click(), () => press("Delete"), () => press("Backspace")]) {
    draw([0.2, 0.8]);
    clear();
    assert.deepEqual([table.controls.pen.strokes, commands().length, at("told").textContent], [[], 1, "Cleared: nothing was sent"]);
  }
  at("undo").click();
  at("send").click();
  assert.deepEqual(firsts(commands()), [[0.2], [0.8]]);
});

test("brushes, their width, a stroke and its sending go by keys", async () => {
  const { commands } = await sit();
  press("k", "g", "+", "Shift+ArrowRight", " ", "Shift+ArrowUp", "ArrowLeft", " ", "Enter");
  const { strokes } = commands().at(-1);
  assert.deepEqual(rounded(strokes), [{ brush: "attract", width: 0.12, points: [[0.6, 0.5], [0.6, 0.6], [0.58, 0.6]] }]);
  press("c", "c", "u");
  assert.deepEqual(firsts(commands()), [[0.5], [], [0.5]], "and says nothing twice");
});

test("a large drawing keeps its shape and no more points than the server takes", async () => {
  const { commands } = await sit();
  at("on-lift").checked = false;
  for (let stroke = 0; stroke < 20; stroke++) {
    draw(...Array.from({ length: 600 }, (_, k) => [0.1 + k / 1000, 0.05 + 0.04 * stroke + 0.01 * (k % 2)]));
  }
  at("send").click();
  const [{ strokes }] = commands(), count = strokes.reduce((sum, { points }) => sum + points.length, 0);
  assert.ok(strokes.length === 20 && count > 2000 && count <= fixtures.points);
  assert.ok(strokes.every(({ points }) => points.at(-1)[0] === 0.699));
});

test("places beyond the board stay where the server takes them", async () => {
  const { sent } = await sit();
  draw([-7, 0.5], [0.5, 9]);
  assert.deepEqual(sent()[0].points, [[-0.5, 0.5], [0.5, 1.5]]);
});

test("nothing is drawn or sent before the game, without a seat, on a lost line, or on a button over the board", async () => {
  const { table, line, commands } = await sit();
  line.hear("room", { ...fixtures.room, phase: "waiting" });
  draw([0.2, 0.2]);
  line.hear("room", { ...fixtures.room, phase: "starting" });
  assert.equal(at("send").disabled, false, "while it counts down one may draw");
  line.isOpen = false;
  line.hear("closed");
  draw([0.2, 0.2]);
  assert.equal(at("send").disabled, true);
  line.isOpen = true;
  at("arena").closest = () => at("ready");
  draw([0.2, 0.2]);
  table.seat = null;
  at("send").click();
  assert.deepEqual([commands(), table.controls.pen.strokes], [[], []]);
});

// --- attractors -------------------------------------------------------------------------------------

test("a tap places an attractor, a drag moves it, the slider and two fingers weigh it", async () => {
  const { sent, table } = await sit("flocking");
  const [least, most] = table.controls.pen.sizes;
  draw([0.2, 0.8]);
  assert.deepEqual(rounded(sent()), rounded([[0.2, 0.8, (least + most) / 2]]));
  draw([0.2, 0.8], [0.4, 0.6]);
  assert.deepEqual(rounded(sent()[0].slice(0, 2)), [0.4, 0.6]);
  at("width").value = least + 0.2 * (most - least);
  at("width").fire("input");
  at("width").fire("change");
  const weight = sent()[0][2];
  pinch();
  assert.ok(Math.abs(sent()[0][2] - Math.min(2 * weight, most)) < 0.05 * weight, "as the fingers went apart");
});

test("further taps add attractors where that is asked, and no more than there may be", async () => {
  const { commands, sent, table } = await sit("flocking");
  at("keep").checked = true;
  at("keep").fire("change");
  for (let i = 0; i < table.controls.pen.most + 2; i++) {
    draw([0.05 + 0.9 * i / (table.controls.pen.most + 2), 0.2]);
    assert.equal(sent().length, Math.min(i + 1, table.controls.pen.most));
  }
  at("keep").checked = false;
  at("keep").fire("change");
  draw([0.5, 0.9]);
  assert.equal(sent().length, 1);
  at("undo").click();
  assert.equal(sent().length, table.controls.pen.most);
  at("spread").click();
  assert.deepEqual(sent(), fixtures.seats.flocking.commands.default);
  assert.equal(new Set(commands().map(({ number }) => number)).size, commands().length);
});

// --- leaders ----------------------------------------------------------------------------------------

test("the nearest leader is dragged, and keys move one after the other", async () => {
  const { sent } = await sit("leader_follower"), before = fixtures.seats.leader_follower.commands.default;
  const nearest = before.map(([x, y]) => Math.hypot(x - 0.8, y - 0.7)), which = nearest.indexOf(Math.min(...nearest));
  draw([0.8, 0.7], [0.9, 0.9]);
  assert.deepEqual(rounded(sent()), rounded(before.map((place, i) => (i === which ? [0.9, 0.9] : place))));
  at("spread").click();
  press("ArrowUp", "n", "Shift+ArrowRight", " ");
  const moved = sent().map(([x, y], i) => [x - before[i][0], y - before[i][1]]);
  assert.deepEqual(rounded(moved).filter(([x, y]) => x || y).length, Math.min(before.length, 2));
  assert.ok(rounded(moved).flat().includes(0.02) && rounded(moved).flat().includes(0.1));
});

// --- formations -------------------------------------------------------------------------------------

test("a formation is chosen, dropped, sized and turned by fingers", async () => {
  const { sent, commands, table } = await sit("formation"), { shapes } = table.controls.pen.commands;
  const buttons = () => at("shapes").children, size = 0.2;
  assert.deepEqual(buttons().map(({ textContent }) => textContent), shapes);
  assert.equal(buttons()[shapes.indexOf("ring")].getAttribute("aria-pressed"), "true");
  at("width").value = size;
  at("width").fire("input");
  buttons()[2].click();
  assert.equal(buttons()[2].getAttribute("aria-pressed"), "true");
  assert.deepEqual(rounded(sent()), rounded({ shape: shapes[2], centre: [0.5, 0.5], size, turn: 0 }));
  draw([0.3, 0.3], [0.4, 0.7]);
  assert.deepEqual(rounded(sent().centre), [0.4, 0.7]);
  pinch();
  assert.ok(Math.abs(sent().size - 2 * size) < 0.02 && Math.abs(Math.abs(sent().turn) - Math.PI / 2) < 0.1);
  assert.deepEqual(rounded(sent().centre).map((value) => Math.abs(value - 0.5) < 0.02), [true, true]);
  assert.equal(commands().length, 3);
});

test("a formation is moved, sized and turned by keys, wheel and sliders, on the board", async () => {
  const { sent, commands, table } = await sit("formation"), { x, y, size, turn } = table.controls.pen.mark;
  const step = (table.controls.pen.sizes[1] - table.controls.pen.sizes[0]) / 25, part = (table.controls.pen.turns[1] - table.controls.pen.turns[0]) / 24;
  const near = (value, wanted) => assert.ok(Math.abs(value - wanted) < 1e-3, `${value} is not ${wanted}`);
  press("ArrowLeft", "+", "[", "[", " ");
  assert.deepEqual(rounded(sent().centre), rounded([x - 0.02, y]));
  near(sent().size, size + 2 * step);
  near(sent().turn, turn + 2 * part);
  const wheel = (has) => {
    at("arena").fire("wheel", { deltaY: 100, deltaX: 0, ...has });
    time.pass(300);
  };
  wheel();
  near(sent().size, size + step);
  wheel({ shiftKey: true });
  near(sent().turn, turn + part);
  at("turn").value = 1.5;
  at("turn").fire("input");
  at("turn").fire("change");
  near(sent().turn, 1.5);
  at("undo").click();
  near(sent().turn, turn + part);
  assert.equal(commands().length, 5);
  for (let i = 0; i < 60; i++) press("+", "ArrowLeft");
  press(" ");
  near(sent().size, table.controls.pen.sizes[1]);
  assert.equal(sent().centre[0], 0.5, "so large it fits in the middle alone");
});

test("a saved formation of another game is sent within the bounds of this one, and a drawing is none", async () => {
  const { sent, table } = await sit("formation"), { shapes } = table.controls.pen.commands;
  table.controls.library.take([
    { name: "A", kind: "strokes", strokes: [{ brush: "attract", width: 0.1, points: [[0.5, 0.5]] }] },
    { name: "B", kind: "formation", strokes: [{ x: 1, y: 0, size: 900, turn: 0, shape: 77 }] },
  ]);
  press("1");
  assert.deepEqual(sent(), { shape: shapes.at(-1), centre: [0.5, 0.5], size: table.controls.pen.sizes[1], turn: 0 });
  assert.equal(at("told").textContent, "Sent: B");
});

const seen = (teams, positions) => ({ tick: 3, serverMs: time.ms, fields: null, teams: Uint8Array.from(teams), positions: Float32Array.from(positions), velocities: new Float32Array(2 * teams.length) });

// --- all of them ------------------------------------------------------------------------------------

test("who has no gesture is told so, and can send nothing", async () => {
  const commands = { system: "spells", takes: "spells", shape: [1], low: 0, high: 1, default: [0], serves_densities: false, shapes: [] };
  const seat = await sit("ergodic", { commands });
  assert.equal(at("hint").textContent, "This page cannot give spells. Programs can.");
  draw([0.5, 0.5], [0.6, 0.6]);
  assert.deepEqual([at("send").disabled, seat.commands()], [true, []]);
});

test("each kind of commands has its own tools and no others", async () => {
  const tools = ["brushes", "placing", "shapes", "sized", "turned", "send", "lifting", "adding"], seen = {};
  for (const system of Object.keys(fixtures.seats)) {
    reload();
    await sit(system);
    seen[system] = tools.filter((tool) => !at(tool).hidden).join(" ");
  }
  assert.deepEqual(seen, {
    ergodic: "brushes sized send lifting adding", direct: "placing", formation: "placing shapes sized turned send lifting",
    leader_follower: "placing send lifting", flocking: "placing sized send lifting adding",
    potential_field: "brushes sized send lifting adding",
  });
});

// --- what a seat knows of its commands --------------------------------------------------------------

const inForce = (number, has = {}) => ({ seat: "red", number, tick: 30, server_ms: 0, sender: "", ...has });
const shown = (line, tick) => {
  line.hear("frame", { ...seen([0, 1], [0.1, 0.1, 0.9, 0.9]), tick });
  time.frame();
};

test("a command is told as painted once a moment after it is shown, and not before", async () => {
  const { line } = await sit();
  draw([0.2, 0.2]);
  line.hear("in_force", inForce(1));
  line.hear("in_force", inForce(5, { seat: "blue" }));
  shown(line, 30);
  assert.equal(line.count("painted"), 0);
  shown(line, 31);
  assert.deepEqual(line.last("painted"), { type: "painted", number: 1, painted_ms: time.ms });
  shown(line, 32);
  assert.equal(line.count("painted"), 1);
});

test("ink goes once the swarm follows what was sent last, and not for an older command or a response", async () => {
  const { line, table } = await sit();
  draw([0.2, 0.2]);
  draw([0.2, 0.8]);
  line.hear("in_force", inForce(1));
  line.hear("in_force", inForce(2, { sender: "auto:ring" }));
  line.hear("in_force", inForce(2, { seat: "blue" }));
  time.pass(1000);
  assert.equal(table.controls.pen.strength, 0.4);
  line.hear("in_force", inForce(2));
  time.pass(300);
  assert.equal(table.controls.pen.strength, 0.2);
  time.pass(300);
  assert.equal(table.controls.pen.strength, 0);
});

test("a ring that is too small to have a middle is told of once its target is known, and no other drawing", async () => {
  const { line, commands } = await sit(), ring = (radius) => Array.from({ length: 40 }, (_, k) => [0.5 + radius * Math.cos(k / 6), 0.5 + radius * Math.sin(k / 6)]);
  const told = (points, middle) => {
    at("told").textContent = "";
    draw(...points);
    line.hear("target", { team: 0, number: commands().at(-1).number, cells: 50, picture: new Uint8Array(2500).fill(middle) });
    return at("told").textContent.startsWith("Too small a ring");
  };
  assert.deepEqual([told(ring(0.1), 200), told(ring(0.2), 90), told(ring(0.4), 200), told([[0.4, 0.5], [0.6, 0.5]], 200)], [true, false, false, false]);
});

test("a shared command is followed once, whatever its helper asks for later", async () => {
  const { line, table } = await sit();
  draw([0.2, 0.2]);
  for (let i = 0; i < 3; i++) line.hear("in_force", inForce(1, { sender: "shared:ring" }));
  assert.equal(table.controls.unseen.length, 1);
});

test("a page that is loaded anew goes on counting its commands", async () => {
  const { line, commands } = await sit();
  line.hear("target", { ...decode(bytes(fixtures.targets[0].bytes)), team: 1 });
  line.hear("target", { ...decode(bytes(fixtures.targets[0].bytes)), team: 0 });
  draw([0.2, 0.2]);
  assert.equal(commands()[0].number, 10);
});

test("what an experimenter varies is said, and nothing where nothing is varied", async () => {
  const { table } = await sit("ergodic", { factors: fixtures.factors });
  assert.equal(at("varied").textContent, "Not shown here: your opponents, trails. A program makes 50 % of each command.");
  assert.deepEqual([at("varied").hidden, table.arena.rate, table.arena.hasTrails], [false, 10, false]);
  reload();
  const plainly = await sit();
  assert.deepEqual([at("varied").hidden, plainly.table.arena.rate, plainly.table.arena.hasTrails], [true, 30, true]);
});

test("sizes, time and who plays are shown, and a server that falls silent is noticed", async () => {
  const { line } = await sit();
  shown(line, 95);
  assert.deepEqual(["red-size", "blue-size", "time", "time-of", "red-who", "blue-who"].map((id) => at(id).textContent),
    ["1", "1", "0:03", "of 5:00", "(you)", "blind ring"]);
  time.pass(2000);
  time.frame();
  assert.equal(at("silence").textContent, "");
  time.pass(1);
  time.frame();
  assert.match(at("silence").textContent, /silent/);
  shown(line, 98);
  assert.equal(at("silence").textContent, "", "it speaks again");
});

test("a lesson that waits is no game that goes on", async () => {
  const { line, table } = await sit();
  shown(line, 33);
  table.lesson = { held: true, running: true };
  line.hear("frame", { ...seen([0, 1], [0.1, 0.1, 0.9, 0.9]), tick: 36 });
  assert.deepEqual([table.lastTick, table.controls.mayPlay(), table.isPlaying], [33, false, false]);
});

test("what one has left is shown no more, and leaving a game that others play is asked about", async () => {
  const { line, table } = await sit();
  assert.equal(table.isPlaying, true);
  line.hear("room", { ...fixtures.room, settings: { ...fixtures.room.settings, blue: 0 } });
  assert.equal(table.isPlaying, false, "nobody else is in it");
  table.leave();
  assert.deepEqual([line.count("leave"), table.seat, at("controls").hidden], [1, null, true]);
  line.hear("frame", seen([0, 1], [0.1, 0.1, 0.9, 0.9]));
  assert.equal(table.arena.frame, null);
});

test("a game that one wins unlocks the next opponent, one that one loses does not, and each has a story of its own", async () => {
  const { line, table } = await sit(), beaten = () => JSON.parse(localStorage.getItem("swarm-pz.progress"))?.beaten ?? [];
  localStorage.removeItem("swarm-pz.progress");
  for (const [outcome, of] of [["blue", []], ["draw", []], ["red", ["blind_ring"]]]) {
    line.hear("room", { ...fixtures.room, phase: "starting" });
    assert.deepEqual(table.story.captures, []);
    line.hear("room", fixtures.room);
    table.story.captures.push({});
    line.hear("room", { ...fixtures.room, phase: "over", outcome, red: { ...fixtures.room.red, ready: false } });
    time.frame();
    assert.deepEqual([beaten(), document.activeElement.id], [of, "cover-text"], outcome);
  }
});
