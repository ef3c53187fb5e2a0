// The drawing: strokes by finger, pen, mouse or keys. This page paints them at once; only the server turns them into
// commands.

import { byId, putAt } from "./elements.js";
import { drawLine, look, onLook, pattern } from "./ground.js";

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const STEP = 0.02; // of a key, in map widths; five times as much with Shift
const MOST_POINTS = 3000, MOST_STROKES = 250; // in a message
const MOST_BEFORE = 50; // drawings that undo can go back to
const NEAREST = 0.004; // points closer than this, in map widths, are dropped
const FADE_MS = 600; // of ink whose command is in force: the target shows it now
const DRAWN = 0.8, SENT = 0.4; // opacity of ink

export const within = (value, low, high) => Math.min(Math.max(value, low), high);
export const short = (value) => Math.round(value * 1e4) / 1e4;

export class Pen {
  // arena: the element that is drawn in; canvas: shows the ink; lifted: called when the last finger or key is lifted.
  constructor(arena, canvas, { lifted, changed, mayDraw }) {
    this.arena = arena;
    this.canvas = canvas;
    this.lifted = lifted;
    this.changed = changed;
    this.mayDraw = mayDraw;
    this.brush = "attract";
    this.hint = "";
    this.width = 0.1;
    /** @type {any[]} */
    this.strokes = [];
    this.before = []; // drawings to go back to, with `sent`
    this.sent = false; // this drawing was sent, and the next stroke begins another
    this.fadesSince = null; // time at which the sent drawing came into force
    this.down = new Map(); // strokes being drawn, by pointer
    this.cursor = { x: 0.5, y: 0.5, shown: false };
    this.patterns = {}; // by their colours
    onLook(() => { this.dirty = true; });
  }

  // The kind of its saved drawings.
  get kind() { return "strokes"; }

  // Width, size or weight of the next mark.
  get extent() { return this.width; }

  resize(width) {
    this.width = width;
    this.dirty = true;
  }

  // --- fingers --------------------------------------------------------------------------------------

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    const [x, y] = [(event.clientX - box.left) / box.width, 1 - (event.clientY - box.top) / box.height];
    return [within(x, -0.5, 1.5), within(y, -0.5, 1.5)];
  }

  begin(event) {
    if (event.button !== 0 || !this.mayDraw() || event.target.closest("button, a")) return;
    event.preventDefault();
    this.arena.focus({ preventScroll: true });
    this.arena.setPointerCapture(event.pointerId);
    this.cursor.shown = false;
    this.down.set(event.pointerId, this.start(this.place(event)));
  }

  /** @returns {any} the stroke that later points extend */
  start(point) {
    this.startDrawing(() => (this.sent && !byId("keep").checked ? [] : [...this.strokes]));
    const stroke = { brush: this.brush, width: this.width, points: [point] };
    this.strokes.push(stroke);
    this.dirty = true;
    return stroke;
  }

  // Begin another drawing if this is the first finger; return true if it is.
  startDrawing(from) {
    if (this.down.size > 0) return false;
    if (this.sent || !this.drawingSince) this.drawingSince = performance.now();
    this.change(from());
    return true;
  }

  move(event) {
    const stroke = this.down.get(event.pointerId), parts = event.getCoalescedEvents?.() ?? [];
    if (stroke) for (const part of parts.length ? parts : [event]) this.extend(stroke, this.place(part));
  }

  extend(stroke, point) {
    const last = stroke.points.at(-1);
    if (Math.hypot(point[0] - last[0], point[1] - last[1]) < NEAREST) return;
    stroke.points.push(point);
    this.dirty = true;
  }

  end(event) {
    const stroke = this.down.get(event.pointerId);
    if (!stroke) return;
    this.extend(stroke, this.place(event));
    this.down.delete(event.pointerId);
    this.changed();
    if (this.down.size === 0) this.lifted();
  }

  // Drop the stroke of a pointer that the system took away.
  cancel(event) {
    const stroke = this.down.get(event.pointerId);
    this.down.delete(event.pointerId);
    this.strokes = this.strokes.filter((other) => other !== stroke);
    this.refresh();
  }

  // --- keys -----------------------------------------------------------------------------------------

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target !== this.arena || !this.mayDraw()) return;
    const arrow = ARROWS[event.key], step = event.shiftKey ? 5 * STEP : STEP;
    if (arrow) this.step(arrow[0] * step, arrow[1] * step);
    else if (event.key === " ") this.press();
    else return;
    event.preventDefault();
  }

  step(dx, dy) {
    const { cursor } = this, stroke = this.down.get("keys");
    Object.assign(cursor, { x: within(cursor.x + dx, 0, 1), y: within(cursor.y + dy, 0, 1), shown: true });
    if (stroke) this.extend(stroke, [cursor.x, cursor.y]);
    this.dirty = true;
  }

  // Put the brush down, or lift it.
  press() {
    if (this.endKeyStroke()) {
      if (this.down.size === 0) this.lifted();
    } else if (this.mayDraw()) {
      this.cursor.shown = true;
      this.down.set("keys", this.start([this.cursor.x, this.cursor.y]));
    }
  }

  endKeyStroke() {
    if (!this.down.delete("keys")) return false;
    this.refresh();
    return true;
  }

  // Lift and hide the brush: another part of the page is used.
  blur() {
    this.endKeyStroke();
    this.cursor.shown = false;
    this.dirty = true;
  }

  // --- the drawing ------------------------------------------------------------------------------------

  // Replace the drawing; undo leads back to the old one.
  change(strokes) {
    this.before = [...this.before, { strokes: this.strokes, sent: this.sent }].slice(-MOST_BEFORE);
    this.strokes = strokes;
    this.sent = false;
    this.fadesSince = null;
  }

  // Go back by one drawing; return true if the undone one was sent, so that this one has to be sent again.
  undo() {
    this.down.clear();
    const past = this.before.pop(), wasSent = this.sent;
    if (!past) return false;
    this.strokes = past.strokes;
    this.sent = past.sent && !wasSent;
    this.fadesSince = this.sent ? -Infinity : null;
    this.refresh();
    return wasSent;
  }

  // Replace the drawing with a copy of a saved one.
  recall(strokes) {
    this.down.clear();
    this.change(structuredClone(strokes));
    this.refresh();
  }

  // Replace the drawing with an empty one.
  clear() {
    this.down.clear();
    if (this.strokes.length) this.change([]);
    this.refresh();
  }

  // Reset for another game.
  forget() {
    this.clear();
    this.before = [];
    this.sent = false;
  }

  refresh() {
    this.dirty = true;
    this.changed();
  }

  // Return the drawing as a message has it, with the time it took to draw.
  take() {
    this.endKeyStroke();
    return { drawingMs: this.drawingSince ? performance.now() - this.drawingSince : 0, ...this.messageOf(this.kept) };
  }

  /** @returns {any} the part of a message with the strokes */
  messageOf(strokes) { return { strokes }; }

  /** @returns {any[]} the drawing, shortened to be sent or saved */
  get kept() {
    const strokes = this.strokes.slice(-MOST_STROKES);
    const every = Math.ceil(strokes.reduce((sum, { points }) => sum + points.length, 0) / MOST_POINTS);
    const thin = (points) => points.filter((_, i) => i % every === 0 || i === points.length - 1);
    return strokes.map(({ brush, width, points }) => ({ brush, width, points: thin(points).map((point) => point.map(short)) }));
  }

  // Note that the drawing was sent: the next stroke begins another.
  setSent() {
    this.sent = true;
    this.fadesSince = null;
    this.drawingSince = null;
    this.dirty = true;
  }

  // Fade the ink: the swarm follows the drawing.
  setInForce() {
    if (this.sent) this.fadesSince ??= performance.now();
    this.dirty = true;
  }

  // --- how it looks -----------------------------------------------------------------------------------

  get strength() {
    if (!this.sent) return DRAWN;
    const faded = this.fadesSince === null ? 0 : (performance.now() - this.fadesSince) / FADE_MS;
    return SENT * Math.max(1 - faded, 0);
  }

  paint() {
    if (!this.dirty) return;
    const { canvas, strength } = this, side = canvas.width, pen = canvas.getContext("2d");
    this.dirty = this.fadesSince !== null && strength > 0; // goes on fading
    canvas.style.visibility = strength > 0 && this.strokes.length ? "" : "hidden"; // an empty canvas costs as much as a full one
    pen.clearRect(0, 0, side, side);
    for (const { brush, width, points } of strength > 0 ? this.strokes : []) {
      pen.globalCompositeOperation = "destination-out"; // later strokes replace earlier ones
      pen.globalAlpha = 1;
      drawLine(pen, points, width, side, "#000");
      if (brush === "erase") continue;
      pen.globalCompositeOperation = "source-over";
      pen.globalAlpha = strength;
      drawLine(pen, points, width, side, this.patterns[inkOf(brush)] ??= hatched(pen, brush));
    }
    pen.globalCompositeOperation = "source-over";
    pen.globalAlpha = 1;
    this.showCursor();
  }

  // Show the brush that keys move.
  showCursor() {
    const { brush, cursor: { x, y, shown }, down, width } = this, { style } = byId("cursor");
    byId("cursor").hidden = !shown;
    byId("cursor").className = `${brush} ${down.has("keys") ? "down" : ""}`;
    style.width = `${100 * width}%`;
    putAt("cursor", [x, y]);
  }
}

function inkOf(brush) { return { attract: look.asked, repel: look.away }[brush] ?? look.ink; }

// Return a hatching that shows the brush without colours, too.
function hatched(pen, brush) {
  const size = 18, isPlus = brush === "attract";
  return pattern(pen, size, (tile) => {
    tile.fillStyle = tile.strokeStyle = inkOf(brush);
    tile.globalAlpha = 0.25;
    tile.fillRect(0, 0, size, size);
    tile.globalAlpha = 1;
    tile.lineWidth = 2;
    tile.beginPath();
    tile.moveTo(5, 9);
    tile.lineTo(13, 9);
    tile.moveTo(...(isPlus ? [9, 5] : [0, 0]));
    tile.lineTo(...(isPlus ? [9, 13] : [size, 0]));
    tile.stroke();
  });
}
