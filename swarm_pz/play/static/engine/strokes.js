// Drawings as commands, as in swarm_pz/play/strokes.py: strokes are painted, the image is smoothed, its means are the command.

import { CELLS, coefficientsOf, MODES, normalised } from "./controller.js";
import { CELLS as GRID } from "../frames.js";

const PIXELS = 2 * GRID; // a side of the painted image
const [UNTOUCHED, ATTRACT, REPEL] = [0, 1, 2], BRUSHES = { erase: UNTOUCHED, attract: ATTRACT, repel: REPEL };
const WIDTH = 0.05; // of the smoothing "firm", in map widths
// Weights that smooth along one axis, mirrored at the walls.
const SMOOTHING = new Float64Array(PIXELS * PIXELS);
for (let to = 0; to < PIXELS; to++) {
  const line = SMOOTHING.subarray(to * PIXELS, (to + 1) * PIXELS), centre = (to + 0.5) / PIXELS;
  for (let from = 0; from < PIXELS; from++) {
    const other = (from + 0.5) / PIXELS;
    for (const place of [-other, other, 2 - other]) line[from] += Math.exp(-((centre - place) ** 2) / (2 * WIDTH ** 2));
  }
  const sum = line.reduce((a, b) => a + b);
  line.forEach((value, i) => { line[i] = value / sum; });
}

// Paint the pixels whose centres are within reach of a line; all in pixels.
function paint(image, points, reach, value) {
  for (let k = 0; k < points.length; k++) {
    const [ax, ay] = points[k], [bx, by] = points[Math.min(k + 1, points.length - 1)], dx = bx - ax, dy = by - ay;
    const length = dx * dx + dy * dy, top = Math.min(PIXELS, Math.trunc(Math.max(ay, by) + reach) + 1);
    for (let row = Math.max(0, Math.trunc(Math.min(ay, by) - reach)); row < top; row++) {
      const right = Math.min(PIXELS, Math.trunc(Math.max(ax, bx) + reach) + 1);
      for (let column = Math.max(0, Math.trunc(Math.min(ax, bx) - reach)); column < right; column++) {
        const x = column + 0.5 - ax, y = row + 0.5 - ay;
        const share = length > 0 ? Math.min(Math.max((x * dx + y * dy) / length, 0), 1) : 0;
        if ((x - share * dx) ** 2 + (y - share * dy) ** 2 <= reach * reach) image[row * PIXELS + column] = value;
      }
    }
  }
}

// Smooth an image along one axis and transpose it: applied twice, this smooths along both axes.
function smooth(image) {
  const turned = new Float64Array(PIXELS * PIXELS);
  for (let i = 0; i < turned.length; i++) {
    const to = i - i % PIXELS, from = i % PIXELS * PIXELS;
    let sum = 0;
    for (let k = 0; k < PIXELS; k++) sum += SMOOTHING[to + k] * image[from + k];
    turned[i] = sum;
  }
  return turned;
}

export function densityOf(strokes) {
  const painted = new Uint8Array(PIXELS * PIXELS);
  for (const { brush, width: wide, points } of strokes) {
    paint(painted, points.map((point) => point.map((place) => place * PIXELS)), wide / 2 * PIXELS, BRUSHES[brush]);
  }
  const untouched = painted.includes(ATTRACT) ? 0 : 0.5, smoothed = (of) => smooth(smooth(Float64Array.from(painted, of)));
  const image = smoothed((brush) => [untouched, 1, 0][brush]), means = new Float64Array(CELLS * CELLS);
  // Repelling ground is empty up to its edge, where its smoothed image is one half, and less and less so beyond it.
  const empty = painted.includes(REPEL) ? smoothed((brush) => Number(brush === REPEL)) : null;
  image.forEach((value, i) => {
    const block = PIXELS / CELLS, cell = Math.floor(i / PIXELS / block) * CELLS + Math.floor(i % PIXELS / block);
    means[cell] += Math.min(value, 1) * (1 - (empty ? Math.min(2 * empty[i], 1) : 0)) / (block * block);
  });
  return Float32Array.from(means, (value) => Math.min(value, 1));
}

// Return the picture of a command as the controller has it: 255 value / maximum of its cosine series.
export function targetOf(density) {
  const coefficients = coefficientsOf(normalised(density)), values = new Float64Array(GRID * GRID), line = new Float64Array(MODES);
  const cosine = (k, cell) => (k ? 2 : 1) * Math.cos(Math.PI * k * (cell + 0.5) / GRID);
  const cosines = Float64Array.from({ length: MODES * GRID }, (_, i) => cosine(i % MODES, Math.floor(i / MODES)));
  for (let row = 0; row < GRID; row++) {
    line.fill(0);
    coefficients.forEach((value, k) => { line[Math.floor(k / MODES)] += value * cosines[row * MODES + k % MODES]; });
    for (let column = 0; column < GRID; column++) {
      values[row * GRID + column] = Math.max(line.reduce((sum, value, k) => sum + value * cosines[column * MODES + k], 0), 0);
    }
  }
  const most = Math.max(...values);
  return Uint8Array.from(values, (value) => Math.round(255 * value / most));
}
