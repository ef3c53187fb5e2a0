// The commands of a seat: its tools, and how commands are made, sent and followed.

import { button, byId, hear, on } from "./elements.js";
import { Library } from "./library.js";
import { Pen } from "./pen.js";
import { isStudy, SIDES } from "./words.js";

const BRUSHES = ["attract", "repel", "erase"];
const DRAWN = ["density", "attraction"], PLACED = ["attractors", "leaders", "formation"]; // kinds of commands
const HANDLERS = {
  pointerdown: "begin", pointermove: "move", pointerup: "end", pointercancel: "cancel", keydown: "key", blur: "blur",
};
const TURN = 1 / 24; // of a full turn, by a key

export class Controls {
  // mayPlay tells if a command counts now, answer shows a text, send sends a command, sent is called with its strokes.
  constructor(link, { mayPlay, answer, send, sent }) {
    this.link = link;
    this.pass = send;
    this.mayPlay = () => mayPlay() && this.isEquipped;
    this.answer = answer;
    this.sent = sent;
    /** @type {any} */
    this.callbacks = { lifted: () => this.lifted(), changed: () => this.show(), mayDraw: this.mayPlay };
    /** @type {any} */
    this.pen = this.brush = new Pen(byId("arena"), byId("ink"), this.callbacks);
    this.isEquipped = false;
    this.library = new Library({ current: () => this.pen, send: (drawing, number) => this.recall(drawing, number), tell: answer });
    this.forget();
    this.listen();
    this.setExtent();
  }

  listen() {
    for (const [type, act] of Object.entries(HANDLERS)) on(type, { arena: (event) => this.pen[act](event) });
    on("input", { width: () => this.setExtent(), turn: () => this.pen.turnTo(byId("turn").valueAsNumber) });
    const sized = () => { if (this.pen !== this.brush) this.lifted(); };
    on("change", { width: sized, turn: sized, "on-lift": () => this.show() });
    on("click", Object.fromEntries(BRUSHES.map((brush) => [brush, () => this.choose(brush)])));
    on("click", {
      send: () => this.send(), undo: () => this.undo(), clear: () => this.clear(), spread: () => this.spread(),
    });
    hear(this.link, { target: (target) => this.check(target), in_force: (command) => this.setInForce(command) });
  }

  // Reset for another game.
  forget() {
    this.pen.forget();
    this.number = this.inForce = 0; // numbers of the latest own command, and of the latest in force
  }

  // --- tools ------------------------------------------------------------------------------------------

  // Show the tools for the commands of a seat. Code for commands that are not drawn is fetched when needed.
  async equip(seat, commands) {
    const { takes, serves_densities: isServed } = commands, kind = PLACED.includes(takes) ? takes : "strokes";
    this.seat = seat;
    this.isEquipped = false;
    this.pen.forget();
    byId("marks").replaceChildren();
    if (kind === "strokes") this.pen = this.brush;
    else {
      const { Marks } = await import("./marks.js");
      this.pen = new Marks(byId("arena"), byId("ink"), this.callbacks);
      this.pen.equip(commands);
    }
    this.isEquipped = kind !== "strokes" || DRAWN.includes(takes) || isServed;
    byId("hint").textContent = this.isEquipped ? this.pen.hint : `This page cannot give ${takes}. Programs can.`;
    this.showTools(kind, commands);
    this.library.show();
    this.show();
  }

  // Show the tools of a kind of commands.
  showTools(kind, { shapes }) {
    const isDrawn = kind === "strokes" && this.isEquipped;
    const sized = isDrawn ? "Width" : this.pen.spec?.sized, [min, max] = this.pen.sizes ?? [0.05, 0.3];
    for (const [id, isShown] of Object.entries({
      brushes: isDrawn, placing: !isDrawn, shapes: shapes.length, sized, turned: this.pen.spec?.turn,
      send: this.isEquipped, lifting: this.isEquipped, adding: isDrawn || kind === "attractors", cursor: false,
    })) byId(id).hidden = !isShown;
    byId("size-of").textContent = sized ?? "";
    Object.assign(byId("width"), { min, max, step: (max - min) / 25, value: this.pen.extent });
    [byId("turn").min, byId("turn").max] = this.pen.turns ?? [0, 1];
    byId("spread").textContent = isDrawn ? "Spread out" : "Reset";
    byId("shapes").replaceChildren(...shapes.map((shape) => button(shape, () => {
      this.pen.shape = shape;
      this.lifted();
    })));
  }

  show() {
    byId("send").disabled = byId("clear").disabled = byId("spread").disabled = !this.mayPlay();
    byId("send").classList.toggle("primary", !byId("on-lift").checked);
    byId("undo").disabled = !this.mayPlay() || this.pen.before.length === 0;
    byId("width").value = this.pen.extent;
    byId("turn").value = this.pen.mark?.turn;
    for (const shape of byId("shapes").children) shape.setAttribute("aria-pressed", shape.textContent === this.pen.shape);
  }

  choose(brush) {
    this.brush.brush = brush;
    this.brush.dirty = true;
    for (const other of BRUSHES) byId(other).setAttribute("aria-pressed", String(other === brush));
  }

  setExtent() {
    this.pen.resize(Number(byId("width").value));
    byId("width").setAttribute("aria-valuetext", `${Math.round(100 * this.pen.extent)} percent of the map`);
  }

  wider(steps) {
    const { value, step } = byId("width");
    byId("width").value = Number(value) + steps * step;
    this.setExtent();
  }

  // Return the action of a key, or null; on a button, Enter belongs to the button.
  actOf(key, onButton) {
    if (isStudy() && /^[1-9rs]$/.test(key)) return null;
    if (/^[1-9]$/.test(key)) return () => this.library.recall(Number(key) - 1);
    const acts = {
      g: () => this.choose("attract"), k: () => this.choose("repel"), e: () => this.choose("erase"),
      "+": () => this.wider(2), "=": () => this.wider(2), "-": () => this.wider(-2),
      "[": () => this.pen.turn?.(TURN), "]": () => this.pen.turn?.(-TURN), n: () => this.pen.next?.(),
      s: () => this.library.save(), u: () => this.undo(), c: () => this.spread(), enter: onButton ? null : () => this.send(),
      delete: () => this.clear(), backspace: () => this.clear(),
    };
    return acts[key] ?? null;
  }

  // --- sending ----------------------------------------------------------------------------------------

  lifted() { if (byId("on-lift").checked) this.send(); }

  // Send the drawing, unless it was sent already; return true if it was sent now.
  send() {
    if (!this.mayPlay() || this.pen.sent) return false;
    const input = performance.now(), { drawingMs, ...command } = this.pen.take();
    const isSent = this.pass({
      type: "command", number: this.number + 1, ...command,
      timing: {
        input_ms: input, sent_ms: performance.now(), offset_ms: this.link.offsetMs,
        round_trip_ms: this.link.roundTripMs, drawing_ms: drawingMs,
      },
    });
    if (isSent) {
      this.number += 1;
      this.pen.setSent();
      this.sent(command.strokes ?? []);
    }
    this.show();
    return isSent;
  }

  recall({ strokes }, number) {
    if (!this.mayPlay()) return;
    this.pen.recall(strokes);
    if (this.send()) this.answer(`Sent: ${number}`);
  }

  // Empty the drawing; the swarm keeps its command.
  clear() {
    if (!this.mayPlay() || this.pen !== this.brush) return; // placed commands are never empty
    this.pen.clear();
    this.answer("Cleared: nothing was sent");
  }

  // Send an empty drawing, which asks for the whole square, or the initial command of another kind.
  spread() {
    if (!this.mayPlay()) return;
    this.pen.clear();
    if (this.send()) this.answer(`Sent: ${byId("spread").textContent.toLowerCase()}`);
  }

  // Go back by one drawing. If the last one was sent, the one before is sent as a new command.
  undo() {
    if (!this.mayPlay() || !this.pen.undo() || !this.send()) return;
    this.answer(this.pen.strokes.length ? "Undone: the drawing before was sent" : "Undone: spread out was sent");
  }

  // Count on from the number of the latest command: after a reload the page does not know it.
  check(target) {
    if (target.team !== this.seat) return;
    this.number = Math.max(this.number, target.number);
  }

  setInForce(command) {
    if (command.sender && command.number <= this.inForce) return; // only the helper's part has changed
    this.inForce = command.number;
    if (SIDES.indexOf(command.seat) === this.seat && command.number >= this.number) this.pen.setInForce();
  }
}
