// Where drones came from: the last five seconds, fading, and always fainter than the drones themselves.

import { look, newCanvas } from "./ground.js";

const TRAIL_TICKS = 150, TRAIL_EVERY = 6;
const SEGMENTS_AT_ONCE = 5; // of 25, so that no picture waits for all of them
const DARKEST = 0.34;
const MANY = 60; // drones of which each has a fainter trail

export class Trails {
  constructor() {
    this.past = newCanvas(1); // up to a kept frame
    this.nextPast = newCanvas(1); // up to the newest, in the making
    this.forget();
  }

  forget() {
    this.kept = []; // frames now and then, newest last
    this.pastTick = -1; // up to which `past` shows them
    this.making = null;
  }

  take(frame) {
    const last = this.kept.at(-1);
    if (last && frame.tick - last.tick < TRAIL_EVERY) return;
    this.kept.push(frame);
    while (this.kept[0].tick < frame.tick - TRAIL_TICKS) this.kept.shift();
  }

  // Paint up to where the drones are shown. The past is painted a few segments at a time, aside, and shown when it
  // is whole; what came since, at once.
  paint(pen, frame, places, side) {
    this.makePast(side);
    if (this.pastTick >= 0) pen.drawImage(this.past, 0, 0, side, side);
    let from = null;
    for (const kept of this.kept) {
      if (kept.tick < this.pastTick) continue;
      if (from) this.segment(pen, from.positions, kept.positions, frame, kept.tick, side);
      from = kept;
    }
    if (from) this.segment(pen, from.positions, places, frame, frame.tick, side);
  }

  makePast(side) {
    if (!this.making && this.kept.length > 1 && this.kept.at(-1).tick > this.pastTick) {
      this.nextPast.width = this.nextPast.height = side; // empties it, too
      this.making = { frames: [...this.kept], k: 1 };
    }
    if (!this.making) return;
    const { frames } = this.making, last = frames.at(-1), pen = this.nextPast.getContext("2d");
    const end = Math.min(this.making.k + SEGMENTS_AT_ONCE, frames.length);
    for (; this.making.k < end; this.making.k++) {
      const [from, to] = [frames[this.making.k - 1], frames[this.making.k]];
      this.segment(pen, from.positions, to.positions, last, to.tick, side);
    }
    if (end < frames.length) return;
    [this.past, this.nextPast, this.pastTick, this.making] = [this.nextPast, this.past, last.tick, null];
  }

  // Draw one path for all drones of a team as they are `now`: few strokes for any number of drones.
  segment(pen, from, to, now, tick, side) {
    const fresh = 1 - (now.tick - tick) / TRAIL_TICKS, { teams } = now;
    pen.lineWidth = Math.max(side * 0.002, 1);
    pen.globalAlpha = DARKEST * fresh * fresh * (teams.length > MANY ? 0.6 : 1);
    for (const team of [0, 1]) {
      pen.strokeStyle = look.teams[team];
      pen.beginPath();
      for (let i = 0; i < teams.length; i++) {
        if (teams[i] !== team) continue;
        pen.moveTo(from[2 * i] * side, (1 - from[2 * i + 1]) * side);
        pen.lineTo(to[2 * i] * side, (1 - to[2 * i + 1]) * side);
      }
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }
}
