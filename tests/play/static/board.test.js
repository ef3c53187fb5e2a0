// The board: what is painted of a game, and how it is told; the chart of sizes; a recorded game.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, bytes, fixtures, Line, reload, time } from "./page.js";
import { Arena } from "../../../swarm_pz/play/static/arena.js";
import { Chart, turningPoint, untilTheEnd } from "../../../swarm_pz/play/static/chart.js";
import { decode } from "../../../swarm_pz/play/static/frames.js";
import { Ground, look } from "../../../swarm_pz/play/static/ground.js";
import { News } from "../../../swarm_pz/play/static/news.js";
import { Replay } from "../../../swarm_pz/play/static/replay.js";
import { Sound } from "../../../swarm_pz/play/static/sound.js";

const { cells, captures } = fixtures;
const canvas = (width = 500, height = 500) => Object.assign(document.createElement("canvas"), { width, height });
const field = (...marked) => {
  const values = new Uint8Array(cells * cells);
  for (const [column, row, value] of marked) values[cells * row + column] = value;
  return values;
};
// Two drones: one at (0.25, 0.11), the other at (0.75, 0.91).
const frame = (tick, teams, has = {}) => ({
  tick, serverMs: time.ms, teams: Uint8Array.from(teams), fields: null,
  positions: Float32Array.from([0.25, 0.11, 0.75, 0.91]), velocities: new Float32Array(4), ...has,
});
const near = (given, wanted, within = 1e-6) => assert.ok(Math.abs(given - wanted) <= within, `${given} is not ${wanted}`);
let arena;

beforeEach(() => {
  reload();
  arena = new Arena(canvas(), canvas(), () => time.ms);
  arena.isLive = arena.isCalm = true;
});

// What was painted on a canvas in a colour: the parts of its paths.
const painted = (of, did, colour) => of.getContext("2d").done.filter((one) => one.did === did && one.style === colour).flatMap(({ path }) => path);

// --- the arena --------------------------------------------------------------------------------------

test("drones that change sides are told, and flash in their new colour for a while", () => {
  assert.deepEqual([[0, 1], [0, 0], [0, 1]].map((teams, i) => arena.take(frame(3 * i, teams))), [[], [1], [1]]);
  assert.deepEqual(arena.flashes.map(({ drone, team }) => [drone, team]), [[1, 0], [1, 1]]);
  time.pass(700);
  arena.take(frame(9, [0, 1]));
  arena.paint();
  assert.deepEqual(arena.flashes, []);
});

test("a jump is no capture, and trails begin anew", () => {
  arena.take(frame(0, [0, 1]));
  assert.deepEqual(arena.take(frame(31, [1, 0])), []);
  assert.equal(arena.trails.kept.length, 1);
  assert.deepEqual(arena.take(frame(30, [0, 1])), [], "back in time");
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
  const place = (ageMs, has = {}) => {
    Object.assign(arena, { speed: 1, rate: 30 }, has);
    const told = { serverMs: time.ms - ageMs, positions: Float32Array.from([0.2, 0.5]), velocities: Float32Array.from([2, 0]) };
    arena.take(frame(3, [0], told));
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

test("another game begins with nothing of the last one", () => {
  arena.take(frame(3, [0, 1], { fields: [field(), field()], altitudes: Uint8Array.of(1, 2) }));
  arena.ground.setTarget(decode(bytes(fixtures.targets[1].bytes)));
  arena.forget();
  assert.deepEqual([arena.frame, arena.altitudes, arena.ground.fields, arena.ground.target, arena.paint()], Array(5).fill(null));
});

test("altitudes come once and stay, and the higher a drone the farther its shadow", () => {
  const away = (altitudes) => {
    arena.take(frame(3, [0, 1], { altitudes }));
    arena.paint();
    const shadow = arena.drones.getContext("2d").done.filter(({ did, style }) => did === "image" && style === arena.shadow)[0]?.path[0];
    return shadow ? shadow[1] + shadow[3] / 2 - 125 : null;
  };
  const [low, high, kept] = [Uint8Array.of(13, 255), Uint8Array.of(255, 13), null].map(away);
  assert.ok(low > 0 && high > low + 4);
  assert.equal(kept, high);
  arena.forget();
  assert.equal(away(null), null);
});

test("drones in danger are ringed: those that are guarded, on ground that nearly captures them or about to be", () => {
  const endangered = (guarded, cell, velocities = [0, 0, 0, 0]) => {
    arena.forget();
    arena.guarded = guarded;
    arena.take(frame(3, [0, 1], { fields: [field(), field(cell)], velocities: Float32Array.from(velocities) }));
    arena.paint();
    return painted(arena.drones, "stroke", look.ink).filter(([part]) => part === "arc").length;
  };
  const under = [12, 5, captures], ahead = [22, 5, 128];
  const ringed = [
    endangered([0], under), endangered([0, 1], under), endangered([1], under), endangered([0], [12, 5, 127]),
    endangered([0], ahead), endangered([0], ahead, [0.5, 0, 0, 0]),
  ];
  assert.deepEqual(ringed, [1, 1, 0, 0, 0, 1]);
});

test("a crowd is warned of where the other team nearly captures, and nowhere else", () => {
  const crowd = [0.5, 0.5, 0.55, 0.5, 0.5, 0.42, 0.1, 0.1, 0.9, 0.9], teams = [0, 0, 0, 0, 1];
  const warned = (cell, team = 0, positions = crowd) => {
    arena.take(frame(3, teams, { positions: Float32Array.from(positions), velocities: new Float32Array(10), fields: [field(cell), field(cell)] }));
    return arena.isClosedIn(team);
  };
  const under = [25, 25, 128];
  assert.deepEqual([warned(under), warned([25, 25, 127]), warned([5, 5, 255]), warned(under, 1), warned(under, 0, crowd.map((x, i) => (i === 2 ? 0.7 : x)))],
    [true, false, false, false, false]);
});

test("hidden drones are painted nowhere", () => {
  const hidden = decode(bytes(fixtures.frames[1].bytes)); // the second drone, the only red one, is hidden
  arena.isLive = false;
  arena.take(hidden);
  arena.paint();
  for (const { path } of arena.drones.getContext("2d").done) {
    for (const [, x, y] of path) assert.ok(Number.isNaN(x) === Number.isNaN(y));
  }
  assert.ok(painted(arena.drones, "fill", look.teams[0]).every(([, x]) => Number.isNaN(x)), "a canvas leaves these out");
  assert.equal(painted(arena.drones, "fill", look.teams[1]).filter(([, x]) => Number.isFinite(x)).length, 8);
});

test("who sees the other side sees its target no more", () => {
  arena.ground.setTarget(decode(bytes(fixtures.targets[1].bytes)));
  arena.look(0);
  assert.notEqual(arena.ground.target, null);
  arena.look(1);
  assert.deepEqual([arena.ground.target, arena.own, arena.guarded], [null, 1, [1]]);
});

test("trails lead without a gap from where drones were to where they are shown, and go after five seconds", () => {
  const xs = () => arena.drones.getContext("2d").done.filter(({ did, width }) => did === "stroke" && width < 2).flatMap(({ path }) => path.map(([, x]) => x));
  const moved = (tick, x) => arena.take(frame(tick, [0], {
    positions: Float32Array.from([x, 0.5]), velocities: Float32Array.from([2, 0]), serverMs: time.ms - 50,
  }));
  moved(0, 0.1);
  moved(3, 0.15); // too soon for another piece of the trail
  moved(6, 0.2);
  arena.paint();
  const [begins, ends] = xs().slice(-2);
  near(begins, 100, 1e-3);
  near(ends, 500 * arena.places[0], 1e-3);
  const alphas = arena.drones.getContext("2d").done.filter(({ did, width }) => did === "stroke" && width < 2).map(({ alpha }) => alpha);
  assert.ok(Math.max(...alphas) < 0.4, "fainter than drones");
  assert.deepEqual(arena.trails.kept.map(({ tick }) => tick), [0, 6]);
  for (let tick = 12; tick <= 180; tick += 6) moved(tick, 0.2);
  assert.equal(Math.min(...arena.trails.kept.map(({ tick }) => tick)), 30);
});

// --- the ground -------------------------------------------------------------------------------------

test("ground captures from the value on that Python paints it with", () => {
  const ground = new Ground(canvas());
  assert.equal(ground.nears(0, 0.5, 0.5), false, "before the first fields");
  ground.fields = [field([10, 20, captures], [30, 20, captures - 1], [31, 20, 127], [0, 0, 255], [49, 49, 255]), field([10, 40, 255])];
  const asked = [[0, 0.2, 0.4], [0, 0.2199, 0.4199], [0, 0.2201, 0.4], [0, 0.62, 0.4], [1, 0.2, 0.8], [0, 0.2, 0.8], [0, -0.1, -0.1], [0, 1.1, 1]];
  assert.deepEqual(asked.map(([team, x, y]) => ground.nears(team, x, y)), [true, true, false, false, true, false, true, true]);
});

// --- the chart --------------------------------------------------------------------------------------

test("the chart fills in seconds that were missed, keeps its own, and paints red from below", () => {
  const chart = new Chart(canvas(300, 400)), given = [[10, 10], [15, 5]];
  chart.set(given);
  chart.add(30, 15, 5);
  chart.add(5 * 30 + 29, 5, 15);
  given[0][0] = 99;
  assert.deepEqual(chart.sizes, [[10, 10], [15, 5], [15, 5], [15, 5], [15, 5], [5, 15]]);
  assert.equal(chart.canvas.getAttribute("aria-label"), "Team sizes over time: now red 5, blue 15");
  const fills = chart.canvas.getContext("2d").done.filter(({ did, path }) => did === "fill" && path.length === 6).slice(-2);
  assert.deepEqual(fills.map(({ path }) => path[1].slice(2, 5).map(Math.round)), [[100, 11, 300], [0, 11, 100]]);
});

test("the moment of a recorded game is told in the chart", () => {
  const chart = new Chart(canvas(300, 400));
  chart.set([[10, 10], [15, 5], [5, 15]]);
  const strokes = () => painted(chart.canvas, "stroke", look.ink).length, before = strokes();
  chart.set(chart.sizes, 1);
  assert.ok(strokes() > 2 * before, "the turn is marked");
  chart.show(1.5);
  assert.equal(chart.canvas.getAttribute("aria-label"), "Team sizes over time: now red 15, blue 5");
  chart.show(null);
  assert.equal(chart.canvas.getAttribute("aria-label"), "Team sizes over time: now red 5, blue 15");
});

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

// --- the news ---------------------------------------------------------------------------------------

const lines = () => at("log").children.map(({ className, textContent }) => [className, textContent]);
const happened = (tick, ...teams) => ({ tick, teams: Uint8Array.from(teams) });

test("captures of a second are one piece of news, and all are told together with the sizes, not too often", () => {
  const played = [], news = new News({ play: (kind) => played.push(kind) });
  news.forget(0);
  news.captures([1], happened(60, 0, 0, 1)); // not of the start
  news.captures([], happened(63, 0, 0, 1));
  news.captures([2], happened(66, 0, 0, 0));
  news.captures([0], happened(120, 1, 0, 0));
  assert.deepEqual(lines(), [["blue", "0:04 Blue took 1 of yours"], ["red", "0:02 You took 2 drones"]]);
  assert.deepEqual(played, ["took", "took", "lost"]);
  assert.deepEqual([at("toast").textContent, at("toast").className, at("told").textContent], ["Blue took 1 of yours", "blue", ""]);
  time.pass(4000);
  assert.equal(at("told").textContent, "You took 2 drones, Blue took 1 of yours. Red 2, blue 1.");
  assert.equal(at("toast").hidden, true);
});

test("what one did oneself is answered for two seconds, whatever is captured meanwhile", () => {
  const news = new News({ play() {} }), said = () => [at("toast").textContent, at("told").textContent];
  news.forget(0);
  news.captures([0], happened(30, 1, 0));
  time.pass(3500);
  news.answer("Undone");
  news.captures([0], happened(45, 1, 0));
  assert.deepEqual(said(), ["Undone", "Undone"]);
  time.pass(1999);
  assert.deepEqual(said(), ["Undone", "Undone"]);
  time.pass(1);
  assert.equal(said()[1], "Blue took 2 of yours. Red 1, blue 1.");
  news.captures([1], happened(90, 1, 0));
  assert.equal(said()[0], "You took 1 drone");
});

test("who watches is told of both sides by their names, and nothing of a game that is over", () => {
  const news = new News({ play() {} });
  news.captures([0, 1], happened(30, 0, 0, 1));
  assert.deepEqual(lines(), [["red", "0:01 Red took 2 drones"]]);
  news.hush();
  time.pass(10_000);
  assert.equal(at("told").textContent, "");
  news.forget();
  assert.deepEqual(lines(), []);
});

// --- sound ------------------------------------------------------------------------------------------

test("sound is off by one switch that the browser remembers, and heard when it is turned on", () => {
  let notes = 0;
  const part = () => ({ connect() {}, frequency: {}, gain: { setValueAtTime() {}, exponentialRampToValueAtTime() {} }, start: () => { notes++; }, stop() {} });
  globalThis.AudioContext = class {
    createGain() { return part(); }

    createOscillator() { return part(); }
  };
  const pressed = () => at("sound").getAttribute("aria-pressed");
  const sound = new Sound(at("sound"));
  time.pass(1000);
  sound.play("won");
  sound.play("lost"); // at once: not heard
  assert.equal(notes, 4);
  at("sound").click();
  time.pass(1000);
  sound.play("took");
  reload();
  const again = new Sound(at("sound"));
  assert.deepEqual([pressed(), notes, again.isOn], ["false", 4, false]);
  at("sound").click();
  assert.deepEqual([pressed(), notes, new Sound(at("sound")).isOn], ["true", 6, true]);
});

// --- a recorded game --------------------------------------------------------------------------------

const RECORDED = { phase: "replay", last_tick: 9000, verified: true, sizes: [[10, 10]], outcome: "draw", settings: { time_limit: 300 } };

test("a moment is told in words, as it is followed and as it is chosen", () => {
  const line = new Line(), replay = new Replay(line, new Chart(canvas())), told = () => at("moment").getAttribute("aria-valuetext");
  replay.show(RECORDED);
  replay.follow(90);
  assert.equal(told(), "3 seconds of 5 minutes 0 seconds");
  at("moment").value = 4500;
  at("moment").fire("input");
  at("moment").fire("input");
  assert.equal(told(), "2 minutes 30 seconds of 5 minutes 0 seconds");
  replay.follow(93);
  assert.equal(at("moment").value, 4500, "who looks for a moment is not led away");
  assert.equal(line.count("seek"), 0);
  time.pass(100);
  assert.equal(line.count("seek"), 1, "the server is not asked for each moment that one passes");
  at("moment").fire("input");
  at("take-over").click();
  time.pass(100);
  assert.deepEqual(line.said.slice(-2).map(({ type }) => type), ["seek", "take_over"], "from the moment that was chosen");
});

test("captures of a recorded game are places to go to, the turn is one, and its pace is chosen", () => {
  const line = new Line(), chart = new Chart(canvas()), replay = new Replay(line, chart);
  const sizes = [...Array(40).fill([10, 10]), [9, 11], ...Array(20).fill([12, 8])];
  replay.show({ ...RECORDED, last_tick: 1820, sizes, outcome: "red" });
  assert.deepEqual(lines(), [
    ["blue", "0:39 Blue +1: red 9, blue 11"], ["red", "0:40 Red +3: red 12, blue 8, the turn"], ["red", "1:00 Red +8: red 20, blue 0"],
  ]);
  at("log").all("button")[1].click();
  assert.deepEqual(line.last("seek"), { type: "seek", tick: 1170 });
  const pressed = (key, isFine = false) => {
    replay.actOf(key, isFine, null)();
    const current = at("log").children.findIndex((line) => line.getAttribute("aria-current") === "true");
    return [Number(at("moment").value), current];
  };
  assert.deepEqual([["arrowright"], ["arrowleft"], ["arrowdown"], ["arrowup"], ["arrowup"], ["arrowup"], ["arrowdown"], ["arrowup"]].map((key) => pressed(...key)),
    [[1200, 1], [1170, 1], [1770, 2], [1170, 1], [1140, 0], [0, -1], [1140, 0], [0, -1]]);
  assert.deepEqual([pressed("arrowright", true), replay.held, pressed(" "), replay.held], [[3, -1], true, [3, -1], false]);
  replay.follow(1500);
  assert.deepEqual([chart.cursor, chart.marked], [50, 41]);
  at("pace").value = "4";
  at("pace").fire("change");
  for (const held of [true, true, false]) replay.hold(held);
  assert.deepEqual(line.said.filter(({ type }) => type === "pace").map(({ speed }) => speed), [0, 1, 4, 0, 4]);
  at("take-side").value = "blue";
  at("take-over").click();
  assert.deepEqual(line.last("take_over"), { type: "take_over", seat: "blue" });
});

test("a recorded game that plays differently here cannot be taken over", () => {
  const replay = new Replay(new Line(), new Chart(canvas()));
  replay.show({ ...RECORDED, verified: false });
  assert.equal(at("take-over").disabled, true);
});
