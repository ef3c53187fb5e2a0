// The arena as it is seen: ground that captures, targets, drones with trails, captures as they happen.

import { trace } from "./contours.js";

export const COLOURS = ["#d62839", "#1d62d6"];
const GREY = [70, 74, 82], DASHED = "#20242a", TARGET = "#0b6e4f";
const CAPTURES = 192; // value of a field from which it captures
const CELLS = 50;
const TRAIL_TICKS = 150, TRAIL_EVERY = 6;
const SEGMENTS_AT_ONCE = 5; // of the trails' 25, so that no picture waits for all of them
const OLDEST_MS = 250; // frames older than this are not shown
const AHEAD_MS = 100; // how far a frame is carried on by its velocities at most
const FLASH_MS = 700;
const JUMP_TICKS = 30; // frames farther apart are not of one motion

export class Arena {
  constructor(ground, drones, now) {
    this.ground = ground;
    this.drones = drones;
    this.now = now; // the server's clock
    this.own = 0;
    this.shade = document.createElement("canvas");
    this.shade.width = this.shade.height = CELLS;
    this.past = document.createElement("canvas"); // trails up to a kept frame
    this.nextPast = document.createElement("canvas"); // those up to the newest, in the making
    this.forget();
  }

  // Begin with another game.
  forget() {
    this.frame = null;
    this.fields = null;
    this.target = null;
    this.groundDirty = true;
    this.forgetMotion();
  }

  forgetMotion() {
    this.trails = []; // frames now and then, newest last
    this.pastTick = -1; // up to which `past` shows them
    this.making = null;
    this.flashes = [];
  }

  // Take a frame in; returns the drones that changed sides.
  take(frame) {
    const last = this.frame;
    const changed = [];
    const jumped = last && (frame.tick < last.tick || frame.tick > last.tick + JUMP_TICKS);
    if (jumped) {
      this.forgetMotion();
    } else if (last && last.teams.length === frame.teams.length) {
      for (let i = 0; i < frame.teams.length; i++) {
        if (frame.teams[i] !== last.teams[i]) {
          changed.push(i);
          this.flashes.push({ drone: i, team: frame.teams[i], began: performance.now() });
        }
      }
    }
    const kept = this.trails.at(-1);
    if (!kept || frame.tick - kept.tick >= TRAIL_EVERY) {
      this.trails.push(frame);
      while (this.trails.length && this.trails[0].tick < frame.tick - TRAIL_TICKS) this.trails.shift();
    }
    if (frame.fields) {
      this.fields = frame.fields;
      this.groundDirty = true;
    }
    this.frame = frame;
    return changed;
  }

  setTarget(target) {
    this.target = target;
    this.groundDirty = true;
  }

  // Paint, and return the frame that is shown, or null if it is too old to show.
  paint() {
    if (this.groundDirty) {
      this.groundDirty = false;
      this.paintGround();
      this.shownTarget = this.target?.number;
    }
    const { frame } = this;
    if (!frame) {
      this.drones.getContext("2d").clearRect(0, 0, this.drones.width, this.drones.width);
      return null;
    }
    const age = this.isLive ? this.now() - frame.serverMs : 0;
    if (age > OLDEST_MS) return null;
    this.paintDrones(frame, age > 0 ? Math.min(age, AHEAD_MS) / 1000 : 0);
    return frame;
  }

  paintGround() {
    const canvas = this.ground, side = canvas.width, pen = canvas.getContext("2d");
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, side, side);
    if (this.fields) {
      this.paintShade(pen, this.fields[this.own], side);
      this.paintLines(pen, this.fields[1 - this.own], CELLS, [CAPTURES - 0.5], side, DASHED, [7, 5], 2);
    }
    if (this.target) {
      this.paintLines(pen, this.target.picture, this.target.cells, [64, 128, 191], side, TARGET, [], 1);
    }
  }

  paintShade(pen, field, side) {
    const draw = this.shade.getContext("2d"), image = draw.createImageData(CELLS, CELLS);
    for (let row = 0; row < CELLS; row++) {
      for (let column = 0; column < CELLS; column++) {
        const value = field[row * CELLS + column], at = 4 * ((CELLS - 1 - row) * CELLS + column);
        [image.data[at], image.data[at + 1], image.data[at + 2]] = GREY;
        image.data[at + 3] = value >= CAPTURES ? 150 : 55 * (value / CAPTURES) ** 2;
      }
    }
    draw.putImageData(image, 0, 0);
    pen.drawImage(this.shade, 0, 0, side, side);
  }

  paintLines(pen, values, cells, levels, side, colour, dash, width) {
    pen.strokeStyle = colour;
    pen.lineWidth = width * side / 500 + 0.5;
    pen.setLineDash(dash);
    pen.beginPath();
    for (const level of levels) {
      trace(values, cells, level, (x0, y0, x1, y1) => {
        pen.moveTo(x0 * side, (1 - y0) * side);
        pen.lineTo(x1 * side, (1 - y1) * side);
      });
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  paintDrones(frame, ahead) {
    const canvas = this.drones, side = canvas.width, pen = canvas.getContext("2d");
    pen.clearRect(0, 0, side, side);
    this.paintTrails(pen, frame, side);
    const size = side * (frame.teams.length > 60 ? 0.008 : 0.0125);
    const limit = (value) => Math.min(Math.max(value, 0), 1);
    const places = frame.positions.map((value, i) => limit(value + ahead * frame.velocities[i]));
    for (const [reach, white] of [[1.45, true], [1, false]]) {
      for (const team of [0, 1]) {
        pen.fillStyle = white ? "#fff" : COLOURS[team];
        pen.beginPath();
        for (let i = 0; i < frame.teams.length; i++) {
          if (frame.teams[i] === team) this.shape(pen, team, places[2 * i] * side, (1 - places[2 * i + 1]) * side, size * reach);
        }
        pen.fill();
      }
    }
    const time = performance.now();
    this.flashes = this.flashes.filter(({ began }) => time - began < FLASH_MS);
    for (const { drone, team, began } of this.flashes) {
      const grown = (time - began) / FLASH_MS;
      pen.globalAlpha = 1 - grown;
      pen.strokeStyle = COLOURS[team];
      pen.lineWidth = side * 0.008;
      pen.beginPath();
      pen.arc(places[2 * drone] * side, (1 - places[2 * drone + 1]) * side, side * (0.02 + 0.05 * grown), 0, 7);
      pen.stroke();
      pen.globalAlpha = 1;
    }
  }

  shape(pen, team, x, y, size) {
    if (team === 0) {
      pen.moveTo(x + size, y);
      pen.arc(x, y, size, 0, 7);
    } else {
      const reach = 1.25 * size;
      pen.moveTo(x - reach, y);
      pen.lineTo(x, y - reach);
      pen.lineTo(x + reach, y);
      pen.lineTo(x, y + reach);
      pen.closePath();
    }
  }

  // The past is painted a few segments at a time, aside, and shown when it is whole; what came since, at once.
  paintTrails(pen, frame, side) {
    this.makePast(side);
    if (this.pastTick >= 0) pen.drawImage(this.past, 0, 0, side, side);
    const since = [...this.trails.filter(({ tick }) => tick >= this.pastTick), frame];
    for (let k = 1; k < since.length; k++) this.paintSegment(pen, since[k - 1], since[k], frame, side);
  }

  makePast(side) {
    if (!this.making && this.trails.length > 1 && this.trails.at(-1).tick > this.pastTick) {
      this.nextPast.width = this.nextPast.height = side; // empties it, too
      this.making = { frames: [...this.trails], k: 1 };
    }
    if (!this.making) return;
    const { frames } = this.making, last = frames.at(-1), pen = this.nextPast.getContext("2d");
    const end = Math.min(this.making.k + SEGMENTS_AT_ONCE, frames.length);
    for (; this.making.k < end; this.making.k++) {
      this.paintSegment(pen, frames[this.making.k - 1], frames[this.making.k], last, side);
    }
    if (end < frames.length) return;
    [this.past, this.nextPast, this.pastTick, this.making] = [this.nextPast, this.past, last.tick, null];
  }

  // One path for all drones of a team, as they are `now`: few strokes, whatever the number of drones.
  paintSegment(pen, from, to, now, side) {
    const fresh = 1 - (now.tick - to.tick) / TRAIL_TICKS;
    pen.lineWidth = side * 0.003;
    pen.globalAlpha = 0.5 * fresh * fresh;
    for (const team of [0, 1]) {
      pen.strokeStyle = COLOURS[team];
      pen.beginPath();
      for (let i = 0; i < now.teams.length; i++) {
        if (now.teams[i] !== team) continue;
        pen.moveTo(from.positions[2 * i] * side, (1 - from.positions[2 * i + 1]) * side);
        pen.lineTo(to.positions[2 * i] * side, (1 - to.positions[2 * i + 1]) * side);
      }
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }
}
