// The drawing: strokes by finger, pen, mouse or keys, painted at once in this page alone.
// What a stroke asks for is decided by the server; nothing here knows.

const HATCH = { attract: ["#0b6e4f", "+"], repel: ["#7a4a00", "-"] };
const CURSOR_STEP = 0.02;
const MOST_POINTS = 3000, MOST_STROKES = 250; // of what is sent
const NEAREST = 0.004; // points closer than this, in map widths, say nothing new
const FADE_MS = 600; // of ink whose command is in force: from then on the target shows what is asked for
const DRAWN = 0.8, SENT = 0.4; // how strong ink is

export class Pen {
  // arena: the element that is drawn in; canvas: where the ink goes; lifted: called when the last finger, or key, is.
  constructor(arena, canvas, { lifted, changed, mayDraw }) {
    Object.assign(this, { arena, canvas, lifted, changed, mayDraw });
    this.brush = "attract";
    this.width = 0.1;
    this.strokes = [];
    this.before = []; // drawings to go back to, and whether they were sent
    this.sent = false; // what is here was sent, and the next stroke begins anew
    this.fadesSince = null; // when what was sent came into force
    this.keep = false;
    this.down = new Map(); // strokes being drawn, by pointer
    this.cursor = { x: 0.5, y: 0.5, shown: false };
    this.patterns = {};
  }

  keyUp() {}

  // What its drawings are kept as.
  get kind() { return "strokes"; }

  // Another part of the page is used.
  blur() {
    this.endKeyStroke();
    this.cursor.shown = false;
    this.dirty = true;
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    const limit = (value) => Math.min(Math.max(value, -0.5), 1.5);
    return [limit((event.clientX - box.left) / box.width), limit(1 - (event.clientY - box.top) / box.height)];
  }

  begin(event) {
    if (event.button !== 0 || !this.mayDraw() || event.target.closest("button, a")) return;
    event.preventDefault();
    this.arena.focus({ preventScroll: true });
    this.arena.setPointerCapture(event.pointerId);
    this.cursor.shown = false;
    this.down.set(event.pointerId, this.start(this.place(event), performance.now()));
  }

  start(point, startedMs) {
    if (this.down.size === 0) {
      if (this.sent || !this.drawingSince) this.drawingSince = startedMs;
      this.change(this.sent && !this.keep ? [] : [...this.strokes]);
    }
    const stroke = { brush: this.brush, width: this.width, points: [point] };
    this.strokes.push(stroke);
    this.dirty = true;
    return stroke;
  }

  // Go over to another drawing, from which undo leads back.
  change(strokes) {
    this.before.push({ strokes: this.strokes, sent: this.sent });
    if (this.before.length > 50) this.before.shift();
    this.strokes = strokes;
    this.sent = false;
    this.fadesSince = null;
  }

  move(event) {
    const stroke = this.down.get(event.pointerId);
    if (!stroke) return;
    const parts = event.getCoalescedEvents?.() ?? [];
    for (const part of parts.length ? parts : [event]) this.extend(stroke, this.place(part));
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

  // The system took the pointer away: what it drew was not meant.
  cancel(event) {
    const stroke = this.down.get(event.pointerId);
    this.down.delete(event.pointerId);
    this.strokes = this.strokes.filter((other) => other !== stroke);
    this.refresh();
  }

  // --- keys -----------------------------------------------------------------------------------------

  key(event) {
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    if (event.ctrlKey || event.altKey || event.metaKey || event.target !== this.arena) return;
    if (moves[event.key]) {
      const [dx, dy] = moves[event.key], step = event.shiftKey ? 5 * CURSOR_STEP : CURSOR_STEP;
      const limit = (value) => Math.min(Math.max(value, 0), 1);
      Object.assign(this.cursor, { x: limit(this.cursor.x + dx * step), y: limit(this.cursor.y + dy * step), shown: true });
      const stroke = this.down.get("keys");
      if (stroke) this.extend(stroke, [this.cursor.x, this.cursor.y]);
      this.dirty = true;
    } else if (event.key === " ") {
      if (this.down.has("keys")) {
        this.endKeyStroke();
        if (this.down.size === 0) this.lifted();
      } else if (this.mayDraw()) {
        this.cursor.shown = true;
        this.down.set("keys", this.start([this.cursor.x, this.cursor.y], performance.now()));
      }
    } else return;
    event.preventDefault();
  }

  endKeyStroke() {
    if (this.down.delete("keys")) {
      this.dirty = true;
      this.changed();
    }
  }

  // --- the drawing ------------------------------------------------------------------------------------

  // Go back a stroke; whether what is undone was sent, so that what is here now has to be sent anew.
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

  // Go over to a drawing that was made before.
  recall(strokes) {
    this.down.clear();
    this.change(structuredClone(strokes));
    this.refresh();
  }

  // A drawing of nothing.
  clear() {
    this.down.clear();
    if (this.strokes.length) this.change([]);
    this.refresh();
  }

  // Begin with another game.
  forget() {
    this.clear();
    this.before = [];
    this.sent = false;
  }

  refresh() {
    this.dirty = true;
    this.changed();
  }

  // Take the drawing for sending: what the protocol has for it, and for how long it was drawn.
  take() {
    this.endKeyStroke();
    return { drawingMs: this.drawingSince ? performance.now() - this.drawingSince : 0, ...this.say(this.kept) };
  }

  // What asks for strokes in a message.
  say(strokes) { return { strokes }; }

  // The drawing, as short as it is sent and kept.
  get kept() {
    const short = (value) => Math.round(value * 1e4) / 1e4;
    const strokes = this.strokes.slice(-MOST_STROKES);
    const every = Math.ceil(strokes.reduce((sum, { points }) => sum + points.length, 0) / MOST_POINTS);
    const thin = (points) => points.filter((_, i) => i % every === 0 || i === points.length - 1);
    return strokes.map(({ brush, width, points }) => ({
      brush, width, points: thin(points).map(([x, y]) => [short(x), short(y)]),
    }));
  }

  // It was sent: the next stroke begins another drawing.
  setSent() {
    this.sent = true;
    this.fadesSince = null;
    this.drawingSince = null;
    this.dirty = true;
  }

  // The swarm follows it: the ink goes.
  setInForce() {
    if (this.sent) this.fadesSince ??= performance.now();
    this.dirty = true;
  }

  get strength() {
    if (!this.sent) return DRAWN;
    const faded = this.fadesSince === null ? 0 : (performance.now() - this.fadesSince) / FADE_MS;
    return SENT * Math.max(1 - faded, 0);
  }

  paint() {
    if (!this.dirty) return;
    const { canvas, strength } = this, side = canvas.width, pen = canvas.getContext("2d");
    this.dirty = this.fadesSince !== null && strength > 0; // goes on fading
    pen.clearRect(0, 0, side, side);
    pen.lineCap = pen.lineJoin = "round";
    for (const { brush, width, points } of strength > 0 ? this.strokes : []) {
      pen.globalCompositeOperation = "destination-out"; // later strokes replace earlier ones
      pen.globalAlpha = 1;
      this.line(pen, points, width * side, side, "#000");
      if (brush === "erase") continue;
      pen.globalCompositeOperation = "source-over";
      pen.globalAlpha = strength;
      this.line(pen, points, width * side, side, this.pattern(pen, brush));
    }
    pen.globalCompositeOperation = "source-over";
    pen.globalAlpha = 1;
    if (this.cursor.shown) this.paintCursor(pen, side);
  }

  line(pen, points, width, side, style) {
    pen.strokeStyle = style;
    pen.lineWidth = width;
    pen.beginPath();
    const [first] = points;
    pen.moveTo(first[0] * side, (1 - first[1]) * side);
    for (const [x, y] of points) pen.lineTo(x * side, (1 - y) * side);
    pen.stroke();
  }

  paintCursor(pen, side) {
    const x = this.cursor.x * side, y = (1 - this.cursor.y) * side, radius = this.width / 2 * side;
    for (const [style, width] of [["#fff", 5], [HATCH[this.brush]?.[0] ?? "#333", 2]]) {
      pen.strokeStyle = style;
      pen.lineWidth = width;
      pen.setLineDash(this.down.has("keys") ? [] : [6, 4]);
      pen.beginPath();
      pen.arc(x, y, radius, 0, 7);
      pen.moveTo(x - 6, y);
      pen.lineTo(x + 6, y);
      pen.moveTo(x, y - 6);
      pen.lineTo(x, y + 6);
      pen.stroke();
    }
    pen.setLineDash([]);
  }

  // Told apart by sign and direction of hatching, not by colour alone.
  pattern(pen, brush) {
    const size = 18, [colour, sign] = HATCH[brush];
    if (!this.patterns[brush]) {
      const tile = document.createElement("canvas");
      tile.width = tile.height = size;
      const draw = tile.getContext("2d");
      draw.fillStyle = colour;
      draw.globalAlpha = 0.25;
      draw.fillRect(0, 0, size, size);
      draw.globalAlpha = 1;
      draw.strokeStyle = colour;
      draw.lineWidth = 2;
      draw.beginPath();
      draw.moveTo(5, 9);
      draw.lineTo(13, 9);
      if (sign === "+") {
        draw.moveTo(9, 5);
        draw.lineTo(9, 13);
      } else {
        draw.moveTo(0, 0);
        draw.lineTo(size, 0);
      }
      draw.stroke();
      this.patterns[brush] = pen.createPattern(tile, "repeat");
    }
    return this.patterns[brush];
  }
}
