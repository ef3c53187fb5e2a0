// Navigation: what an address opens, how a game is shared, and which rooms the form and an experiment create.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, fixtures, Line, reload, settled, Socket, time } from "./page.js";
import { SERVER } from "../../../swarm_pz/play/static/link.js";
import { daily, dayStreak, winDay } from "../../../swarm_pz/play/static/progress.js";
import "../../../swarm_pz/play/static/engine/linked.js";
import { Embed } from "../../../swarm_pz/play/static/embed.js";
import "../../../swarm_pz/play/static/lesson.js";
import "../../../swarm_pz/play/static/replay.js";

const SEAT = fixtures.seats.ergodic, SAVED = { room: "ABCD", token: SEAT.token, seat: "red" };
const WELCOME = {
  type: "welcome", server_ms: 0, addresses: [], guests: true, records_labels: false, embedders: ["https://lab"],
  policies: [{ name: "ring", about: "", card: null }, { name: "uniform", about: "", card: null }],
  systems: [{ name: "ergodic", takes: "density" }, { name: "direct", takes: "accelerations" }], default_systems: ["ergodic", "ergodic"],
  opponents: ["uniform"],
};
const FREE = { ...fixtures.room.blue, kind: "free", name: "", policy_state: null, connected: false };
const room = (patch = {}) => ({ ...fixtures.room, ...patch });
let loads = 0;

beforeEach(() => {
  reload();
  Socket.all = [];
  Object.assign(location, { hash: "", pathname: "/", replaced: null });
  document.body.className = "";
  for (const store of [sessionStorage, localStorage]) store.kept.clear();
  globalThis.fetch = async () => ({ ok: true, json: async () => [] });
});

// Load the page, and let the server send `welcome` unless it is null.
async function load(hash = "", { welcome = WELCOME, saved = null, pathname = "/" } = {}) {
  Object.assign(location, { hash, pathname });
  if (saved) for (const store of [sessionStorage, localStorage]) store.setItem("swarm-pz.seat", JSON.stringify(saved));
  await import(`../../../swarm_pz/play/static/main.js?${++loads}`);
  at("table").hidden ??= true;
  await Socket.last.open();
  if (welcome) await hear(welcome);
}

async function hear(...messages) {
  Socket.last.hear(...messages);
  await settled();
}

const sent = (type) => Socket.last.line.last(type);
const refuse = (about, patch = {}) => hear({ type: "refused", code: "unknown", reason: "not so", about, ...patch });
const view = () => ["lobby", "table"].filter((name) => !at(name).hidden).join();
async function click(id) {
  at(id).click();
  await settled();
}

// --- addresses --------------------------------------------------------------------------------------

for (const [hash, type] of [["#room=!!", null], ["#what", null], ["#room=zzzz", "join"], ["#play=exec:A%3D1%20./bot", "create"], ["#replay=none.jsonl", null]]) {
  test(`${hash} leads nowhere, and so to the start`, async () => {
    await load(hash);
    if (type) {
      assert.ok(sent(type));
      await refuse(type);
    }
    assert.deepEqual([view(), location.hash, at("says").textContent !== ""], ["lobby", "", hash !== "#what"]);
  });
}

test("the token of a seat goes to its own room alone", async () => {
  await load("#room=ABCD", { saved: SAVED, welcome: null });
  assert.equal(sent("hello").token, SAVED.token);
  reload();
  await load("#room=WXYZ", { saved: SAVED, welcome: null });
  assert.equal(sent("hello").token, undefined);
});

test("a seat that is wanted before the table has answered is returned to", async () => {
  await load("", { saved: SAVED, welcome: null });
  assert.equal(sent("hello").token, undefined);
  at("return").onclick?.();
  await click("return");
  await hear(WELCOME);
  time.pass(250);
  await Socket.last.open();
  assert.equal(sent("hello").token, SAVED.token);
});

test("who has a seat is shown the way back to it, and who has none is not", async () => {
  await load("", { saved: SAVED });
  assert.deepEqual([at("return").hidden, at("return").textContent], [false, "Return to your seat in room ABCD"]);
  reload();
  for (const store of [sessionStorage, localStorage]) store.kept.clear();
  await load();
  assert.equal(at("return").hidden, true);
});

test("a recorded game is listed with its players and how it ended, and one without an end as not finished", async () => {
  // Catches a game that was broken off, as when the server is killed, and is listed as if it had a result.
  const red = { kind: "person", policy: "", label: "" }, blue = { ...red, kind: "policy", policy: "uniform" }, one = { started: null, red, blue, lesson: false };
  const games = [{ ...one, name: "a.jsonl", outcome: null }, { ...one, name: "b.jsonl", outcome: "draw", ended_by: "time", seconds: 60, sizes: [3, 3] }];
  globalThis.fetch = async () => ({ ok: true, json: async () => games });
  at("recorded").open = true;
  await load();
  const [broken, whole] = at("games").children.map((entry) => entry.textContent);
  assert.match(broken, /^a person \(red\) against uniform \(blue\) not finished/);
  assert.match(whole, /a draw, 3 to 3, after 1:00/);
});

test("a lost connection is told, and a server that knows the room no more leads back to the start", async () => {
  await load("#play=ring");
  await hear({ type: "seated", ...SEAT }, room());
  Socket.last.close();
  assert.match(at("says").textContent, /connection is lost/);
  time.pass(250);
  await Socket.last.open();
  assert.equal(sent("hello").token, SEAT.token);
  await hear(WELCOME);
  await refuse("hello");
  assert.equal(sent("join").room, "ABCD");
  await refuse("join");
  assert.deepEqual([view(), location.hash], ["lobby", ""]);
});

test("a challenge waits until one is ready, and is played again from its start; an opponent alone is met at once", async () => {
  await load("#play=ring@123");
  assert.deepEqual([sent("create").opponent, sent("create").seed], ["ring", 123]);
  const policy = { ...fixtures.room.blue, name: "ring" };
  await hear({ type: "seated", ...SEAT }, room({ phase: "waiting", red: { ...fixtures.room.red, ready: false }, blue: policy }));
  assert.deepEqual([sent("ready"), at("ready").hidden, at("taught").hidden], [undefined, false, false]);
  await click("ready");
  assert.ok(sent("ready"));
  await hear(room({ blue: policy }), room({ phase: "over", outcome: "blue", recording: "a.jsonl", blue: policy }));
  await click("ready");
  assert.deepEqual([Socket.last.line.count("create"), sent("create").seed], [2, 123]);
  reload();
  await load("#play=ring");
  await hear({ type: "seated", ...SEAT });
  assert.deepEqual([sent("create").seed, sent("ready") !== undefined], [undefined, true]);
});

test("the game of the day is one for all, where no server is, and its wins in a row are counted", async () => {
  await load("#daily");
  assert.deepEqual([sent("create"), view()], [undefined, "lobby"], "a server has none");
  reload();
  await load("#daily", { welcome: { ...WELCOME, guests: false } });
  const { seed, opponent } = sent("create"), over = room({ phase: "over", recording: "a.jsonl", blue: { ...fixtures.room.blue, name: opponent } });
  assert.deepEqual({ ...daily(WELCOME.opponents), day: 0 }, { day: 0, seed, opponent });
  await hear({ type: "seated", ...SEAT }, room(), { ...over, outcome: "blue" });
  assert.match(at("streak").textContent, /try again/);
  assert.equal(location.hash, "#daily", "a page that is loaded anew begins it again");
  await hear(room(), { ...over, outcome: "red" });
  assert.match(at("streak").textContent, /You won the game of the day\./);
});

test("days in a row are counted once a day, until one is left out", () => {
  const { day } = daily(["a"]);
  assert.deepEqual([1, 1, 2, 4].map((days) => (winDay(day + days), dayStreak(day + days))), [1, 1, 2, 1]);
  assert.deepEqual([dayStreak(day + 5), dayStreak(day + 6)], [1, 0]);
  const opponents = new Set(Array.from({ length: 60 }, (_, k) => daily(["a", "b", "c"], day + k).opponent));
  assert.equal(opponents.size, 3);
});

test("a finished game is shared by its result, and by links to its start and to its recording", async () => {
  await load();
  const state = room({ phase: "over", outcome: "stopped", recording: "a.jsonl", sizes: [[2, 2]], blue: { ...fixtures.room.blue, name: "ring" } });
  const [header, ...lines] = fixtures.recorded.default.text.trim().split("\n");
  const text = [JSON.stringify({ ...JSON.parse(header), seed: 9 }), ...lines].join("\n");
  const { share } = await import("../../../swarm_pz/play/static/share.js");
  await share({ fetch: async () => new Response(text) }, state, 0, ["uniform"]);
  assert.match(at("sharing-text").value, /^swarm-pz: \d+–\d+ against ring in 0:05, 2 drawings. Play it: http:..table.$/);
  globalThis.fetch = async () => new Response(text);
  await share(SERVER, state, 0, ["ring"]);
  assert.match(at("sharing-text").value, /The same start for you: http:..table.#play=ring@9$/);
  Object.assign(navigator, { clipboard: { writeText: async () => {} } });
  await click("copy-game");
  assert.equal(at("copy-game").textContent, "Copied");
  assert.match(at("sharing-text").value, /Watch it: http:..table.#replay=a.jsonl$/);
});

// --- the start --------------------------------------------------------------------------------------

test("a room is as the form says", async () => {
  await load();
  const fill = (values) => { for (const [id, value] of Object.entries(values)) at(id).value = value; };
  fill({ opponent: "none", side: "blue", "red-drones": "10", "blue-drones": "7", "time-limit": "120", decided: "draw", speed: "0.5", label: "P3", "red-system": "direct", "blue-system": "ergodic" });
  at("create").fire("submit");
  assert.deepEqual(sent("create"), {
    type: "create", seat: "blue", label: "P3", player: null, opponent: null,
    settings: { red: 0, blue: 7, time_limit: 120, majority: false, speed: 0.5, red_system: "direct", blue_system: "ergodic" },
  });
  fill({ opponent: "ring", side: "watch", player: "uniform", "time-limit": "" });
  at("side").fire("change");
  assert.deepEqual([at("red-player").hidden, at("opponent-side").textContent], [false, "Blue"]);
  at("create").fire("submit");
  const { seat, player, opponent, settings } = sent("create");
  assert.deepEqual([seat, player, opponent, settings.time_limit, settings.red], ["watch", "uniform", "ring", null, 10]);
});

// --- studies and experiments ------------------------------------------------------------------------

test("the page in a frame hears its experiment alone, begins once, and tells how the game went", async () => {
  const posts = [], begun = [], link = new Line(), answers = [{ ok: false }, new Response(fixtures.recorded.default.text)];
  globalThis.parent = { postMessage: (message, origin) => posts.push([message, origin]) };
  globalThis.fetch = async () => answers.shift();
  const embed = new Embed(link, "https://lab", (message) => begun.push(message)), { parent } = globalThis;
  const begin = (patch = {}) => embed.hear({ source: parent, origin: "https://lab", data: { type: "swarm-pz.begin", create: { opponent: "ring" } }, ...patch });
  begin();
  embed.greet(["https://other"]);
  begin();
  assert.deepEqual([posts, begun], [[], []], "no experiment that the table was started for");
  embed.greet(["https://lab"]);
  begin({ source: {} });
  begin({ origin: "https://other" });
  begin({ data: { type: "other" } });
  assert.deepEqual(begun, []);
  begin();
  begin();
  assert.deepEqual(begun, [{ label: "", opponent: "ring", type: "create", once: true }]);
  embed.side = "blue";
  const ended = embed.end("a.jsonl");
  await settled();
  time.pass(500);
  await ended;
  embed.refused({ about: "create", reason: "late" });
  const row = { side: "blue", kind: "policy", opponent: "", outcome: "stopped", commands: 2, seconds: 5, seed: 1, recording: "a.jsonl" };
  assert.deepEqual(posts.map(([{ type }, origin]) => [type, origin]), [["swarm-pz.ready", "https://lab"], ["swarm-pz.over", "https://lab"]]);
  assert.deepEqual({ ...posts[1][0].row, ...row }, posts[1][0].row);
  const other = new Embed(link, "https://lab", () => true);
  other.watch({ red: { policy_state: "failed", name: "ring", reason: "no file" }, blue: {}, phase: "waiting" });
  assert.deepEqual(posts.at(-1)[0], { type: "swarm-pz.refused", reason: "ring cannot play: no file" });
});
