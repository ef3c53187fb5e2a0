// The observation of a team: images [channel, row = y, column = x], as in swarm_pz/spaces/observation.py.

import { CAPTURES_FROM, CELLS as GRID } from "../frames.js";
import { CELLS } from "./controller.js";
import { cellOf, limitsOf, placeOf, TRAIL } from "./ground.js";

export const ALL_CHANNELS = [
  "own_positions", "opposing_positions", "own_trail_age", "opposing_trail_age", "own_capture_field", "opposing_capture_field",
  "own_target", "own_share", "time_left", "own_now", "opposing_now", "own_soon", "opposing_soon",
];
const DRONE = 64, SOON = 0.5; // brightness of a drone; seconds
const PAINT = {
  positions: paintPositions, trail_age: paintTrails, capture_field: paintField, target: paintTarget,
  share: ({ sizes, teams }, team, plane) => plane.fill(255 * sizes[team] / teams.length + 0.5),
  left: ({ tick, lastTick }, _, plane) => plane.fill(255 * (1 - Math.min(tick / lastTick, 1)) + 0.5),
  now: (game, team, plane, grid) => paintShared(game, team, plane, grid, 0),
  soon: (game, team, plane, grid) => paintShared(game, team, plane, grid, SOON),
};

export function observe(game, team, channels, grid = GRID) {
  const images = new Uint8Array(channels.length * grid * grid);
  channels.forEach((channel, i) => {
    const [, whose, what] = /^([a-z]+)_(.+)$/.exec(channel);
    PAINT[what](game, whose === "opposing" ? 1 - team : team, images.subarray(i * grid * grid, (i + 1) * grid * grid), grid);
  });
  return images;
}

// The capture fields of red and blue as frames have them.
export function fieldsOf(game) {
  const both = observe(game, 0, ["own_capture_field", "opposing_capture_field"]);
  return [both.subarray(0, both.length / 2), both.subarray(both.length / 2)];
}

// The cell of a coarser grid that holds a cell.
function coarse(cell, grid) {
  const block = GRID / grid;
  return Math.floor(cell / GRID / block) * grid + Math.floor(cell % GRID / block);
}

function paintPositions({ positions, teams }, team, plane, grid) {
  for (let i = 0; i < teams.length; i++) {
    if (teams[i] !== team) continue;
    const cell = coarse(cellOf(positions[2 * i], positions[2 * i + 1]), grid);
    plane[cell] = Math.min(plane[cell] + DRONE, 255);
  }
}

// Paint newer cells over older ones.
function paintTrails({ ground: { trails }, teams, tick }, team, plane, grid) {
  for (let age = Math.min(TRAIL, tick) - 1; age >= 0; age--) {
    const slot = (tick - 1 - age) % TRAIL * teams.length, shade = Math.floor((255 * (TRAIL - age) + TRAIL / 2) / TRAIL);
    for (let i = 0; i < teams.length; i++) {
      if (teams[i] === team && trails[slot + i] >= 0) plane[coarse(trails[slot + i], grid)] = shade;
    }
  }
}

// Paint 255 value / maximum, at least 192 exactly where the team captures.
function paintField({ ground: { fields } }, team, plane, grid) {
  const field = fields[team], { most, limit } = limitsOf(field), highest = new Int32Array(grid * grid);
  if (!most) return;
  for (let cell = 0; cell < GRID * GRID; cell++) {
    const at = grid === GRID ? cell : coarse(cell, grid), value = field[placeOf(cell)];
    if (value > highest[at]) highest[at] = value;
  }
  for (let at = 0; at < plane.length; at++) {
    const brightness = Math.floor(255 * highest[at] / most + 0.5);
    plane[at] = highest[at] > limit ? Math.max(brightness, CAPTURES_FROM) : Math.min(brightness, CAPTURES_FROM - 1);
  }
}

// Paint the target's density divided by its largest cell; on coarser grids, the mean.
function paintTarget({ targets }, team, plane, grid) {
  const target = targets[team], most = Math.max(...target), block = GRID / grid, weights = new Float64Array(grid * CELLS);
  for (let fine = 0; fine < GRID; fine++) {
    const place = Math.min(Math.max((fine + 0.5) / GRID * CELLS - 0.5, 0), CELLS - 1);
    for (let a = 0; a < CELLS; a++) weights[Math.floor(fine / block) * CELLS + a] += Math.max(0, 1 - Math.abs(place - a)) / block;
  }
  for (let row = 0; row < grid; row++) {
    const line = new Float64Array(CELLS);
    for (let i = 0; i < CELLS * CELLS; i++) line[i % CELLS] += weights[row * CELLS + Math.floor(i / CELLS)] * target[i];
    for (let column = 0; column < grid; column++) {
      const density = line.reduce((sum, value, a) => sum + weights[column * CELLS + a] * value, 0);
      plane[row * grid + column] = Math.min(255 * density / most + 0.5, 255);
    }
  }
}

// Share each drone among the four cells whose centres surround its place.
function paintShared({ positions, velocities, teams }, team, plane, grid, seconds) {
  const inside = (cell) => Math.min(Math.max(cell, 0), grid - 1);
  for (let i = 0; i < teams.length; i++) {
    if (teams[i] !== team) continue;
    const [x, y] = [2 * i, 2 * i + 1].map((at) => Math.min(Math.max(positions[at] + seconds * velocities[at], 0), 1) * grid - 0.5);
    for (const row of [Math.floor(y), Math.floor(y) + 1]) {
      for (const column of [Math.floor(x), Math.floor(x) + 1]) {
        const share = (1 - Math.abs(y - row)) * (1 - Math.abs(x - column)), at = inside(row) * grid + inside(column);
        plane[at] = Math.min(plane[at] + Math.floor(DRONE * share + 0.5), 255);
      }
    }
  }
}
