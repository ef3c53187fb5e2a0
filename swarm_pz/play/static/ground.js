// The ground: where each team captures, cell by cell with a hard edge, and what one's own swarm is asked to cover.

import { trace } from "./contours.js";

export const COLOURS = ["#d62839", "#1d62d6"];
export const SHADES = ["#f8c3c7", "#bdd3f6"]; // of ground that captures
const CAPTURES = 192; // value of a field from which it captures
const CELLS = 50;
const TARGET = "#0b6e4f", TARGET_RGB = [11, 110, 79], TARGET_ALPHA = 34;
const HALF = 127.5; // of a target's largest value: inside is where most of the swarm is wanted

// A team's sign: red is striped, blue is dotted, so that nobody needs the colours.
export function hatch(pen, team, scale) {
  const size = Math.max(Math.round(7 * scale), 5), tile = document.createElement("canvas");
  tile.width = tile.height = size;
  const draw = tile.getContext("2d");
  draw.fillStyle = SHADES[team];
  draw.fillRect(0, 0, size, size);
  draw.strokeStyle = draw.fillStyle = COLOURS[team];
  draw.globalAlpha = 0.75;
  draw.beginPath();
  if (team === 0) {
    draw.lineWidth = size / 7;
    for (const shift of [-size, 0, size]) {
      draw.moveTo(shift - 1, size + 1);
      draw.lineTo(shift + size + 1, -1);
    }
    draw.stroke();
  } else {
    draw.arc(size / 2, size / 2, size / 5, 0, 7);
    draw.fill();
  }
  return pen.createPattern(tile, "repeat");
}

export class Ground {
  constructor(canvas) {
    this.canvas = canvas;
    this.own = 0;
    this.tint = document.createElement("canvas");
    this.tint.width = this.tint.height = CELLS;
    this.image = this.tint.getContext("2d").createImageData(CELLS, CELLS);
    this.hatches = null;
    this.forget();
  }

  forget() {
    this.fields = null;
    this.target = null;
    this.hasTint = false;
    this.dirty = true;
  }

  resize() {
    this.hatches = null; // as fine as the screen
    this.dirty = true;
  }

  setTarget(target) {
    this.target = target;
    this.hasTint = Boolean(target) && target.picture.some((value) => value < HALF); // else it is the whole square
    if (this.hasTint && target.cells === CELLS) this.makeTint(target.picture);
    this.dirty = true;
  }

  makeTint(picture) {
    const { data } = this.image;
    for (let row = 0; row < CELLS; row++) {
      for (let column = 0; column < CELLS; column++) {
        const at = 4 * ((CELLS - 1 - row) * CELLS + column);
        [data[at], data[at + 1], data[at + 2]] = TARGET_RGB;
        data[at + 3] = picture[row * CELLS + column] > HALF ? TARGET_ALPHA : 0;
      }
    }
    this.tint.getContext("2d").putImageData(this.image, 0, 0);
  }

  // Whether a team captures at a place, in map widths.
  captures(team, x, y) {
    if (!this.fields) return false;
    const cell = (value) => Math.min(Math.max(Math.floor(value * CELLS), 0), CELLS - 1);
    return this.fields[team][cell(y) * CELLS + cell(x)] >= CAPTURES;
  }

  paint() {
    if (!this.dirty) return;
    this.dirty = false;
    const { canvas } = this, side = canvas.width, pen = canvas.getContext("2d");
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, side, side);
    this.hatches ??= [0, 1].map((team) => hatch(pen, team, side / (canvas.clientWidth || side)));
    if (this.hasTint) {
      if (this.target.cells === CELLS) pen.drawImage(this.tint, 0, 0, side, side);
      this.paintContour(pen, side);
    }
    if (!this.fields) return;
    for (const team of [this.own, 1 - this.own]) this.paintCapturing(pen, team, side); // what endangers one, on top
  }

  paintContour(pen, side) {
    pen.strokeStyle = TARGET;
    pen.lineWidth = side * 0.003;
    pen.beginPath();
    trace(this.target.picture, this.target.cells, HALF, (x0, y0, x1, y1) => {
      pen.moveTo(x0 * side, (1 - y0) * side);
      pen.lineTo(x1 * side, (1 - y1) * side);
    });
    pen.stroke();
  }

  // Whole cells, since the rule asks whole cells: runs of a row are filled, and sides between in and out are drawn.
  paintCapturing(pen, team, side) {
    const field = this.fields[team], size = side / CELLS;
    const holds = (row, column) => row >= 0 && column >= 0 && row < CELLS && column < CELLS
      && field[row * CELLS + column] >= CAPTURES;
    pen.fillStyle = this.hatches[team];
    pen.strokeStyle = COLOURS[team];
    pen.lineWidth = Math.max(side * 0.003, 1.5);
    pen.beginPath();
    for (let row = 0; row < CELLS; row++) {
      for (let column = 0; column < CELLS; column++) {
        if (!holds(row, column)) continue;
        const first = column;
        while (holds(row, column + 1)) column++;
        pen.rect(first * size, (CELLS - 1 - row) * size, (column + 1 - first) * size, size);
      }
    }
    pen.fill();
    pen.beginPath();
    for (let row = 0; row < CELLS; row++) {
      for (let column = 0; column < CELLS; column++) {
        if (!holds(row, column)) continue;
        const x = column * size, y = (CELLS - 1 - row) * size;
        const edge = (x0, y0, x1, y1) => { pen.moveTo(x0, y0); pen.lineTo(x1, y1); };
        if (!holds(row + 1, column)) edge(x, y, x + size, y);
        if (!holds(row - 1, column)) edge(x, y + size, x + size, y + size);
        if (!holds(row, column - 1)) edge(x, y, x, y + size);
        if (!holds(row, column + 1)) edge(x + size, y, x + size, y + size);
      }
    }
    pen.stroke();
  }
}
