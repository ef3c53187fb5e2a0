// The ergodic controller of docs/controller.md. As in swarm_pz, sums are float64; memory, points and tables are float32.

export const CELLS = 10, MODES = 10; // per side, of a command and of the controller
const SQUARE = MODES * MODES, HORIZON = 10, PERIOD = 0.1;
const DECAY = Math.fround(Math.exp(-PERIOD / 4)), ACCELERATE = -10 * PERIOD; // -PERIOD over the control weight, 0.1
const WALL = 100, MARGIN = Math.fround(0.05), FASTEST = 1;
const TIMES = Float32Array.from({ length: HORIZON + 1 }, (_, h) => PERIOD * h);
const SPECTRUM = Float32Array.from({ length: SQUARE }, (_, k) => 200 * (1 + Math.floor(k / MODES) ** 2 + (k % MODES) ** 2) ** -1.5);
const [S1, C2, S3, C4, S5, C6, S7, C8, S9, C10, S11, C12] = Array.from({ length: 12 }, (_, i) => {
  let term = i % 4 === 0 || i % 4 === 3 ? 1 : -1;
  for (let n = 1; n <= i + 1; n++) term *= Math.PI / n;
  return term;
});

// Write cosines and sines of 0 to 9 times pi x. The nearest whole number gives the sign; a Taylor series, which every
// browser computes alike, gives the rest.
function tabulate(place, cosines, sines, at) {
  const whole = Math.floor(place + 0.5), x = place - whole, q = x * x, sign = whole & 1 ? -1 : 1;
  const cosine = sign * (1 + q * (C2 + q * (C4 + q * (C6 + q * (C8 + q * (C10 + q * C12))))));
  const sine = sign * x * (S1 + q * (S3 + q * (S5 + q * (S7 + q * (S9 + q * S11)))));
  let c = 1, s = 0;
  for (let k = at; k < at + MODES; k++) {
    cosines[k] = c;
    sines[k] = s;
    const next = c * cosine - s * sine;
    s = s * cosine + c * sine;
    c = next;
  }
}

// Scale a command to a sum of 1; an empty one becomes uniform.
export function normalised(density) {
  const peak = Math.max(...density), target = Float64Array.from(density, (value) => (peak ? value / peak : 1));
  const total = target.reduce((a, b) => a + b);
  return target.map((value) => value / total);
}

// Integrals of cos(pi k x) times a cell's weight: a hat function, mirrored at the walls like the cosine.
const HATS = Float64Array.from({ length: CELLS * MODES }, (_, i) => {
  const cell = Math.floor(i / MODES), half = Math.PI * (i % MODES) / (2 * CELLS);
  return Math.cos(half * (2 * cell + 1)) * (half ? (Math.sin(half) / half) ** 2 : 1);
});

// Coefficients of a target, [k1 (x), k2 (y)]; the first is 1.
export function coefficientsOf(target) {
  const sums = new Float64Array(SQUARE);
  for (let i = 0; i < CELLS * CELLS; i++) {
    const x = i % CELLS * MODES, y = (i - i % CELLS) / CELLS * MODES;
    for (let k = 0; k < SQUARE; k++) sums[k] += target[i] * HATS[x + Math.floor(k / MODES)] * HATS[y + k % MODES];
  }
  return Float32Array.from(sums, (value) => value / sums[0]);
}

// The slope of the cost of walls.
function beyond(place) { return 2 * WALL * (Math.max(place - (1 - MARGIN), 0) + Math.min(place - MARGIN, 0)); }

export class Controller {
  constructor(drones) {
    const points = drones * HORIZON, numbers = (count) => new Float32Array(count), sums = () => new Float64Array(SQUARE);
    this.memory = numbers(drones * SQUARE); // of each drone's past, and its weight
    this.weights = numbers(drones);
    this.x = numbers(points); // predicted places: their last bit can change an acceleration by a ten-thousandth
    this.y = numbers(points);
    this.cosX = numbers(points * MODES);
    this.sinX = numbers(points * MODES);
    this.cosY = numbers(points * MODES);
    this.sinY = numbers(points * MODES);
    this.sums = sums(); // of one drone
    this.means = [sums(), sums()]; // of red and blue
    this.errors = sums();
    this.slopes = sums();
  }

  forget(drone) {
    this.memory.fill(0, drone * SQUARE, (drone + 1) * SQUARE);
    this.weights[drone] = 0;
  }

  // Set the accelerations of all drones towards their team's target, given by its coefficients.
  solve({ positions, velocities, accelerations, teams, sizes, coefficients }) {
    const { means, errors, slopes } = this;
    for (const mean of means) mean.fill(0);
    for (let i = 0; i < teams.length; i++) this.expect(i, positions, velocities, sizes[teams[i]], means[teams[i]]);
    for (const team of [0, 1]) {
      for (let k = 0; k < SQUARE; k++) {
        errors[k] = SPECTRUM[k] * (means[team][k] - coefficients[team][k]);
        slopes[k] = Math.PI * (k % MODES) * errors[k];
      }
      for (let i = 0; i < teams.length; i++) if (teams[i] === team) this.steer(i, accelerations);
    }
  }

  // Add a drone's place, and its places ahead if it coasts, to its own and its team's sums.
  expect(i, positions, velocities, size, mean) {
    const { memory, weights, sums, x, y, cosX, sinX, cosY, sinY } = this, first = i * SQUARE;
    for (let h = 0; h <= HORIZON; h++) {
      const point = i * HORIZON + Math.max(h - 1, 0), at = point * MODES; // only the memory needs the present
      x[point] = positions[2 * i] + TIMES[h] * velocities[2 * i];
      y[point] = positions[2 * i + 1] + TIMES[h] * velocities[2 * i + 1];
      tabulate(x[point], cosX, sinX, at);
      tabulate(y[point], cosY, sinY, at);
      for (let k1 = 0, k = 0; k1 < MODES; k1++) {
        const along = cosX[at + k1];
        if (h) for (let k2 = 0; k2 < MODES; k2++, k++) sums[k] += along * cosY[at + k2];
        else for (let k2 = 0; k2 < MODES; k2++, k++) memory[first + k] = sums[k] = DECAY * memory[first + k] + along * cosY[at + k2];
      }
    }
    weights[i] = DECAY * weights[i] + 1;
    const share = 1 / (size * (weights[i] + HORIZON));
    for (let k = 0; k < SQUARE; k++) mean[k] += share * sums[k];
  }

  // Set a drone's acceleration against the costate, summed along its path; the first point has weight 0.
  steer(i, accelerations) {
    const { x, y, cosX, sinX, cosY, sinY, errors, slopes } = this;
    let totalX = 0, totalY = 0;
    for (let h = 1; h < HORIZON; h++) {
      const point = i * HORIZON + h, at = point * MODES;
      let slopeX = beyond(x[point]), slopeY = beyond(y[point]);
      for (let k1 = 0, k = 0; k1 < MODES; k1++) {
        let alongX = 0, alongY = 0;
        for (let k2 = 0; k2 < MODES; k2++, k++) {
          alongX += errors[k] * cosY[at + k2];
          alongY += slopes[k] * sinY[at + k2];
        }
        slopeX -= Math.PI * k1 * sinX[at + k1] * alongX;
        slopeY -= cosX[at + k1] * alongY;
      }
      totalX += TIMES[h] * slopeX;
      totalY += TIMES[h] * slopeY;
    }
    const u = ACCELERATE * totalX, v = ACCELERATE * totalY, scale = Math.min(FASTEST / Math.sqrt(u * u + v * v), 1);
    accelerations[2 * i] = u * scale;
    accelerations[2 * i + 1] = v * scale;
  }
}
