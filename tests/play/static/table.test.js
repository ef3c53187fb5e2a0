// A player's seat: drawings and commands by touch and keys, as they are sent, and what the page tells of them.
// The server's code describes the seats, and later reads what was sent.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, bytes, fixtures, Line, reload, settled, time } from "./page.js";
import { decode } from "../../../swarm_pz/play/static/frames.js";
import { Table } from "../../../swarm_pz/play/static/table.js";
import "../../../swarm_pz/play/static/marks.js";
import "../../../swarm_pz/play/static/practice.js";
import "../../../swarm_pz/play/static/replay.js";

beforeEach(() => {
  reload();
  localStorage.removeItem("swarm-pz.drawings");
});

// Take a seat in a running game.
async function sit(system = "ergodic", patch = {}) {
  const line = Object.assign(new Line(), { system });
  const table = new Table(line, { left() {}, begin() {} });
  line.hear("welcome", { policies: [], opponents: [], addresses: [] });
  line.hear("seated", { ...fixtures.seats[system], ...patch });
  await settled();
  line.hear("room", fixtures.room);
  const commands = () => line.sent.filter(({ type }) => type === "command");
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

function press(...keys) {
  for (const key of keys) {
    const [name, ...held] = key.split("+").reverse(), fields = { key: name || "+", shiftKey: held.includes("Shift") };
    at("arena").fire("keydown", fields);
    dispatchEvent(Object.defineProperty(Object.assign(new Event("keydown"), fields), "target", { value: at("arena") }));
  }
}

const rounded = (value) => JSON.parse(JSON.stringify(value, (_, v) => (typeof v === "number" ? Math.round(v * 1e3) / 1e3 : v)));
const firsts = (commands) => commands.map(({ strokes }) => strokes.map(({ points }) => points[0][1]));

// --- drawings ---------------------------------------------------------------------------------------

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

test("nothing is drawn or sent before the game, without a seat, on a lost line, while a lesson explains, or on a button over the board", async () => {
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
  table.lesson = { ...table.lesson, held: true };
  draw([0.2, 0.2]);
  table.lesson.held = false;
  at("arena").closest = () => at("ready");
  draw([0.2, 0.2]);
  table.seat = null;
  at("send").click();
  assert.deepEqual([commands(), table.controls.pen.strokes], [[], []]);
});

// --- attractors -------------------------------------------------------------------------------------

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

test("a tap leads the nearest leader there, and keys lead another one", async () => {
  const { sent } = await sit("leader_follower"), [first, second] = fixtures.seats.leader_follower.commands.default;
  draw([first[0] + 0.01, first[1]], [0.3, 0.6]);
  assert.deepEqual(rounded(sent()), rounded([[0.3, 0.6], second]));
  press("n", "Shift+ArrowUp", " ");
  assert.deepEqual(rounded(sent()), rounded([[0.3, 0.6], [second[0], second[1] + 0.1]]));
});

// --- formations -------------------------------------------------------------------------------------

test("a formation is chosen, dropped, sized and turned, and stays on the board", async () => {
  const { sent, commands, table } = await sit("formation"), { shapes } = table.controls.pen.commands, { sizes, turns } = table.controls.pen;
  at("shapes").children[2].click();
  draw([0.3, 0.3], [0.4, 0.7]);
  press("ArrowLeft", "+", "[", "[", " ");
  const { shape, centre, size, turn } = sent();
  assert.deepEqual(rounded([shape, centre]), [shapes[2], [0.38, 0.7]]);
  assert.deepEqual(rounded([size, turn]), rounded([sizes[1] / 2 + 2 * (sizes[1] - sizes[0]) / 25, 2 * (turns[1] - turns[0]) / 24]));
  at("turn").value = 1.5;
  at("turn").fire("input");
  at("turn").fire("change");
  at("undo").click();
  assert.deepEqual(rounded(commands().slice(-2).map(({ command }) => command.turn)), rounded([1.5, turn]));
  at("shapes").children[shapes.indexOf("ring")].click();
  for (let i = 0; i < 60; i++) press("+", "ArrowLeft");
  press(" ");
  assert.deepEqual(rounded([sent().size, sent().centre[0]]), [rounded(sizes[1]), 0]);
});

test("a saved formation of another game is sent within the bounds of this one, and a drawing is none", async () => {
  const { sent, table } = await sit("formation"), { shapes } = table.controls.pen.commands;
  table.controls.library.take([
    { kind: "strokes", strokes: [{ brush: "attract", width: 0.1, points: [[0.5, 0.5]] }] },
    { kind: "formation", strokes: [{ x: 1, y: 0, size: 900, turn: 0, shape: 77 }] },
  ]);
  press("1");
  assert.deepEqual(sent(), { shape: shapes.at(-1), centre: [1, 0], size: table.controls.pen.sizes[1], turn: 0 });
  assert.equal(at("told").textContent, "Sent: 1");
});

const scene = (teams, positions) => ({ tick: 3, serverMs: time.ms, fields: null, teams: Uint8Array.from(teams), positions: Float32Array.from(positions), velocities: new Float32Array(2 * teams.length) });

// --- what a seat knows of its commands --------------------------------------------------------------

const inForce = (number, patch = {}) => ({ seat: "red", number, tick: 30, server_ms: 0, sender: "", ...patch });

test("a shared command is followed once, whatever its helper asks for later", async () => {
  const { line, table } = await sit();
  draw([0.2, 0.2]);
  let followed = 0;
  table.controls.pen.setInForce = () => followed++;
  for (let i = 0; i < 3; i++) line.hear("in_force", inForce(1, { sender: "shared:ring" }));
  assert.equal(followed, 1);
});

test("a page that is loaded anew goes on counting its commands", async () => {
  const { line, commands } = await sit();
  line.hear("target", { ...decode(bytes(fixtures.targets[0].bytes)), team: 1 });
  line.hear("target", { ...decode(bytes(fixtures.targets[0].bytes)), team: 0 });
  draw([0.2, 0.2]);
  assert.equal(commands()[0].number, 10);
});

test("what one has left is shown no more, and leaving a game that others play is asked about", async () => {
  const { line, table } = await sit();
  assert.equal(table.isPlaying, true);
  line.hear("room", { ...fixtures.room, settings: { ...fixtures.room.settings, blue: 0 } });
  assert.equal(table.isPlaying, false, "nobody else is in it");
  table.leave();
  assert.deepEqual([line.count("leave"), table.seat, at("controls").hidden], [1, null, true]);
  line.hear("frame", scene([0, 1], [0.1, 0.1, 0.9, 0.9]));
  assert.equal(table.arena.frame, null);
});

test("a game that one wins unlocks the next opponent, and no other game does", async () => {
  const { line } = await sit(), beaten = () => Object.keys(JSON.parse(localStorage.getItem("swarm-pz.progress"))?.stars ?? {});
  localStorage.removeItem("swarm-pz.progress");
  for (const [outcome, names] of [["blue", []], ["draw", []], ["red", ["blind_ring"]]]) {
    line.hear("room", fixtures.room);
    line.hear("room", { ...fixtures.room, phase: "over", outcome });
    assert.deepEqual(beaten(), names, outcome);
  }
});

test("after a game between people both see the score, who wants another one, and no script to go to", async () => {
  const { line, table } = await sit(), person = { ...fixtures.room.blue, kind: "person", name: "", label: "Bob", ready: false, policy_state: null };
  const end = (other = {}, own = {}, outcome = "red") => {
    line.hear("room", { ...fixtures.room, phase: "over", outcome, wins: [2, 1], blue: { ...person, ...other }, red: { ...fixtures.room.red, ready: false, ...own } });
    return at("streak").textContent;
  };
  line.hear("room", { ...fixtures.room, blue: person });
  assert.match(end({}, {}, "blue"), /^You 2 : 1 Bob. In the next game you change sides/);
  assert.deepEqual([at("next-game").hidden, at("ready").hidden, at("ready").className], [true, false, "primary"]);
  assert.match(end({ ready: true }), /^You 2 : 1 Bob. Bob wants to play again/);
  assert.match(end({}, { ready: true }), /wait for the other player/);
  assert.match(end({ connected: false }), /Bob is away/);
  assert.match(end({ kind: "free", label: "" }), /has left/);
  assert.equal(at("invitation").hidden, false);
  line.hear("seated", { ...fixtures.seats.ergodic, seat: "blue" });
  line.hear("room", { ...fixtures.room, phase: "starting", wins: [1, 2], red: person });
  assert.deepEqual([table.seat, table.arena.guarded], [1, [1]]);
  const coverText = () => { // the text that the cover shows in the next frame
    end();
    return table.cover.result(90);
  };
  assert.match(coverText(), /^You lost/);
  table.seat = null;
  line.hear("seated", { ...fixtures.seats.ergodic, seat: "blue" });
  assert.match(coverText(), /^Red won/, "a newcomer has not lost");
  line.hear("room", fixtures.room);
  assert.match(coverText(), /^You lost/);
});

test("a recorded game is watched aside from its room, and one comes back to the result, or to the next game", async () => {
  const { line, table } = await sit(), over = { ...fixtures.room, phase: "over", outcome: "red", recording: "a.jsonl" };
  draw([0.2, 0.2]);
  line.hear("room", over);
  assert.deepEqual(table.controls.pen.strokes, [], "a late drawing is not on the board of a recorded game");
  table.putAside();
  line.hear("room", { ...fixtures.room, phase: "replay", recording: "a.jsonl", last_tick: 30 });
  assert.deepEqual([table.seat, at("red-who").textContent, table.holds({ ...over, code: "WXYZ" }), table.holds({ ...over, wins: [1, 0] })], [null, "(you)", false, true]);
  table.takeUp();
  assert.deepEqual([table.seat, table.room.wins, at("cover").hidden, line.count("leave")], [0, [1, 0], false, 0]);
  table.putAside();
  assert.deepEqual([table.holds({ ...over, phase: "starting" }), table.seat], [false, 0]);
  line.hear("room", over);
  table.putAside();
  table.leave();
  assert.deepEqual([line.count("leave"), table.leftPlace, table.aside], [1, over.code, null]);
});

test("while a room waits one practises in the page alone, until the game begins", async () => {
  const { line, table, commands } = await sit(), person = { ...fixtures.room.blue, kind: "person", name: "", policy_state: null };
  const waits = (patch = {}) => line.hear("room", { ...fixtures.room, phase: "waiting", red: { ...fixtures.room.red, ready: false }, blue: { ...person, ready: false, ...patch } });
  waits();
  assert.equal(at("practise").hidden, false);
  at("practise").click();
  await settled();
  draw([0.2, 0.2]);
  for (let i = 0; i < 40; i++) table.practice.step();
  assert.deepEqual([commands(), at("cover").hidden, table.arena.frame.tick, table.arena.ground.target.number], [[], true, 40, 1]);
  assert.equal(at("blue-who").textContent, "practice");
  waits({ ready: true, label: "Bob" });
  assert.deepEqual([at("practice-text").textContent, at("cover").hidden], ["Bob is ready. The game begins when you are.", true]);
  at("practice-stop").click();
  assert.deepEqual([at("cover").hidden, table.arena.frame], [false, null]);
  at("label").value = "Ann";
  at("label").fire("input");
  at("label").fire("change");
  assert.deepEqual(line.last("ready"), { type: "ready", ready: false, label: "Ann" }, "the other player sees the name at once");
  at("practise").click();
  await settled();
  line.hear("room", { ...fixtures.room, phase: "starting", blue: person });
  draw([0.2, 0.2]);
  assert.deepEqual([table.practice, commands().length], [null, 1]);
  at("ready").click();
  assert.equal(line.last("ready").label, "Ann");
});

test("captures that come too soon after shown ones are shown a moment later, though nothing more happens", async () => {
  const { line } = await sit(), places = [0.1, 0.1, 0.9, 0.9], shown = () => [at("red-size").textContent, at("log").all("li")[0]?.textContent];
  const hear = (tick, teams) => {
    line.hear("frame", { ...scene(teams, places), tick, serverMs: time.ms });
    time.frame();
  };
  hear(90, [1, 1]);
  hear(91, [0, 1]);
  assert.deepEqual(shown(), ["0", undefined]);
  time.pass(100);
  time.frame();
  assert.deepEqual(shown(), ["1", "0:03 You took 1 drone"]);
});

test("a game against a policy stops while one looks at help or at another tab, and no other game does", async (context) => {
  const { line, table } = await sit(), query = context.mock.method(document, "querySelector", () => null), pauses = () => line.sent.filter(({ type }) => type === "pause").map(({ paused }) => paused);
  const look = (dialog) => {
    query.mock.mockImplementation(() => dialog);
    time.frame();
  };
  look(at("legend"));
  time.frame();
  assert.deepEqual(pauses(), [true]);
  line.hear("room", { ...fixtures.room, paused: true });
  time.pass(5000);
  time.frame();
  assert.equal(at("silence").textContent, "Paused.");
  look(null);
  document.hidden = true;
  dispatchEvent(new Event("visibilitychange"));
  document.hidden = false;
  dispatchEvent(new Event("visibilitychange"));
  assert.deepEqual(pauses(), [true, false, true, false]);
  line.hear("room", { ...fixtures.room, blue: { ...fixtures.room.blue, kind: "person" } });
  look(at("legend"));
  line.hear("room", { ...fixtures.room, once: true });
  time.frame();
  table.seat = null;
  line.hear("room", fixtures.room);
  assert.equal(pauses().length, 4);
});

test("who watches two policies begins their game, and again once it is over, and gives no commands", async () => {
  // Catches a button that is hidden from those without a seat: then nobody can begin.
  const line = new Line(), table = new Table(line, { left() {}, begin() {} });
  line.hear("welcome", { policies: [], opponents: [], addresses: [] });
  const { blue } = fixtures.room, room = { ...fixtures.room, red: { ...blue, name: "noise" }, outcome: null };
  for (const [phase, text] of [["waiting", "Begin"], ["over", "Play again"]]) {
    line.hear("room", { ...room, phase, outcome: phase === "over" ? "draw" : null });
    await settled();
    assert.deepEqual([table.seat, at("ready").hidden, at("ready").textContent, at("controls").hidden], [null, false, text, true]);
    line.sent = [];
    at("ready").click();
    assert.ok(line.last("ready"));
  }
});

test("where the server falls silent, one is told so, until it is heard again", async () => {
  const { line } = await sit(), silence = (tick) => {
    line.hear("frame", { ...scene([0, 1], [0.1, 0.1, 0.9, 0.9]), tick });
    return [1900, 200].map((ms) => {
      time.pass(ms);
      time.frame();
      return at("silence").textContent;
    });
  };
  for (const tick of [3, 6]) assert.deepEqual(silence(tick).map((text) => text.includes("silent")), [false, true]);
});

test("a page sends nothing where it cannot give the commands of its seat", async () => {
  const { commands } = await sit("direct");
  draw([0.5, 0.5], [0.6, 0.6]);
  press("Enter");
  assert.deepEqual([at("send").disabled, commands()], [true, []]);
});
