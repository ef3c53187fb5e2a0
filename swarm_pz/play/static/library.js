// The library: drawings, and other commands, that this browser stores. A tap or a digit key sends one again.

import { button, byId, make, on } from "./elements.js";
import { drawLine, look, onLook } from "./ground.js";
import { keep, recall } from "./store.js";

const STORE = "drawings";
const MOST = 9; // of a kind: as many as there are digits
const BRUSHES = { attract: "asked", repel: "away", erase: "ground" }; // and the colour of each
const SIZE = 72; // pixels a side of a picture

export class Library {
  // current: returns the pen; send: sends a saved drawing; tell: says what was done.
  constructor({ current, send, tell }) {
    this.current = current;
    this.send = send;
    this.tell = tell;
    this.all = recall(STORE) ?? [];
    on("click", { save: () => this.save(), delete: () => this.delete(), shelf: () => this.open(byId("library").hidden) });
    onLook(() => this.show());
  }

  // The saved drawings of the present kind of commands, in the order of their digits.
  get own() { return this.all.filter(({ kind }) => kind === this.current().kind); }

  open(isOpen) {
    byId("library").hidden = !isOpen;
    byId("shelf").setAttribute("aria-expanded", isOpen);
    this.show();
  }

  recall(i) {
    const drawing = this.own[i];
    if (!drawing) return this.tell(`Nothing is saved as ${i + 1}`);
    this.send(drawing, i + 1);
    this.choose(drawing);
  }

  save() {
    const { kind, kept: strokes } = this.current(), number = this.own.length + 1, drawing = { kind, strokes };
    if (!strokes.length) return this.tell("Draw something first");
    if (number > MOST) return this.tell(`${MOST} are saved: delete one first`);
    this.open(true);
    const isKept = this.take([...this.all, drawing]);
    this.choose(drawing);
    this.tell(`Saved as ${number}${isKept ? "" : ", until this page closes: the browser keeps no more"}`);
  }

  // Choose the drawing that *Delete* deletes: the one that was sent or saved last.
  choose(drawing) {
    this.chosen = drawing;
    byId("delete").disabled = !drawing;
  }

  delete() {
    this.tell(`Deleted: ${this.own.indexOf(this.chosen) + 1}`);
    this.take(this.all.filter((drawing) => drawing !== this.chosen));
    this.choose(null);
  }

  // Replace the saved drawings; return true if the browser stored them.
  take(all) {
    this.all = all;
    this.show();
    return keep(STORE, all);
  }

  show() {
    const { own } = this;
    byId("saved").replaceChildren(...own.map((drawing, i) => (
      make("li", {}, button([picture(drawing), i + 1], () => this.recall(i), { "aria-label": `Drawing ${i + 1}` })))));
    byId("none-saved").hidden = own.length;
    if (!own.includes(this.chosen)) this.choose(null);
  }
}

function picture({ strokes }) {
  const canvas = make("canvas", { width: SIZE, height: SIZE, "aria-hidden": true }), pen = canvas.getContext("2d");
  for (const { brush = "attract", width = 0.15, points, x, y } of strokes) drawLine(pen, points ?? [[x, y]], width, SIZE, look[BRUSHES[brush]]);
  return canvas;
}
