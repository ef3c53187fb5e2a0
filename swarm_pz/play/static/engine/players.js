// Opponents without a server: scripts of policies/scripted.py and policies/moving.py, and learned players by their weights.

import { CELLS } from "./controller.js";
import { ALL_CHANNELS, observe } from "./observation.js";
import { TICKS } from "../words.js";

const RANGE = 4, MIDDLE = [0.5, 0.5]; // of log-densities; of the square
const centre = (cell) => (cell + 0.5) / CELLS;
// Return a density from a function of x and y, called at the cells' centres.
const every = (at) => Float64Array.from({ length: CELLS * CELLS }, (_, i) => at(centre(i % CELLS), centre(Math.floor(i / CELLS))));
const away = (/** @type {number[]} */ [x0, y0]) => every((x, y) => Math.hypot(x - x0, y - y0));
const spot = (distance, width) => Math.exp(-((distance / width) ** 2) / 2);
const disc = (distance) => spot(distance, 0.1);
const ring = (place, width = 0.08, radius = 0.25) => away(place).map((distance) => Math.exp(-(((distance - radius) / width) ** 2)));
const lap = (radius, period, answers) => [Math.cos, Math.sin].map((of) => 0.5 + radius * of(2 * Math.PI * answers / period));

// Each maps the game, its team, and the number of its earlier answers to a density.
const SCRIPTS = {
  breather: ({ answers }) => ring(MIDDLE, 0.08, Math.floor(answers / 4) % 2 ? 0.2 : 0.37),
  centre: () => away(MIDDLE).map(disc),
  corners: () => every((x, y) => disc(Math.hypot(Math.min(x, 1 - x) - 0.1, Math.min(y, 1 - y) - 0.1))),
  halo: () => ring(MIDDLE, 0.15),
  hoop: ({ answers }) => ring(lap(0.15, 6, answers), 0.08, 0.15),
  lasso: (state) => ring(opponents(state).map((place) => 0.5 + 0.3 * (place - 0.5)), 0.15),
  pendulum: ({ answers }) => away([0.5 + 0.35 * Math.sin(2 * Math.PI * answers / 24), 0.5]).map(disc),
  ring: (state) => ring(opponents(state)),
  runner: ({ answers }) => away(lap(0.24, 6, answers)).map((distance) => spot(distance, 0.18)),
  stroller: ({ answers }) => away(lap(0.24, 10, answers)).map((distance) => spot(distance, 0.18)),
  tide({ answers }) {
    const side = Math.floor(answers / 5) % 2;
    return every((x, y) => disc(Math.hypot((side ? 1 - x : x) - 0.25, Math.max(Math.abs(y - 0.5) - 0.3, 0))));
  },
  uniform: () => every(() => 1),
  wavefront(state) {
    const gathersLeft = opponents(state)[0] > 0.5, front = 0.25 + 0.75 * Math.min(Math.max((state.answers % 12 - 4) / 8, 0), 1);
    return every((x) => 1 / (1 + Math.exp(((gathersLeft ? x : 1 - x) - front) / 0.03)));
  },
};
const LEARNED = ["hunter", "champion", "veteran", "finisher", "scholar"];

export const PLAYERS = [...Object.keys(SCRIPTS), ...LEARNED];

// Return the mean place of the opposing drones in the observation.
function opponents({ game, team }) {
  const grid = 25, image = observe(game, team, ["opposing_positions"], grid), total = image.reduce((a, b) => a + b);
  const mean = (along) => image.reduce((sum, value, i) => sum + value * (2 * along(i) + 1), 0) / (2 * grid * total);
  return total ? [mean((i) => i % grid), mean((i) => Math.floor(i / grid))] : MIDDLE;
}

// Return the density of a network's log-densities, interpolated between the centres of its cells.
function infer({ channels, grid, cells, act }, game, team) {
  const answers = act(observe(game, team, ALL_CHANNELS.slice(0, channels), grid));
  const hat = (at, cell) => Math.max(0, 1 - Math.abs(Math.min(Math.max(at * cells - 0.5, 0), cells - 1) - cell));
  const logs = every((x, y) => answers.reduce((sum, value, i) => sum + hat(x, i % cells) * hat(y, Math.floor(i / cells)) * value, 0));
  const most = Math.max(...logs);
  return logs.map((value) => Math.exp(RANGE * (value - most)));
}

async function fetchBeside(name) {
  const answer = await fetch(new URL(`${name}.safetensors`, import.meta.url));
  if (!answer.ok) throw new Error(`the weights of ${name} must lie beside the engine, got status ${answer.status}`);
  return answer.arrayBuffer();
}

// Return a player; act returns its command for the next second, fetchBytes the weights of a learned one.
export async function loadPlayer(name, fetchBytes = fetchBeside) {
  const script = SCRIPTS[name];
  if (!PLAYERS.includes(name)) throw new Error(`a player must be one of ${PLAYERS.join(", ")}, got ${name}`);
  const network = script ? null : (await import("./network.js")).networkOf(await fetchBytes(name));
  function act(game, team, answers = game.tick / TICKS) {
    const density = script ? script({ game, team, answers }) : infer(network, game, team), most = Math.max(...density);
    return Float32Array.from(density, (value) => value / most);
  }
  return { name, act };
}
