// Trails, and the capture fields that they add up to, as docs/rules.md explains them: whole numbers, so nothing is rounded.

import { CELLS as GRID } from "../frames.js"; // a side

export const TRAIL = 150; // ticks
const BORDER = 2, WIDTH = GRID + 2 * BORDER; // fields have a border in which they are always 0
const UNIT = 55440; // stands for a field of 1; every possible number of ring cells divides it
const THRESHOLD = 0.75;

// Steps in a field from a cell to the 16 cells of its ring.
const FIVE = [-2, -1, 0, 1, 2], isFar = (step) => Math.abs(step) === 2;
const RING = FIVE.flatMap((up) => FIVE.filter((right) => isFar(up) || isFar(right)).map((right) => WIDTH * up + right));
// What a tick on its ring adds to each cell; a part of the ring can lie beyond the border.
const WEIGHTS = new Int32Array(WIDTH * WIDTH), INSIDE = Array.from({ length: GRID * GRID }, (_, cell) => placeOf(cell));
for (const place of INSIDE) WEIGHTS[place] = 1;
for (const place of INSIDE) WEIGHTS[place] = UNIT / RING.filter((step) => WEIGHTS[place + step]).length;

// Return a cell's index in a field.
export function placeOf(cell) { return (Math.floor(cell / GRID) + BORDER) * WIDTH + cell % GRID + BORDER; }

function along(coordinate) { return Math.min(Math.floor(GRID * Math.max(coordinate, 0)), GRID - 1); }

export function cellOf(x, y) { return along(y) * GRID + along(x); }

// Return a field's largest value, and the limit above which it captures.
export function limitsOf(field) {
  let most = 0;
  for (let i = 0; i < field.length; i++) if (field[i] > most) most = field[i];
  return { most, limit: Math.floor(THRESHOLD * most) };
}

export class Ground {
  constructor(drones) {
    this.drones = drones;
    this.trails = new Int16Array(TRAIL * drones).fill(-1); // cells, tick by tick, the oldest overwritten
    this.fields = [new Int32Array(WIDTH * WIDTH), new Int32Array(WIDTH * WIDTH)]; // red's and blue's
  }

  // Add ticks in a cell to the field of each cell on its ring: exactly these have it on theirs.
  add(team, cell, ticks) {
    const field = this.fields[team], place = placeOf(cell);
    for (const step of RING) field[place + step] += ticks * WEIGHTS[place + step];
  }

  // Overwrite the oldest cell of each trail with the drone's present cell.
  extend(tick, positions, teams) {
    const { trails } = this, slot = tick % TRAIL * this.drones;
    for (let i = 0; i < this.drones; i++) {
      const oldest = trails[slot + i], newest = cellOf(positions[2 * i], positions[2 * i + 1]);
      if (newest === oldest) continue;
      trails[slot + i] = newest;
      this.add(teams[i], newest, 1);
      if (oldest >= 0) this.add(teams[i], oldest, -1);
    }
  }

  // The drones that the other team's field captures.
  caught(positions, teams) {
    const limits = this.fields.map((field) => limitsOf(field).limit), caught = [];
    for (let i = 0; i < this.drones; i++) {
      const other = 1 - teams[i], place = placeOf(cellOf(positions[2 * i], positions[2 * i + 1]));
      if (this.fields[other][place] > limits[other]) caught.push(i);
    }
    return caught;
  }

  // Let a drone's trail count for the other team from now on.
  handOver(drone, loser) {
    for (let at = drone; at < this.trails.length; at += this.drones) {
      const cell = this.trails[at];
      if (cell < 0) continue;
      this.add(loser, cell, -1);
      this.add(1 - loser, cell, 1);
    }
  }
}
