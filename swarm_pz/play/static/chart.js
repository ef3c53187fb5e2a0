// Team sizes over time: red from below, blue from above, each with its team's sign.

import { disc, hatch, look, onLook } from "./ground.js";
import { TICKS } from "./words.js";

const SHORTEST_S = 30;
export const SWING_S = 5;

export class Chart {
  constructor(canvas) {
    this.canvas = canvas;
    this.sizes = [];
    this.marked = null; // a second to point out
    this.span = 0; // seconds from end to end; 0: of the game so far
    this.cursor = null; // the seconds that are shown of a recorded game
    new ResizeObserver(() => this.resize()).observe(canvas);
    onLook(() => this.paint());
  }

  // Sizes of red and blue, one entry a second.
  set(sizes, marked = null, span = 0) {
    this.span = span;
    this.sizes = sizes.map((entry) => [...entry]);
    this.marked = marked;
    this.paint();
  }

  add(tick, red, blue) {
    const second = Math.floor(tick / TICKS);
    if (this.sizes[second]?.[0] === red) return;
    while (this.sizes.length < second) this.sizes.push([...(this.sizes.at(-1) ?? [red, blue])]);
    this.sizes[second] = [red, blue];
    this.paint();
  }

  // Mark the moment of a recorded game that is shown; null removes the mark.
  show(seconds) {
    if (seconds === this.cursor) return;
    this.cursor = seconds;
    this.paint();
  }

  resize() {
    const scale = Math.min(devicePixelRatio, 2);
    const [width, height] = [this.canvas.clientWidth * scale, this.canvas.clientHeight * scale].map(Math.round);
    if (width === this.canvas.width && height === this.canvas.height) return;
    Object.assign(this.canvas, { width, height });
    this.paint();
  }

  paint() {
    const { canvas, sizes } = this, { width, height } = canvas, pen = canvas.getContext("2d");
    pen.fillStyle = look.panel;
    pen.fillRect(0, 0, width, height);
    if (!sizes.length || !width) return;
    const hatches = [0, 1].map((team) => hatch(pen, team, width / (canvas.clientWidth || width)));
    const step = width / (this.span || Math.max(sizes.length, SHORTEST_S)), edge = ([red, blue]) => height * (1 - red / (red + blue || 1));
    [height, 0].forEach((from, team) => {
      pen.fillStyle = hatches[team];
      pen.beginPath();
      sizes.forEach((entry, i) => pen.rect(i * step, Math.min(edge(entry), from), step + 0.5, Math.abs(from - edge(entry))));
      pen.fill();
    });
    const border = sizes.flatMap((entry, i) => [[i * step, edge(entry)], [(i + 1) * step, edge(entry)]]);
    paintLine(pen, border, Math.max(height / 40, 1.5));
    paintLine(pen, [[0, height / 2], [width, height / 2]], 1, [3, 3]);
    if (this.marked !== null) paintMark(pen, Math.min((this.marked + 0.5) * step, width - 0.11 * height), edge(sizes[this.marked]), height);
    if (this.cursor !== null) paintCursor(pen, this.cursor * step, height);
    const [red, blue] = (this.cursor === null ? null : sizes[Math.floor(this.cursor)]) ?? sizes.at(-1);
    canvas.setAttribute("aria-label", `Team sizes over time: now red ${red}, blue ${blue}`);
  }
}

function paintLine(pen, points, width, dash = []) {
  pen.strokeStyle = look.ink;
  pen.lineWidth = width;
  pen.setLineDash(dash);
  pen.beginPath();
  for (const [x, y] of points) pen.lineTo(x, y);
  pen.stroke();
}

function paintCursor(pen, x, height) {
  pen.fillStyle = look.ground;
  pen.fillRect(x - height / 28, 0, height / 14, height);
  pen.fillStyle = look.ink;
  pen.fillRect(x - height / 56, 0, height / 28, height);
}

function paintMark(pen, x, y, height) {
  paintLine(pen, [[x, 0], [x, height]], 1);
  pen.fillStyle = look.ground;
  disc(pen, x, y, 0.11 * height);
  pen.fillStyle = look.ink;
  disc(pen, x, y, 0.07 * height);
}

// Tell if a room's game lasted until its time limit.
export function timeIsUp({ sizes, settings }) { return settings.time_limit !== null && sizes.length > settings.time_limit; }

// Return sizes once a second; a game won before its time limit also gets its final sizes, as its last second is not whole.
export function untilTheEnd(room) {
  const { sizes, outcome } = room;
  if (!sizes.length || !["red", "blue"].includes(outcome) || timeIsUp(room)) return [...sizes];
  const all = sizes[0][0] + sizes[0][1];
  return [...sizes, outcome === "red" ? [all, 0] : [0, all]];
}

// Return the second from which the winner led for good, from sizes of red and blue once a second. If the winner led all
// along, return the second after its greatest gain; null for a draw.
export function turningPoint(sizes) {
  const leads = sizes.map(([red, blue]) => red - blue), sign = Math.sign(leads.at(-1) ?? 0);
  if (sign === 0) return null;
  const behind = leads.findLastIndex((lead) => lead * sign <= 0);
  if (behind > 0) return Math.min(behind + 1, leads.length - 1);
  const gains = leads.map((lead, i) => sign * (lead - leads[Math.max(i - SWING_S, 0)]));
  const best = Math.max(0, ...gains);
  return best > 0 ? gains.indexOf(best) : null;
}
