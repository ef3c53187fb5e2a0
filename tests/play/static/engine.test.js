// Compare the page's engine with games of the simulator, which tests/play/engine_cases.py writes.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";

import { cellOf, placeOf, TRAIL } from "../../../swarm_pz/play/static/engine/ground.js";
import { Game } from "../../../swarm_pz/play/static/engine/game.js";
import { fieldsOf, observe } from "../../../swarm_pz/play/static/engine/observation.js";
import { loadPlayer, PLAYERS } from "../../../swarm_pz/play/static/engine/players.js";
import { densityOf, targetOf } from "../../../swarm_pz/play/static/engine/strokes.js";
import { CELLS as GRID } from "../../../swarm_pz/play/static/frames.js";

const FOLDER = process.env.SWARM_PZ_FIXTURES, ZOO = new URL("../../../policies/zoo/", import.meta.url);
const bytes = (file) => Uint8Array.from(readFileSync(file)).buffer;
const weightsOf = async (name) => bytes(new URL(`${name}/policy.safetensors`, ZOO));
const cases = JSON.parse(readFileSync(`${FOLDER}/cases.json`, "utf8"));
const TYPES = { F32: Float32Array, F64: Float64Array, U8: Uint8Array, I32: Int32Array };
const SQUARE = GRID * GRID;
const BOUNDS = { acceleration: 1e-4, position: 2.5e-7, velocity: 5e-6, memory: 1e-5, answer: 1e-5, density: 1e-6, picture: 1 };

// Return the arrays of a safetensors file by name, each as a function from the first index to the values there.
function read(buffer) {
  const size = 8 + new DataView(buffer).getUint32(0, true), header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, size - 8)));
  return Object.fromEntries(Object.entries(header).map(([name, { dtype, shape, data_offsets: [from, to] }]) => {
    const values = new TYPES[dtype](buffer.slice(size + from, size + to)), each = values.length / shape[0];
    return [name, (i) => values.subarray(i * each, (i + 1) * each)];
  }));
}

const parts = (values, size) => Array.from({ length: values.length / size }, (_, i) => values.subarray(i * size, (i + 1) * size));
const inside = (field) => Int32Array.from({ length: SQUARE }, (_, cell) => field[placeOf(cell)]);
const farthest = (got, wanted) => got.reduce((most, value, i) => Math.max(most, Math.abs(value - wanted[i])), 0);
const same = (got, wanted) => got.length === wanted.length && got.every((value, i) => value === wanted[i]);

// Keeps the largest of each deviation; `faults` lists failed checks and deviations beyond their bounds.
class Tally {
  constructor(fields) { Object.assign(this, fields, { faults: [] }); }

  check(what, isRight) { if (!isRight) this.faults.push(what); }

  take(name, deviation) {
    if (!(deviation <= (this[name] ?? 0))) this[name] = deviation;
    this.check(`${name} is ${deviation} off`, deviation <= BOUNDS[name]);
  }
}

// Play tick by tick, each from the simulator's state. `ties` are drones that the last bit of a position puts into another
// cell: their effects in that tick are not faults. `halves` counts cells of fields for which 255 value / maximum lies
// half-way between two integers and the simulator rounded down, since its processor multiplies by 1 / maximum.
async function compare(buffer, { seen: views, players: names }) {
  const truth = read(buffer), [red, blue, seed, ticks, every] = truth.start(0);
  /** @type {any} */
  const game = new Game({ red, blue, timeLimit: 120 }, seed);
  const { ground, teams, positions, controller: { memory, weights } } = game;
  const tally = new Tally({ seed, red, blue, ticks, captures: 0, images: 0, halves: 0, ties: [] });
  const players = await Promise.all(PLAYERS.map((name) => loadPlayer(name, weightsOf)));
  tally.check("the names of players", same(PLAYERS, names));
  tally.check("the start", same(positions, truth.positions(0)));
  for (let tick = 0; ; tick++) {
    const now = `at tick ${tick}`;
    tally.check(`fields ${now}`, ground.fields.every((field, team) => same(inside(field), parts(truth.fields(tick), SQUARE)[team])));
    if (tick % every === 0) {
      const images = [0, 1].flatMap((team) => views.map(([grid, channels]) => observe(game, team, channels, grid)));
      tally.check(`what is seen ${now}`, same(images.flatMap((image) => [...image]), truth.seen(tick / every)));
      tally.check(`fields of a frame ${now}`, fieldsOf(game).every((field, team) => same(field, parts(images[0], SQUARE)[4 + team])));
      tally.images += images.length;
      tally.halves += truth.halves(tick / every)[0];
    }
    if (tick % 150 === 0) {
      const answers = players.flatMap((player) => [0, 1].map((team) => player.act(game, team, tick / 75 + team)));
      answers.forEach((answer, i) => tally.take("answer", farthest(answer, truth.answers(tick / 150).subarray(100 * i, 100 * i + 100))));
    }
    if (tick === ticks || tally.faults.length) break;
    if (tick % 30 === 0) parts(truth.commands(tick / 30), 100).forEach((density, team) => game.command(team, density));
    if (tick % 3 === 0) {
      for (const [own, wanted] of [[memory, truth.memory(tick / 3)], [weights, truth.weights(tick / 3)]]) {
        tally.take("memory", farthest(own, wanted));
        own.set(wanted);
      }
    }
    tally.captures += game.advance().length;
    const accelerations = truth.accelerations(tick), next = truth.positions(tick + 1), slot = tick % TRAIL * teams.length;
    tally.take("acceleration", farthest(game.accelerations, accelerations) / (farthest(accelerations, accelerations.map(() => 0)) || 1));
    tally.take("position", farthest(positions, next));
    tally.take("velocity", farthest(game.velocities, truth.velocities(tick + 1)));
    const cells = (at) => Array.from(teams, (_, i) => cellOf(at[2 * i], at[2 * i + 1])), wanted = cells(next);
    const ties = cells(positions).flatMap((cell, drone) => (cell === wanted[drone] ? [] : [{ tick, drone, cell }]));
    if (ties.length) correct(game, wanted, slot, truth.teams(tick + 1));
    else tally.check(`captured drones ${now}`, same(teams, truth.teams(tick + 1)));
    tally.ties.push(...ties);
    positions.set(next);
    game.velocities.set(truth.velocities(tick + 1));
    game.accelerations.set(accelerations);
  }
  return tally;
}

// Set the drones' cells and teams to the simulator's, and recompute the fields.
function correct(game, cells, slot, teams) {
  const { ground } = game;
  cells.forEach((cell, i) => { ground.trails[slot + i] = cell; });
  game.teams.set(teams);
  game.sizes = [0, 1].map((team) => teams.filter((one) => one === team).length);
  for (const field of ground.fields) field.fill(0);
  ground.trails.forEach((cell, i) => { if (cell >= 0) ground.add(teams[i % teams.length], cell, 1); });
}

// Compare the densities of drawings and the pictures of targets with Python's.
function compareDrawings({ drawings }) {
  const tally = new Tally({ drawings: drawings.length, cells: 0 });
  for (const { strokes, density, picture } of drawings) {
    tally.take("density", farthest(densityOf(strokes), density));
    const shown = targetOf(densityOf(strokes));
    tally.take("picture", farthest(shown, picture));
    tally.cells += picture.filter((value, i) => value !== shown[i]).length;
  }
  return tally;
}

function holds(t, tally) {
  t.diagnostic(JSON.stringify(tally));
  assert.deepEqual(tally.faults, []);
}

for (const name of readdirSync(FOLDER).filter((one) => one.endsWith(".game"))) {
  test(`${name} goes on from each tick as in the simulator`, async (t) => holds(t, await compare(bytes(`${FOLDER}/${name}`), cases)));
}

test("drawings ask for what they ask for in Python, and targets are shown alike", (t) => holds(t, compareDrawings(cases)));
