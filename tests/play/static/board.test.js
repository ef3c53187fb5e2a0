// The board: the painted game, the chart of sizes, and recorded games.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, fixtures, Line, reload, time } from "./page.js";
import { Arena } from "../../../swarm_pz/play/static/arena.js";
import { Chart, turningPoint, untilTheEnd } from "../../../swarm_pz/play/static/chart.js";
import { Ground, look } from "../../../swarm_pz/play/static/ground.js";
import { Replay } from "../../../swarm_pz/play/static/replay.js";

const { cells, captures } = fixtures;
const canvas = (width = 500, height = 500) => Object.assign(document.createElement("canvas"), { width, height });
const field = (...marked) => {
  const values = new Uint8Array(cells * cells);
  for (const [column, row, value] of marked) values[cells * row + column] = value;
  return values;
};
// Two drones: one at (0.25, 0.11), the other at (0.75, 0.91).
const frame = (tick, teams, patch = {}) => ({
  tick, serverMs: time.ms, teams: Uint8Array.from(teams), fields: null,
  positions: Float32Array.from([0.25, 0.11, 0.75, 0.91]), velocities: new Float32Array(4), ...patch,
});
const near = (got, wanted, within = 1e-6) => assert.ok(Math.abs(got - wanted) <= within, `${got} is not ${wanted}`);
let arena;

beforeEach(() => {
  reload();
  arena = new Arena(canvas(), canvas(), () => time.ms);
  arena.isLive = arena.isCalm = true;
});

// Return the parts of the paths that were painted on a canvas in a colour.
const painted = (of, op, colour) => of.getContext("2d").done.filter((one) => one.op === op && one.style === colour).flatMap(({ path }) => path);

// --- the arena --------------------------------------------------------------------------------------

test("a jump is no capture, and trails begin anew", () => {
  arena.take(frame(0, [0, 1]));
  assert.deepEqual(arena.take(frame(31, [1, 0])), []);
  assert.equal(arena.trails.pieces.length, 0);
  assert.deepEqual(arena.take(frame(30, [0, 1])), [], "back in time");
});

test("waves of a victory begin where the last drone was captured", () => {
  arena.take(frame(3, [0, 1]));
  assert.deepEqual([...arena.lastCapture(0)], [0.5, 0.5]);
  arena.take(frame(4, [0, 0]));
  assert.deepEqual([...arena.lastCapture(0)], [0.75, 0.91].map(Math.fround));
});

test("a frame that is too old is not shown, a late link or few frames a second excuse it", () => {
  const shown = (ageMs) => {
    arena.take(frame(3, [0, 1], { serverMs: time.ms - ageMs }));
    return arena.paint() !== null;
  };
  assert.deepEqual([shown(249), shown(251)], [true, false]);
  arena.onTheWay = () => 400;
  assert.deepEqual([shown(649), shown(651)], [true, false]);
  arena.onTheWay = () => 0;
  arena.rate = 10;
  assert.deepEqual([shown(349), shown(351)], [true, false]);
});

test("drones are carried on by their velocities, at the speed of the game, for a moment at most and within the walls", () => {
  const place = (ageMs, settings = {}) => {
    Object.assign(arena, { speed: 1, rate: 30 }, settings);
    const motion = { serverMs: time.ms - ageMs, positions: Float32Array.from([0.2, 0.5]), velocities: Float32Array.from([2, 0]) };
    arena.take(frame(3, [0], motion));
    arena.paint();
    return arena.places[0];
  };
  near(place(50), 0.3);
  near(place(50, { speed: 0.5 }), 0.25);
  near(place(50, { speed: 2 }), 0.4);
  near(place(200), 0.4);
  near(place(50, { rate: 10 }), 0.2);
  near(place(50, { speed: 20 }), 1);
  near(place(-50), 0.2);
});

test("drones in danger are ringed: those that are guarded, on ground that nearly captures them or about to be", () => {
  const endangered = (guarded, cell, velocities = [0, 0, 0, 0]) => {
    arena.forget();
    arena.guarded = guarded;
    arena.take(frame(3, [0, 1], { fields: [field(), field(cell)], velocities: Float32Array.from(velocities) }));
    arena.paint();
    return arena.drones.getContext("2d").done.filter(({ op, style }) => op === "image" && painted(style, "stroke", look.ink).length).length;
  };
  const under = [12, 5, captures], ahead = [22, 5, 128];
  const ringed = [
    endangered([0], under), endangered([0, 1], under), endangered([1], under), endangered([0], [12, 5, 127]),
    endangered([0], ahead), endangered([0], ahead, [0.5, 0, 0, 0]),
  ];
  assert.deepEqual(ringed, [1, 1, 0, 0, 0, 1]);
});

test("trails lead without a gap from where drones were to where they are shown, and each piece makes older ones fainter", () => {
  const strokes = (of) => of.getContext("2d").done.filter(({ op, width }) => op === "stroke" && width < 2);
  const xs = (of) => strokes(of).flatMap(({ path }) => path.map(([, x]) => x)).slice(-2);
  const trail = arena.trails.canvas;
  const moved = (tick, x) => arena.take(frame(tick, [0], {
    positions: Float32Array.from([x, 0.5]), velocities: Float32Array.from([2, 0]), serverMs: time.ms - 50,
  }));
  moved(0, 0.1);
  moved(3, 0.15); // too soon for another piece of the trail
  moved(6, 0.2);
  arena.paint();
  xs(trail).forEach((x, i) => near(x, [50, 100][i], 1e-3));
  xs(arena.drones).forEach((x, i) => near(x, [100, 500 * arena.places[0]][i], 1e-3));
  assert.ok(Math.max(...[trail, arena.drones].flatMap(strokes).map(({ alpha }) => alpha)) < 0.4, "fainter than drones");
  const fades = () => trail.getContext("2d").done.filter(({ op, path }) => op === "fill" && path[0][3] === 500).length;
  const before = fades();
  for (let tick = 12; tick <= 180; tick += 6) moved(tick, 0.2);
  arena.paint();
  assert.equal(fades() - before, 25, "a page that was hidden paints no more than can be seen");
});

test("a board at rest is painted once, and again where it changes", () => {
  const paints = (act) => {
    const { done } = arena.drones.getContext("2d");
    act();
    arena.paint();
    return arena.drones.getContext("2d").done !== done;
  };
  arena.isLive = false;
  assert.deepEqual([
    paints(() => arena.take(frame(3, [0, 1]))), paints(() => {}), paints(() => arena.look(1)), paints(() => arena.take(frame(4, [0, 0]))),
    paints(() => { time.ms += 500; }), paints(() => { time.ms += 500; }), paints(() => {}), paints(() => arena.forget()), paints(() => {}),
  ], [true, false, true, true, true, true, false, true, false]);
});

// --- the ground -------------------------------------------------------------------------------------

test("ground captures from the value on that Python paints it with", () => {
  const ground = new Ground(canvas());
  assert.equal(ground.nears(0, 0.5, 0.5), false, "before the first fields");
  ground.fields = [field([10, 20, captures], [30, 20, captures - 1], [31, 20, 127], [0, 0, 255], [49, 49, 255]), field([10, 40, 255])];
  const cases = [[0, 0.2, 0.4], [0, 0.2199, 0.4199], [0, 0.2201, 0.4], [0, 0.62, 0.4], [1, 0.2, 0.8], [0, 0.2, 0.8], [0, -0.1, -0.1], [0, 1.1, 1]];
  assert.deepEqual(cases.map(([team, x, y]) => ground.nears(team, x, y)), [true, true, false, false, true, false, true, true]);
});

// --- the chart --------------------------------------------------------------------------------------

test("the turn is where the lead was won for good, or the greatest gain of who led all along", () => {
  const turn = (...leads) => turningPoint(leads.map((lead) => [10 + lead / 2, 10 - lead / 2]));
  assert.deepEqual(turn(0, 2, -4, -2, 0, 2, 6), 5);
  assert.deepEqual(turn(0, 2, -2, -6), 2);
  assert.deepEqual(turn(0, 1, 1, 1, 6, 6), 4);
  assert.deepEqual([turn(0, 8, 0), turn(0, 0, 0), turn()], [null, null, null], "a draw has none");
});

test("who won before time was up has all drones at the end, and other games end as they stood", () => {
  const ended = (sizes, outcome, limit = 300) => untilTheEnd({ sizes, outcome, settings: { time_limit: limit } });
  assert.deepEqual(ended([[10, 10], [15, 5]], "red").at(-1), [20, 0]);
  assert.deepEqual(ended([[10, 10]], "blue", null), [[10, 10], [0, 20]]);
  assert.deepEqual([ended([[9, 11]], "draw"), ended([], "red")], [[[9, 11]], []]);
  assert.deepEqual(ended([[10, 10], [15, 5]], "red", 1).at(-1), [15, 5], "by majority");
});

// --- a recorded game --------------------------------------------------------------------------------

async function open(text = fixtures.recorded.default.text, from = 0) {
  globalThis.fetch = async () => new Response(text);
  const line = new Line(), replay = new Replay(line, new Chart(document.createElement("div"))), shown = [];
  line.addEventListener("frame", ({ detail }) => shown.push(detail.tick));
  await replay.open("a.jsonl", from, () => true);
  return { replay, shown };
}

test("a recorded game begins where it is asked for, goes on at its pace to its end, and is held where one chooses", async () => {
  const { replay, shown } = await open(undefined, 60), ticks = (steps) => Array.from({ length: steps }, () => { replay.step(); return shown.at(-1); });
  assert.deepEqual([shown.at(-1), at("scrubber").hidden, at("moment").max], [60, false, 150]);
  assert.deepEqual(ticks(2), [61, 62]);
  at("pace").value = "0.5";
  assert.deepEqual(ticks(4), [62, 63, 63, 64]);
  at("moment").value = "90";
  at("moment").fire("input");
  assert.deepEqual([...ticks(1), at("hold").textContent], [90, "Play"]);
  at("pace").value = "8";
  at("pace").fire("change");
  assert.deepEqual(ticks(9).slice(-3), [146, 150, 150]);
  replay.close();
  assert.equal(at("scrubber").hidden, true);
});

test("captures of a recorded game are places to go to, by keys, too", async () => {
  const { replay, shown } = await open(), goTo = (key) => {
    replay.actOf(key, false, null)();
    return shown.at(-1);
  };
  replay.list([[10, 10], [10, 10], [9, 11], [9, 11], [12, 8]]);
  at("log").all("button")[1].click();
  assert.equal(shown.at(-1), 60);
  assert.deepEqual(["arrowright", "arrowleft", "arrowup", "arrowdown", "arrowdown"].map(goTo), [90, 60, 0, 60, 60]);
});

test("a file that is too long is not read, and one that came too late is not shown", async () => {
  await assert.rejects(open("x".repeat(2 ** 24 + 1)), /too long to be watched here; swarm-pz replay --film/);
  await assert.rejects(open("{}\n"), /a.jsonl cannot be shown: its first line must/);
  globalThis.fetch = async () => new Response(fixtures.recorded.default.text);
  const replay = new Replay(new Line(), new Chart(document.createElement("div")));
  await replay.open("a.jsonl", 0, () => false);
  assert.equal(replay.playback, null);
});
