// The ground: cells where each team captures, and the target of the own swarm.

import { CAPTURES_FROM, CELLS, NEARLY_FROM } from "./frames.js";

// Colours of the style sheet, light or dark: of teams, of their ground, of strokes that attract or repel, of the page.
/** @type {any} */
export const look = {};
const night = matchMedia("(prefers-color-scheme: dark)");
const TINT = 34; // strength of the target's tint, of 255
const FAINT = 0.3; // opacity of ground where a team nearly captures
const HALF = 127.5; // of a target's largest value: inside is where most of the swarm is wanted

/** @returns {HTMLCanvasElement} */
export function newCanvas(width, height = width) { return Object.assign(document.createElement("canvas"), { width, height }); }

// A pattern of square tiles.
export function pattern(pen, size, paint) {
  const tile = newCanvas(size);
  paint(tile.getContext("2d"));
  return pen.createPattern(tile, "repeat");
}

// Return a team's pattern: red is striped and blue dotted, for people who do not see the colours.
export function hatch(pen, team, scale) {
  const size = Math.max(Math.round(7 * scale), 5);
  return pattern(pen, size, (tile) => {
    tile.fillStyle = look.shades[team];
    tile.fillRect(0, 0, size, size);
    tile.strokeStyle = tile.fillStyle = look.teams[team];
    tile.globalAlpha = 0.75;
    tile.lineWidth = size / 7;
    if (team === 1) return disc(tile, size / 2, size / 2, size / 5);
    tile.beginPath();
    for (const shift of [-size, 0, size]) {
      tile.moveTo(shift - 1, size + 1);
      tile.lineTo(shift + size + 1, -1);
    }
    tile.stroke();
  });
}

// Draw a stroke, or a dot; points and width in map widths.
export function drawLine(pen, points, width, side, style) {
  const [[x0, y0]] = points;
  pen.strokeStyle = style;
  pen.lineWidth = width * side;
  pen.lineCap = pen.lineJoin = "round";
  pen.beginPath();
  pen.moveTo(x0 * side, (1 - y0) * side);
  for (const [x, y] of points) pen.lineTo(x * side, (1 - y) * side);
  pen.stroke();
}

export function disc(pen, x, y, radius) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 7);
  pen.fill();
}

// Add a drone to a path: red ones are discs, blue ones diamonds.
export function addDrone(pen, team, x, y, size) {
  if (team === 0) {
    pen.moveTo(x + size, y);
    pen.arc(x, y, size, 0, 7);
    return;
  }
  const reach = 1.25 * size;
  pen.moveTo(x - reach, y);
  pen.lineTo(x, y - reach);
  pen.lineTo(x + reach, y);
  pen.lineTo(x, y + reach);
  pen.closePath();
}

// Call act() when the device changes to dark or light colours.
export function onLook(act) { night.addEventListener("change", act); }

function read() {
  const style = getComputedStyle(document.documentElement), of = (name) => style.getPropertyValue(`--${name}`).trim();
  for (const name of ["asked", "away", "ink", "ground", "panel", "line"]) look[name] = of(name);
  look.teams = [of("red"), of("blue")];
  look.shades = [of("red-ground"), of("blue-ground")];
}
read();
onLook(read);

export class Ground {
  constructor(canvas) {
    this.canvas = canvas;
    this.own = 0;
    this.tint = newCanvas(CELLS);
    this.image = this.tint.getContext("2d").createImageData(CELLS, CELLS);
    this.forget();
    onLook(() => {
      this.scale = null; // hatches have other colours
      this.setTarget(this.target);
    });
  }

  forget() {
    this.fields = this.target = null;
    this.hasTint = false;
    this.dirty = true;
  }

  setTarget(target) {
    this.target = target;
    this.hasTint = Boolean(target) && target.picture.some((value) => value < HALF); // else the target is the whole square
    this.dirty = true;
    if (this.hasTint) this.makeTint();
  }

  // The tint is kept: the target changes once a second or less, the ground ten times.
  makeTint() {
    const { picture } = this.target;
    this.contour = [];
    trace(picture, CELLS, HALF, (...ends) => this.contour.push(ends));
    const colour = [1, 3, 5].map((from) => parseInt(look.asked.slice(from, from + 2), 16));
    picture.forEach((value, i) => {
      const row = CELLS - 1 - Math.floor(i / CELLS), place = 4 * (row * CELLS + i % CELLS);
      this.image.data.set([...colour, value > HALF ? TINT : 0], place);
    });
    this.tint.getContext("2d").putImageData(this.image, 0, 0);
  }

  // Tell if a team captures, or nearly captures, at a place in map widths.
  nears(team, x, y) {
    if (!this.fields) return false;
    const cell = (value) => Math.min(Math.max(Math.floor(value * CELLS), 0), CELLS - 1);
    return this.fields[team][cell(y) * CELLS + cell(x)] >= NEARLY_FROM;
  }

  paint() {
    this.dirty = false;
    const { canvas } = this, side = canvas.width, pen = canvas.getContext("2d");
    pen.fillStyle = look.ground;
    pen.fillRect(0, 0, side, side);
    const scale = side / (canvas.clientWidth || side);
    if (scale !== this.scale) this.hatches = [0, 1].map((team) => hatch(pen, team, scale));
    this.scale = scale;
    if (this.hasTint) {
      pen.drawImage(this.tint, 0, 0, side, side);
      this.paintContour(pen, side);
    }
    if (this.fields) for (const team of [this.own, 1 - this.own]) this.paintCapturing(pen, team, side); // the opponent's ground on top
  }

  paintContour(pen, side) {
    pen.strokeStyle = look.asked;
    pen.lineWidth = side * 0.003;
    pen.beginPath();
    for (const [x0, y0, x1, y1] of this.contour) {
      pen.moveTo(x0 * side, (1 - y0) * side);
      pen.lineTo(x1 * side, (1 - y1) * side);
    }
    pen.stroke();
  }

  // Paint whole cells, since the rule uses whole cells, and their outline.
  paintCapturing(pen, team, side) {
    const field = this.fields[team], size = side / CELLS;
    const holds = (row, column) => row >= 0 && column >= 0 && row < CELLS && column < CELLS
      && field[row * CELLS + column] >= CAPTURES_FROM;
    const edges = new Path2D(), cells = new Path2D(), nearly = new Path2D();
    const edge = (x0, y0, x1, y1) => {
      edges.moveTo(x0, y0);
      edges.lineTo(x1, y1);
    };
    for (let row = 0; row < CELLS; row++) {
      for (let column = 0; column < CELLS; column++) {
        const x = column * size, y = (CELLS - 1 - row) * size;
        if (!holds(row, column)) {
          if (field[row * CELLS + column] >= NEARLY_FROM) nearly.rect(x, y, size, size);
          continue;
        }
        cells.rect(x, y, size, size);
        if (!holds(row + 1, column)) edge(x, y, x + size, y);
        if (!holds(row - 1, column)) edge(x, y + size, x + size, y + size);
        if (!holds(row, column - 1)) edge(x, y, x, y + size);
        if (!holds(row, column + 1)) edge(x + size, y, x + size, y + size);
      }
    }
    pen.fillStyle = this.hatches[team];
    pen.strokeStyle = look.teams[team];
    pen.lineWidth = Math.max(side * 0.003, 1.5);
    pen.globalAlpha = FAINT;
    pen.fill(nearly);
    pen.globalAlpha = 1;
    pen.fill(cells);
    pen.stroke(edges);
  }
}

// Sides of a square that a line joins, by the bits of the corners above the level, or of those below it.
const LINES = { 1: ["ws"], 2: ["se"], 3: ["we"], 4: ["en"], 5: ["ws", "en"], 6: ["sn"], 7: ["wn"], 10: ["se", "wn"] };

// Contour lines of a grid of values, by marching squares: call piece(x0, y0, x1, y1), in map widths, for each piece of the
// line at a level, between cell centres.
export function trace(values, cells, level, piece) {
  const at = (column, row) => values[row * cells + column];
  const cross = (a, b) => (level - a) / (b - a);
  const place = (index) => (index + 0.5) / cells;
  for (let row = 0; row < cells - 1; row++) {
    for (let column = 0; column < cells - 1; column++) {
      const a = at(column, row), b = at(column + 1, row), c = at(column + 1, row + 1), d = at(column, row + 1);
      const corners = [a, b, c, d].reduce((bits, value, i) => bits | Number(value > level) << i, 0);
      const lines = LINES[corners] ?? LINES[15 - corners];
      if (!lines) continue;
      const sides = {
        s: [column + cross(a, b), row], e: [column + 1, row + cross(b, c)], n: [column + cross(d, c), row + 1], w: [column, row + cross(a, d)],
      };
      for (const [from, to] of lines) piece(...sides[from].map(place), ...sides[to].map(place));
    }
  }
}
