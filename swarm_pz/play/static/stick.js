// A stick in the corner of the board, which flies drones by their accelerations: all of one's own, or one that was tapped.

import { look } from "./ground.js";
import { Pen } from "./pen.js";

const CENTRE = [0.15, 0.15], REACH = 0.12; // of the stick, in map widths
const NEAR = 0.08; // map widths from a drone within which a tap means it
const EVERY_MS = 250; // between two commands while the stick is moved

export class Stick extends Pen {
  // frame: gives the newest one and one's team.
  constructor(arena, canvas, hand) {
    super(arena, canvas, hand);
    this.frame = hand.frame;
    this.keys = new Set();
    this.hint = "Tap a drone, or none for all. The stick flies them.";
    this.forget();
  }

  equip(commands) { this.commands = commands; }

  get kind() { return "accelerations"; }

  get kept() { return []; } // nothing of it is worth keeping

  forget() {
    this.chosen = null;
    this.vector = [0, 0];
    super.forget();
  }

  say() {
    const { teams, own } = this.frame(), vector = this.vector.map((value) => Math.round(100 * value) / 100);
    return { command: this.commands.default.map((_, i) => (teams?.[i] === own && (this.chosen ?? i) === i ? vector : [0, 0])) };
  }

  clear() { this.steer([0, 0]); }

  start([x, y]) {
    const isSteering = Math.hypot(x - CENTRE[0], y - CENTRE[1]) < 1.4 * REACH;
    if (!isSteering) this.choose(x, y);
    this.extend({ isSteering }, [x, y]);
    return { isSteering };
  }

  extend({ isSteering }, [x, y]) { if (isSteering) this.steer([(x - CENTRE[0]) / REACH, (y - CENTRE[1]) / REACH]); }

  end(event) {
    if (this.down.get(event.pointerId)?.isSteering) this.steer([0, 0]);
    this.down.delete(event.pointerId);
  }

  cancel(event) { this.end(event); }

  // The own drone that is nearest, or all of them.
  choose(x, y) {
    const { teams, positions, own } = this.frame();
    let nearest = NEAR;
    this.chosen = null;
    teams?.forEach((team, i) => {
      const far = Math.hypot(positions[2 * i] - x, positions[2 * i + 1] - y);
      if (team === own && far < nearest) [nearest, this.chosen] = [far, i];
    });
  }

  next() {
    const { teams = [], own } = this.frame();
    this.chosen = [...teams.keys()].find((i) => teams[i] === own && i > (this.chosen ?? -1)) ?? null;
  }

  steer([x, y]) {
    const length = Math.max(Math.hypot(x, y), 1), [u, v] = this.vector;
    this.vector = [x / length, y / length];
    if (u === x / length && v === y / length) return;
    this.sent = false;
    const isEnd = !x && !y, waits = isEnd ? 0 : (this.sentMs ?? 0) + EVERY_MS - performance.now();
    clearTimeout(this.later);
    if (waits <= 0) this.fly();
    else this.later = setTimeout(() => this.fly(), waits);
  }

  fly() {
    this.sentMs = performance.now();
    this.lifted();
  }

  key(event) {
    if (!event.key.startsWith("Arrow") || event.ctrlKey || event.altKey || event.metaKey || event.target !== this.arena || !this.mayDraw()) return;
    event.preventDefault();
    if (event.type === "keydown") this.keys.add(event.key);
    else this.keys.delete(event.key);
    const pressed = (key) => Number(this.keys.has(`Arrow${key}`));
    if (!event.repeat) this.steer([pressed("Right") - pressed("Left"), pressed("Up") - pressed("Down")]);
  }

  keyUp(event) { this.key(event); }

  blur() {
    this.keys.clear();
    if (this.vector.some(Boolean)) this.steer([0, 0]);
  }

  setInForce() {}

  // Painted anew with each picture, since what is chosen moves.
  paint() {
    const side = this.canvas.width, pen = this.canvas.getContext("2d"), { teams, positions, own } = this.frame(), [u, v] = this.vector;
    pen.clearRect(0, 0, side, side);
    if (!this.mayDraw()) return;
    if (this.chosen !== null && teams?.[this.chosen] !== own) this.chosen = null; // it was captured
    const circle = (x, y, radius, width, fill = "transparent") => {
      pen.beginPath();
      pen.arc(x * side, (1 - y) * side, radius * side, 0, 7);
      pen.fillStyle = fill;
      pen.strokeStyle = look.asked;
      pen.lineWidth = width;
      pen.fill();
      pen.stroke();
    };
    circle(CENTRE[0], CENTRE[1], REACH, 3, `${look.ground}b3`);
    circle(CENTRE[0] + REACH * u, CENTRE[1] + REACH * v, 0.05, 3, `${look.asked}99`);
    if (this.chosen !== null) circle(positions[2 * this.chosen], positions[2 * this.chosen + 1], 0.035, 4);
  }
}
