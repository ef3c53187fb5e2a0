// Trails of the last seconds. They fade, and are always fainter than the drones.

import { look, newCanvas } from "./ground.js";

const EVERY = 6; // ticks of a piece
const MOST_PIECES = 25; // five seconds: older ones are too faint to see
const DARKEST = 0.34, STAYS = 0.87; // opacity of a new piece, and the factor by which each later piece fades it
const MANY = 60; // with more drones, trails are fainter

export class Trails {
  constructor() {
    this.canvas = newCanvas(1);
    this.forget();
  }

  forget() {
    this.last = null; // the frame where the newest piece begins
    this.pieces = []; // pairs of frames, not painted yet
    this.isNew = true;
  }

  take(frame) {
    if (this.last && frame.tick - this.last.tick < EVERY) return;
    if (this.last) this.pieces = [...this.pieces, [this.last, frame]].slice(-MOST_PIECES);
    this.last = frame;
  }

  // Paint trails up to where the drones are shown. Each piece is painted once, and fades the older ones.
  paint(pen, frame, places, side) {
    const { canvas } = this, layer = canvas.getContext("2d");
    if (this.isNew || canvas.width !== side) canvas.width = canvas.height = side; // empties it, too
    this.isNew = false;
    for (const [from, to] of this.pieces) {
      layer.globalCompositeOperation = "destination-out";
      layer.globalAlpha = 1 - STAYS;
      layer.fillRect(0, 0, side, side);
      layer.globalCompositeOperation = "source-over";
      paintPiece(layer, from.positions, to.positions, to.teams, side);
    }
    this.pieces = [];
    pen.drawImage(canvas, 0, 0, side, side);
    if (this.last) paintPiece(pen, this.last.positions, places, frame.teams, side);
  }
}

// Paint one path for all drones of a team: few strokes for any number of drones.
function paintPiece(pen, from, to, teams, side) {
  pen.lineWidth = Math.max(side * 0.002, 1);
  pen.globalAlpha = DARKEST * (teams.length > MANY ? 0.6 : 1);
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
