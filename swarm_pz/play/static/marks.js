// Commands that are placed and not drawn: attractors, leaders, a formation.

import { byId } from "./elements.js";
import { Pen, short, within } from "./pen.js";

const GRIP = 0.06; // a tap this close, in map widths, takes hold of an attractor instead of placing one
const OUTLINES = { line: [[-1, 0], [1, 0]], wedge: [[-0.5, 0.87], [1, 0], [-0.5, -0.87]], grid: [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]] };
// Kinds of commands: `read` returns marks, `write` a command; `size` and `turn` are indices among its numbers; a hint.
/** @type {Record<string, any>} */
const KINDS = {
  attractors: {
    read: () => [], write: (marks) => marks.map(({ x, y, size }) => [x, y, size]), size: 2, sized: "Weight",
    hint: "Tap where to go. The slider sets how strongly.",
  },
  leaders: {
    read: (rows) => rows.map(([x, y]) => ({ x, y, size: 0, turn: 0, shape: 0 })), write: (marks) => marks.map(({ x, y }) => [x, y]),
    hint: "Drag a leader: the others follow.",
  },
  formation: {
    read: ([shape, x, y, size, turn]) => [{ shape: Math.floor(shape), x, y, size, turn }], size: 3, turn: 4, sized: "Size",
    write: ([{ shape, x, y, size, turn }], { shapes: names }) => (names.length
      ? { shape: names[shape], centre: [x, y], size, turn } : [shape, x, y, size, turn]),
    hint: "Tap where it stands. The sliders set its size and turn.",
  },
};

export class Marks extends Pen {
  // Take the server's description of a seat's commands.
  equip(commands) {
    this.commands = commands;
    this.spec = KINDS[commands.takes];
    this.hint = this.spec.hint;
    this.held = 0;
    const bounds = (i = 0) => [commands.low, commands.high].map((ends) => (Array.isArray(ends) ? ends.flat(2)[i] : ends));
    this.sizes = bounds(this.spec.size);
    this.turns = bounds(this.spec.turn);
    this.size = this.spec.read(commands.default)[0]?.size ?? (this.sizes[0] + this.sizes[1]) / 2;
    this.forget();
  }

  get kind() { return this.commands.takes; }

  get most() { return this.kind === "formation" ? 1 : this.commands.shape[0]; }

  get mark() { return this.strokes[Math.min(this.held, this.strokes.length - 1)]; }

  // Go back to the initial marks.
  clear() {
    const start = this.spec.read(this.commands.default);
    if (JSON.stringify(start) !== JSON.stringify(this.strokes)) super.recall(start);
  }

  // Reset for another game: a formation begins as a ring, to be placed.
  forget() {
    super.forget();
    const shape = this.commands.shapes.indexOf("ring");
    if (shape >= 0) this.strokes = [{ shape, x: 0.5, y: 0.5, size: this.sizes[1] / 2, turn: 0 }];
    this.refresh();
  }

  messageOf(marks) { return { command: marks.length ? this.spec.write(marks, this.commands) : this.commands.default }; }

  get kept() {
    return this.strokes.map((mark) => Object.fromEntries(Object.entries(mark).map(([name, value]) => [name, short(value)])));
  }

  // Fit saved marks to the number and bounds of this game: they may be from another one.
  recall(marks) {
    const now = this.spec.read(this.commands.default), wanted = now.length ? now.map((mark, i) => marks[i] ?? mark) : marks;
    super.recall(wanted.slice(0, this.most));
    for (const mark of this.strokes) this.limit(mark);
    this.held = 0;
  }

  // Change the mark that is held.
  adjust(act) {
    if (!this.mark) return;
    if (this.sent) this.change(structuredClone(this.strokes));
    act(this.mark);
    this.limit(this.mark);
    this.size = this.mark.size;
    this.refresh();
  }

  shift(dx, dy) { this.adjust((mark) => Object.assign(mark, { x: mark.x + dx, y: mark.y + dy })); }

  get extent() { return this.mark?.size ?? this.size; }

  resize(size) {
    this.size = size;
    this.adjust((mark) => { mark.size = size; });
  }

  limit(mark) {
    const [low, high] = this.turns;
    if (this.spec.size) mark.size = within(mark.size, this.sizes[0], this.sizes[1]);
    if (this.spec.turn) mark.turn = low + ((mark.turn - low) % (high - low) + high - low) % (high - low);
    if (this.commands.shapes.length) mark.shape = within(mark.shape, 0, this.commands.shapes.length - 1);
    Object.assign(mark, { x: within(mark.x, 0, 1), y: within(mark.y, 0, 1) });
  }

  // Turn the mark by a fraction of a full turn.
  turn(part) { if (this.spec.turn) this.adjust((mark) => { mark.turn += part * (this.turns[1] - this.turns[0]); }); }

  turnTo(turn) { this.adjust((mark) => { mark.turn = turn; }); }

  get shape() { return this.commands.shapes[this.mark?.shape]; }

  set shape(name) { this.adjust((mark) => { mark.shape = this.commands.shapes.indexOf(name); }); }

  next() {
    this.held = (this.held + 1) % Math.max(this.strokes.length, 1);
    this.refresh();
  }

  // --- fingers --------------------------------------------------------------------------------------

  begin(event) {
    this.adds = event.shiftKey || byId("keep").checked;
    super.begin(event);
  }

  start(point) {
    const isFirst = this.startDrawing(() => structuredClone(this.strokes));
    if (isFirst) this.hold(point);
    return { isFirst };
  }

  // Take hold of the nearest mark, or make another one.
  hold([x, y]) {
    const far = this.strokes.map((mark) => Math.hypot(mark.x - x, mark.y - y)), nearest = far.indexOf(Math.min(...far));
    const isNew = this.kind === "attractors" && !(far[nearest] < GRIP);
    if (isNew && !this.adds) this.strokes = [];
    if (isNew && this.strokes.length < this.most) this.strokes.push({ x, y, size: this.size, turn: 0, shape: 0 });
    this.held = isNew ? this.strokes.length - 1 : nearest;
    this.adjust((mark) => Object.assign(mark, { x, y }));
  }

  extend({ isFirst }, [x, y]) { if (isFirst) this.adjust((mark) => Object.assign(mark, { x, y })); }

  cancel(event) {
    if (this.down.delete(event.pointerId) && !this.down.size) this.undo();
  }

  // --- keys -----------------------------------------------------------------------------------------

  step(dx, dy) {
    if (!this.mayDraw()) return;
    if (!this.strokes.length) this.hold([0.5, 0.5]);
    this.shift(dx, dy);
  }

  press() { if (this.mayDraw()) this.lifted(); }

  // --- how it looks ---------------------------------------------------------------------------------

  setInForce() {}

  paint() {
    if (!this.dirty) return;
    this.dirty = false;
    byId("marks").innerHTML = this.mayDraw() ? this.strokes.map((mark, i) => this.svgOf(mark, this.strokes.length > 1 ? i + 1 : "")).join("") : "";
    byId("marks").classList.toggle("sent", this.sent);
  }

  // Return a mark as SVG, in hundredths of the map.
  svgOf(mark, name) {
    const { x, y, size, turn, shape } = mark, [least, most] = this.sizes, outline = OUTLINES[this.commands.shapes[shape]];
    const weight = this.spec.size ? 2 + 5 * (size - least) / (most - least || 1) : 3.5, reach = this.spec.turn ? 100 * size : weight;
    const circle = `M${reach} 0A${reach} ${reach} 0 0 0 ${-reach} 0A${reach} ${reach} 0 0 0 ${reach} 0`;
    const path = outline ? `M${outline.map(([u, v]) => `${u * reach} ${-v * reach}`).join("L")}` : circle;
    const angle = this.spec.turn ? -360 * turn / (this.turns[1] - this.turns[0]) : 0, heading = this.spec.turn ? `M${reach} 0L0 0` : "";
    return `<g transform="translate(${100 * x} ${100 * (1 - y)})"${mark === this.mark ? ' class="held"' : ""}>
      <path transform="rotate(${angle})" d="${path}${heading}"/><text x="-3" y="-2">${name}</text></g>`;
  }
}
