// The default game of swarm_pz, tick by tick: docs/rules.md. tests/play/test_engine.py compares it with the simulator.

import { CELLS, coefficientsOf, Controller, normalised } from "./controller.js";
import { Ground } from "./ground.js";
import { Random } from "./random.js";
import { SIDES, TICKS } from "../words.js";

export const PERIOD = 3; // ticks between solves
const INSET = 0.1, RADIUS = 0.08; // drones start within RADIUS of points INSET from two walls
const TICK = Math.fround(1 / TICKS); // seconds

export class Game {
  // Sizes of the teams, and the time limit in seconds.
  constructor({ red = 10, blue = 10, timeLimit = 300 } = {}, seed = 0) {
    const count = red + blue;
    this.tick = 0;
    this.lastTick = Math.round(timeLimit * 10) * PERIOD;
    this.sizes = [red, blue];
    this.isPractice = !red || !blue;
    this.positions = new Float32Array(2 * count);
    this.velocities = new Float32Array(2 * count);
    this.accelerations = new Float32Array(2 * count);
    this.teams = new Uint8Array(count).fill(1, red);
    this.ground = new Ground(count);
    this.controller = new Controller(count);
    this.targets = [];
    this.coefficients = [];
    for (const team of [0, 1]) this.command(team, new Float32Array(CELLS * CELLS));
    this.start(new Random(seed));
  }

  // Place drones at random near the corners, with random numbers in the order of swarm_pz/simulator/spawn.py.
  start(random) {
    const { positions } = this, count = this.teams.length;
    for (let i = 0; i < 2 * count; i++) positions[i] = random.bit();
    const draw = () => Array.from({ length: count }, () => random.next()), angles = draw(), distances = draw();
    for (let i = 0; i < count; i++) {
      const angle = 2 * Math.PI * angles[i], away = RADIUS * Math.sqrt(distances[i]), corner = (far) => (far ? 1 - INSET : INSET);
      positions[2 * i] = corner(positions[2 * i]) + away * Math.cos(angle);
      positions[2 * i + 1] = corner(positions[2 * i + 1]) + away * Math.sin(angle);
    }
  }

  // Practice, where one side is alone from the start, is never decided.
  get isDecided() { return !this.isPractice && (!this.sizes[0] || !this.sizes[1]); }

  get isOver() { return this.isDecided || this.tick >= this.lastTick; }

  get outcome() {
    if (this.isDecided) return SIDES[this.sizes[0] ? 0 : 1];
    return this.isOver ? "draw" : null;
  }

  // Set the density, 10 by 10 cells with rows from the bottom, that a team follows from the next solve on.
  command(team, density) {
    this.targets[team] = normalised(density);
    this.coefficients[team] = coefficientsOf(this.targets[team]);
  }

  // Run a tick; return the captured drones, each with its new team.
  advance() {
    if (this.isOver) return [];
    if (this.tick % PERIOD === 0) this.controller.solve(this);
    this.move();
    this.ground.extend(this.tick, this.positions, this.teams);
    this.tick++;
    return this.ground.caught(this.positions, this.teams).map((drone) => this.capture(drone));
  }

  // Move the drones. At a wall, the velocity towards it becomes 0.
  move() {
    const { positions, velocities, accelerations } = this;
    for (let i = 0; i < positions.length; i++) {
      velocities[i] += accelerations[i] * TICK;
      positions[i] += velocities[i] * TICK;
      if (positions[i] >= 0 && positions[i] <= 1) continue;
      positions[i] = positions[i] < 0 ? 0 : 1;
      velocities[i] = 0;
    }
  }

  capture(drone) {
    const loser = this.teams[drone], team = 1 - loser;
    this.ground.handOver(drone, loser);
    this.controller.forget(drone);
    this.teams[drone] = team;
    this.sizes[loser]--;
    this.sizes[team]++;
    return { drone, team };
  }
}
