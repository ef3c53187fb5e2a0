// A game in a page without a server: it sends a server's messages, and Python replays what it records.

import assert from "node:assert/strict";
import { appendFileSync, readFileSync, writeFileSync } from "node:fs";
import { beforeEach, test } from "node:test";
import { deflateRawSync } from "node:zlib";

import { fixtures, FOLDER, reload, settled, time } from "./page.js";
import { Game } from "../../../swarm_pz/play/static/engine/game.js";
import { loadPlayer } from "../../../swarm_pz/play/static/engine/players.js";
import { pack, unpack } from "../../../swarm_pz/play/static/engine/linked.js";
import { Playback } from "../../../swarm_pz/play/static/engine/playback.js";
import { Shelf } from "../../../swarm_pz/play/static/engine/recording.js";
import { queryOf, Table } from "../../../swarm_pz/play/static/engine/worker.js";
import { rowOf } from "../../../swarm_pz/play/static/embed.js";

const DOT = [{ brush: "attract", width: 0.1, points: [[0.2, 0.7]] }];

// A fake folder of the browser, with the methods that are used.
class Folder {
  files = new Map();

  left = Infinity; // bytes

  async getFileHandle(name, { create = false } = {}) {
    if (!this.files.has(name) && !create) throw new Error("there is none");
    const { files } = this;
    const handle = {
      truncate: () => files.set(name, Buffer.alloc(0)), close() {},
      write: (data) => {
        if ((this.left -= data.length) < 0) throw new Error("it is full");
        files.set(name, Buffer.from(data));
      },
    };
    return { getFile: async () => new Blob([files.get(name)]), createSyncAccessHandle: async () => handle };
  }

  async removeEntry(name) { this.files.delete(name); }

  async* keys() { yield* this.files.keys(); }
}

class Visitor {
  constructor(folder = new Folder(), query = {}) {
    this.folder = folder;
    this.table = new Table(fixtures.told, new Shelf(folder), { countdown: 1, ...query });
    this.received = [];
    this.frames = [];
    this.targets = [];
    this.table.say = (message) => this.take(message);
  }

  take(message) {
    if (message.type === "frame") this.frames.push(message);
    else if (message.type === "target") this.targets.push(message);
    else {
      this.received.push(structuredClone(message));
      appendFileSync(`${FOLDER}/told.jsonl`, `${JSON.stringify(message)}\n`);
    }
  }

  async say(type, fields = {}) {
    await this.table.hear(JSON.stringify({ type, ...fields }));
    await settled();
  }

  async greet(token = undefined) { await this.say("hello", { kind: "person", client: { viewport: [1, 1] }, token }); }

  last(type) { return this.received.findLast((message) => message.type === type); }

  all(type) { return this.received.filter((message) => message.type === type); }

  // Open a room and let its game begin.
  async begin(patch = {}, settings = {}) {
    await this.greet();
    await this.say("create", { opponent: "lasso", seed: 7, settings: { red: 4, blue: 4, time_limit: 4, ...settings }, ...patch });
    await this.say("ready");
    await this.pass(1000);
  }

  // Let time pass, and wait for the work that it starts.
  async pass(ms) {
    for (let left = ms; left > 0; left -= 200) {
      time.pass(Math.min(left, 200));
      await settled();
      await this.table.shelf.saving?.catch(() => {});
    }
  }

  draw(number, drawing = { strokes: DOT }) { return this.say("command", { number, ...drawing }); }

  // Keep a recorded game for Python, and return its lines.
  async keep(name) {
    const text = await this.table.answer(`recordings/${name}`);
    writeFileSync(`${FOLDER}/${name}`, text);
    return text.trim().split("\n").map((line) => JSON.parse(line));
  }
}

beforeEach(reload);

test("a game counts down, takes what is drawn, ends and is recorded; of what comes too soon the latest counts", async () => {
  const visitor = new Visitor();
  await visitor.greet();
  await visitor.say("create", { opponent: "lasso", seed: 7, settings: { red: 4, blue: 4, time_limit: 4 } });
  await visitor.draw(1);
  assert.deepEqual([visitor.last("refused").about, visitor.last("refused").code], ["command", "out_of_turn"]);
  await visitor.say("ready");
  assert.deepEqual([visitor.last("room").phase, visitor.frames.at(-1).tick, visitor.targets.at(-1).number], ["starting", 0, 0]);
  assert.ok(visitor.frames.at(-1).fields, "its start is shown");
  await visitor.draw(1);
  await visitor.pass(1300);
  for (const number of [2, 3, 4]) await visitor.draw(number);
  await visitor.pass(300);
  await visitor.draw(5, { strokes: [] });
  await visitor.pass(3500);
  const { phase, outcome, ended_by: by, recording, sizes } = visitor.last("room");
  assert.deepEqual([phase, outcome, by, sizes.length], ["over", "draw", "time", 5]);
  const forced = visitor.all("in_force"), [first, second, third] = forced.map(({ tick }) => tick);
  assert.deepEqual([forced.map(({ number }) => number), first, second - first >= 15, third - second], [[1, 4, 5], 0, true, 15]);
  assert.deepEqual([visitor.frames.at(-1).tick, visitor.frames.filter(({ fields }) => fields).length >= 41], [120, true]);
  const { velocities } = visitor.table.room.game;
  assert.ok(visitor.frames.at(-1).velocities.every((velocity, i) => Math.abs(velocity - velocities[i]) < 1e-4));
  const lines = await visitor.keep(recording), row = rowOf(recording, await visitor.table.answer(`recordings/${recording}`), "red");
  assert.deepEqual([row.side, row.outcome, row.commands, row.seed, row.seconds], ["red", "draw", 5, 7, 4]);
  assert.equal(row.captured + row.lost, lines.filter(({ type }) => type === "captured").length);
  assert.deepEqual(JSON.parse(await visitor.table.answer("recordings")).map(({ name, seconds }) => [name, seconds]), [[recording, 4]]);
});

test("a session goes as at the server", async () => {
  const visitor = new Visitor(undefined, { countdown: 0.5 }), steps = JSON.parse(readFileSync(new URL("../session.json", import.meta.url), "utf8"));
  const heard = ({ type, code, number, phase, outcome, ended_by: by }) => ({
    refused: { refused: code }, received: { received: number }, room: { phase, ...(phase === "over" ? { outcome, ended_by: by } : {}) },
  })[type];
  await visitor.greet();
  for (const { say, pause_ms: pause = 0, hear } of steps) {
    if (say) await visitor.say(say.type, say);
    await visitor.pass(pause);
    if (hear) assert.deepEqual(visitor.received.map(heard).findLast(Boolean), hear, JSON.stringify(say));
  }
});

test("a seat and its game end with its page", async () => {
  const visitor = new Visitor();
  await visitor.begin();
  await visitor.pass(1000);
  time.timers.clear();
  const again = new Visitor(visitor.folder);
  await again.greet(visitor.last("seated").token);
  assert.deepEqual([again.last("refused").about, again.last("refused").code], ["hello", "unknown"]);
  assert.deepEqual(JSON.parse(await again.table.answer("recordings")), []);
});

test("a recorded game is shown at any moment, with what was asked for", async () => {
  const visitor = new Visitor();
  await visitor.begin({}, { red: 6, blue: 3, majority: true });
  await visitor.draw(1);
  await visitor.pass(4500);
  const { recording, outcome, ended_by: by } = visitor.last("room"), frames = new Map(visitor.frames.map((frame) => [frame.tick, frame]));
  assert.deepEqual([outcome, by], ["red", "time"], "by majority");
  const playback = new Playback(recording, await visitor.table.answer(`recordings/${recording}`));
  assert.deepEqual([playback.room.last_tick, playback.room.sizes.length, playback.room.outcome], [120, 5, "red"]);
  for (const tick of [100, 31, 32, 119]) {
    playback.goTo(tick);
    const { moment } = playback, { positions, teams, fields } = frames.get(tick);
    assert.deepEqual([moment.tick, moment.teams], [tick, teams]);
    assert.ok(moment.positions.every((place, i) => Math.abs(place - positions[i]) < 1e-5));
    if (fields) assert.deepEqual(moment.fields, fields);
  }
  assert.deepEqual(playback.target(0).picture, visitor.targets.at(-1).picture);
});

test("a game in a link is played again as it was, and what cannot be is no link", async () => {
  const visitor = new Visitor(), line = Array.from({ length: 40 }, (_, k) => [0.1 + k / 97, Math.round(1e4 * (0.5 + 0.3 * Math.sin(k / 7))) / 1e4]);
  await visitor.begin({ opponent: "lasso", seed: 7 }, { time_limit: 5 });
  for (const [number, tool] of [[1, { brush: "attract", width: 0.1 }], [2, { brush: "repel", width: 0.23 }]]) {
    await visitor.draw(number, { strokes: [{ ...tool, points: line.map((point) => point.map((value) => Math.round(1e4 * value) / 1e4)) }] });
    await visitor.pass(1000);
  }
  await visitor.pass(5000);
  const text = await visitor.table.answer(`recordings/${visitor.last("room").recording}`), packed = await pack(text);
  assert.match(packed, /^[\w-]{100,1500}$/);
  let again = null;
  unpack(packed, fixtures.told).then((played) => { again = played; });
  while (!again) { // wait for the compressor, and then for the countdown
    await settled();
    time.pass(1);
  }
  const of = (written) => written.trim().split("\n").map((one) => JSON.parse(one)).filter(({ type }) => ["captured", "frame", "end"].includes(type));
  const plainly = (written) => of(written).map(({ server_ms: _, ...rest }) => rest);
  assert.deepEqual([plainly(again.text), again.isSame], [plainly(text), true]);
  new Playback("a link", again.text);
  assert.equal(await pack(text.replace(", in a page", "")), null, "a server's games are played differently here");
});

test("a link that would keep the page busy for long, or is no game, is refused", async () => {
  const settings = { red: 4, blue: 4, time_limit: 4, speed: 1 }, link = (...plain) => deflateRawSync(JSON.stringify(plain)).toString("base64url");
  const whole = ["red", "lasso", 7, settings, 0.5], strokes = Array.from({ length: 90_000 }, () => [0, 10, 5000, 5000]);
  for (const [packed, why] of [
    [link(...whole, [[0, strokes]], 120, [4, 4]), /too long/], [link(...whole, [], 1e9, [4, 4]), /too long/],
    [link("red", "lasso", 7, { ...settings, red: 100 }, 0.5, [], 120, [4, 4]), /too long/],
    [link("red", "<b>", 7, settings, 0.5, [], 120, [4, 4]), /no policy/], [link("red", "lasso", -1, settings, 0.5, [], 120, [4, 4]), /seed/],
    [link("red", "lasso", 7, { ...settings, speed: "1" }, 0.5, [], 120, [4, 4]), /speed/], [link({}), /./], ["AAAA", /./], ["%", /./], ["A".repeat(8001), /link is too long/],
  ]) await assert.rejects(unpack(packed, fixtures.told), why);
});

test("a game that is left while it is paused leaves nothing that runs", async () => {
  const visitor = new Visitor();
  await visitor.begin();
  await visitor.say("pause", { paused: true });
  await visitor.pass(1000);
  await visitor.say("leave");
  await visitor.pass(1000);
  assert.equal(time.timers.size, 0);
});

test("a seat is shown less, later and more seldom, and commands later, as an experiment asks", async () => {
  const factors = { red: { hide: ["opponents", "ground", "target"], frame_rate: 10, display_delay_ms: 300, command_delay_ms: 500 } };
  const visitor = new Visitor(undefined, { factors });
  await visitor.begin({}, { time_limit: 2 });
  await visitor.draw(1);
  await visitor.pass(1000);
  const late = visitor.table.room.game.tick - visitor.frames.at(-1).tick;
  assert.ok(late >= 9 && late <= 12, late);
  await visitor.pass(2000);
  const shown = visitor.frames.filter(({ tick }) => tick > 0);
  assert.deepEqual(shown.map(({ tick }) => tick), Array.from({ length: 20 }, (_, i) => 3 * i + 3));
  assert.ok(visitor.frames.every(({ positions, teams, fields }) => !fields && teams.every((team, i) => team === 0 || Number.isNaN(positions[2 * i]))));
  assert.deepEqual([visitor.targets, visitor.last("in_force").tick >= 15], [[], true]);
  assert.deepEqual(visitor.last("seated").factors.hide, factors.red.hide);
  const { recording } = visitor.last("room");
  await visitor.keep(recording);
  const row = rowOf(recording, await visitor.table.answer(`recordings/${recording}`), "red");
  assert.deepEqual([row.hide, row.frame_rate, row.command_delay_ms, row.share], ["opponents+ground+target", 10, 500, 0], "an experiment's row has them");
  const wrong = new Visitor(undefined, { factors: { red: { delay: 1 } } });
  await wrong.begin();
  assert.match(wrong.all("refused")[0].reason, /there is no delay; known are command_delay_ms/);
});

test("an opponent commands once a second, by what its own side sees", async () => {
  const visitor = new Visitor();
  await visitor.begin();
  await visitor.pass(4500);
  const commands = (await visitor.keep(visitor.last("room").recording)).filter(({ type, seat }) => type === "command" && seat === "blue");
  assert.deepEqual(commands.map(({ tick }) => tick), [0, 30, 60, 90]);
  const density = (await loadPlayer("lasso")).act(new Game({ red: 4, blue: 4 }, 7), 1);
  assert.ok(commands[0].density.flat().every((value, i) => Math.abs(value - density[i]) < 1e-6));
});

test("a learned player has the weights of its own name, beside the engine", async (context) => {
  const paths = [], weights = readFileSync(new URL("../../../policies/zoo/hunter/policy.safetensors", import.meta.url));
  const fetch = context.mock.method(globalThis, "fetch", async (address) => {
    paths.push(address.pathname.split("/").slice(-2).join("/"));
    return new Response(weights);
  });
  await loadPlayer("champion");
  assert.deepEqual(paths, ["engine/champion.safetensors"]);
  fetch.mock.mockImplementation(async () => new Response("", { status: 404 }));
  await assert.rejects(loadPlayer("veteran"), /the weights of veteran must lie beside the engine, got status 404/);
});

test("where the browser keeps no more, one is told, and games go on; with room again, games are recorded", async () => {
  const visitor = new Visitor();
  visitor.folder.left = 8000;
  await visitor.begin();
  await visitor.pass(4500);
  assert.deepEqual([visitor.last("room").phase, visitor.last("room").outcome, visitor.all("notice").length], ["over", "draw", 1]);
  visitor.folder.left = Infinity;
  await visitor.begin();
  await visitor.pass(4500);
  await visitor.keep(visitor.last("room").recording);
  const games = JSON.parse(await visitor.table.answer("recordings"));
  assert.deepEqual(new Map(games.map(({ name, outcome }) => [name, outcome])), new Map([[visitor.last("room").recording, "draw"]]));
});

test("the latest 200 games are kept, and listed in that order", async () => {
  const shelf = new Shelf(), nameOf = (number) => `${1000 + number}.jsonl`;
  for (let number = 0; number < 202; number++) await shelf.save(nameOf(number), [{}, {}]);
  assert.deepEqual((await shelf.list()).map(({ name }) => name), Array.from({ length: 200 }, (_, i) => nameOf(201 - i)));
  assert.equal(await shelf.read(nameOf(1)), null);
});

test("an address may have got more on its way, and what makes no sense in it is refused when a game begins", async () => {
  assert.deepEqual(queryOf("?fbclid=IwAR-0&countdown=0"), { countdown: 0 });
  for (const [search, named] of [["?countdown=-1", /countdown cannot be -1/], ["?countdown=soon", /cannot be "soon"/], ["?factors=null", /factors cannot be null/]]) {
    const visitor = new Visitor(undefined, queryOf(search));
    await visitor.greet();
    await visitor.say("create", { opponent: "ring" });
    assert.match(visitor.last("refused").reason, named);
  }
});

test("alone, one practises until time is up, at the pace that one chose, and one's name is not recorded", async () => {
  const visitor = new Visitor();
  await visitor.begin({ opponent: null, label: "Ann" }, { red: 3, blue: 0, time_limit: 2, speed: 0.5 });
  await visitor.pass(2500);
  assert.equal(visitor.last("room").phase, "playing", "at half speed");
  await visitor.pass(2000);
  assert.deepEqual([visitor.last("room").outcome, visitor.frames.at(-1).tick], ["draw", 60]);
  const lines = await visitor.keep(visitor.last("room").recording);
  assert.ok(!JSON.stringify(lines).includes("Ann"), "names are not recorded");
});

test("what needs a server or a second person is refused, and changes nothing", async () => {
  const visitor = new Visitor();
  await visitor.begin();
  const { code } = visitor.last("room");
  for (const [type, fields] of [
    ["create", { opponent: "nobody" }], ["create", { seat: "watch", opponent: "ring" }], ["create", { opponent: null }], ["create", { opponent: "ring", seed: 0.5 }],
    ...[{ red_system: "direct" }, { red: 0 }, { time_limit: 7.25 }, { speed: 3 }, { size: 3 }].map((settings) => ["create", { opponent: "ring", settings }]),
    ["join", { room: "ABCD" }], ["join", { room: "ABCD", seat: "blue" }], ["command", { number: 1, density: [] }],
  ]) {
    await visitor.say(type, fields);
    assert.equal(visitor.last("refused").about, type);
  }
  await visitor.pass(200);
  assert.deepEqual([visitor.last("room").code, visitor.last("room").phase, visitor.last("welcome").guests], [code, "playing", false]);
});

test("a game ends for a visitor who leaves or greets anew, and they hear nothing more of it", async () => {
  for (const type of ["leave", "hello"]) {
    const visitor = new Visitor();
    await visitor.begin();
    assert.equal(await visitor.table.answer("recordings"), "[]", "it is no recorded game yet");
    const { room } = visitor.last("seated"), count = visitor.all("room").length;
    await visitor.say(type, { kind: "person", client: { viewport: [1, 1] } });
    const [{ name, ended_by: by }] = JSON.parse(await visitor.table.answer("recordings"));
    assert.deepEqual([by, name.includes(room), visitor.all("room").length], ["left", true, count]);
    await visitor.keep(name);
  }
});
