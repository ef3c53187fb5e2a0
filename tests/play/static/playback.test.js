// Compare recorded games of a server, as the page shows them, with Python's replay in the simulator.

import assert from "node:assert/strict";
import { test } from "node:test";

import { bytes, fixtures } from "./page.js";
import { Playback } from "../../../swarm_pz/play/static/engine/playback.js";
import { encode } from "../../../swarm_pz/play/static/frames.js";
import { whyOf } from "../../../swarm_pz/play/static/why.js";

const { recorded } = fixtures;
const of = (name, change = (lines) => lines) => {
  const lines = recorded[name].text.trimEnd().split("\n").map((line) => JSON.parse(line));
  return new Playback("a.jsonl", change(lines).map((line) => `${JSON.stringify(line)}\n`).join(""));
};
const near = (values, others, within) => assert.ok(values.every((value, i) => Math.abs(value - others[i]) <= within));

for (const name of Object.keys(recorded)) {
  test(`a game of ${name} is shown at any moment as it was, on the way and after jumps`, () => {
    const playback = of(name);
    for (const { tick, positions, teams, fields, pictures } of [...recorded[name].moments, ...recorded[name].moments.toReversed()]) {
      playback.goTo(tick);
      const { moment } = playback;
      assert.deepEqual([moment.tick, [...moment.teams]], [tick, teams]);
      near(moment.positions, positions, recorded[name].within);
      assert.equal(moment.fields !== null, fields !== null);
      // A rounded position at the edge of a cell may be in another cell.
      fields?.forEach((field, team) => assert.ok(field.filter((value, i) => Math.abs(value - moment.fields[team][i]) > 8).length <= 25));
      pictures?.forEach((picture, team) => near(playback.target(team).picture, picture, 1));
    }
  });
}

test("players, sizes and the result are those of the file, and a file that breaks off is shown as far as it goes", () => {
  const { room } = of("default");
  assert.deepEqual([room.red.label, room.blue.name, room.settings.red, room.outcome, room.last_tick, room.sizes.length], ["P1", "ring", 12, "stopped", 150, 6]);
  assert.deepEqual(room.sizes[0], [12, 12]);
  const whole = recorded.default.text, broken = new Playback("a.jsonl", whole.slice(0, whole.length / 2));
  assert.ok(broken.room.outcome === null && broken.lastTick > 30 && broken.lastTick < 150);
});

test("a shared command is not taken for the player's of the same number", () => {
  const own = recorded.default.text.split("\n").map((line) => line && JSON.parse(line)).find(({ type, seat }) => type === "command" && seat === "red");
  const playback = of("default", ([header, ...lines]) => [header, { ...own, density: Array(10).fill(Array(10).fill(1)), sender: "shared:ring", tick: 0 }, ...lines]);
  playback.goTo(30);
  assert.deepEqual(playback.latest(0).density, own.density);
});

const header = (patch) => ([first, ...lines]) => [{ ...first, ...patch }, ...lines];
const game = (patch) => ([first, ...lines]) => [{ ...first, table: { ...first.table, game: { ...first.table.game, ...patch } } }, ...lines];
for (const [fault, change, reason] of [
  ["of another protocol", header({ protocol: "v9" }), /protocol swarm-pz/], ["nothing to be seen", (lines) => lines.slice(0, 1), /broke off/],
]) {
  test(`a file with ${fault} is refused in words`, () => { assert.throws(() => of("default", change), reason); });
}

const CIRCLE = [[-1, -1], [1, -1], [1, 1], [-1, 1]];

// Blue's first drone repeats `way`, four offsets from (0.51, 0.51). At tick `caught` red's first drone jumps there and is
// captured. If `isShared`, red's second drone flies that path, too; else it stays away.
function turned(caught, outcome, way = CIRCLE, isShared = false) {
  const last = 240, around = (tick) => [0, 1].map((axis) => 0.51 + 0.04 * way[tick % 4][axis]);
  const frames = Array.from({ length: last + 1 }, (_, tick) => encode({
    tick, teams: Uint8Array.from([tick >= caught ? 1 : 0, 0, 0, 1, 1, 1]), velocities: new Float32Array(12),
    positions: Float32Array.from([...(tick >= caught ? [0.51, 0.51] : [0.1, 0.1]), ...(isShared ? around(tick) : [0.1, 0.1]), 0.1, 0.2, ...around(tick), 0.91, 0.91, 0.91, 0.71]),
  }));
  return of("default", ([first]) => [
    ...game({ drones_per_team: 3 })([first]), ...frames.map((data) => ({ type: "frame", data })),
    { type: "captured", tick: caught, drone: 0, seat: "blue" }, { type: "end", outcome, ended_by: "time" },
  ]);
}

test("the loss that turned a game is told with its place, who made the ground, and for how long; a draw has none", () => {
  const { tick, place, text } = whyOf(turned(200, "blue"));
  assert.deepEqual([tick, text], [200, "Red lost a drone on ground that 1 of blue’s 3 drones had made, circling close around it. It had been blue’s for 5.0 s."]);
  near(place, [0.51, 0.51], 1e-6);
  assert.equal(whyOf(turned(200, "draw")), null);
  for (const [way, isShared, tail] of [
    [[[-1, -1], [-1, 1], [-1, -1], [-1, 1]], false, ". It had been blue’s for 5.0 s."], // flying on one side of the place is not circling it
    [[...CIRCLE.slice(1), [-9, -9]], false, ", circling close around it."], // held on and off: neither for long, nor only just then
    [CIRCLE, true, ", circling close around it. Red held it, too."],
  ]) assert.equal(whyOf(turned(200, "blue", way, isShared)).text, `Red lost a drone on ground that 1 of blue’s 3 drones had made${tail}`);
});
