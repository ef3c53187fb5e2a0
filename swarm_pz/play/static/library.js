// The library: drawings, and other commands, that this browser keeps; sent again at a tap or by a digit.

import { button, byId, make, on } from "./elements.js";
import { drawLine, look, onLook } from "./ground.js";
import { keep, recall } from "./store.js";

const STORE = "drawings";
const MOST = 9; // of a kind: as many as there are digits
const BRUSHES = { attract: "asked", repel: "away", erase: "ground" }; // and the colour of each
const SIZE = 72; // pixels a side of a picture

export class Library {
  // current: what is drawn now, and its kind; send: sends a saved drawing; tell: says what was done.
  constructor({ current, send, tell }) {
    this.current = current;
    this.send = send;
    this.tell = tell;
    this.all = recall(STORE) ?? [];
    on("click", { save: () => this.save(), shelf: () => this.open(byId("library").hidden) });
    onLook(() => this.show());
  }

  // Those of the kind of commands that one gives now, by their digits.
  get own() { return this.all.filter(({ kind }) => kind === this.current().kind); }

  open(isOpen) {
    byId("library").hidden = !isOpen;
    byId("shelf").setAttribute("aria-expanded", isOpen);
    this.show();
  }

  recall(i) {
    if (this.own[i]) this.send(this.own[i]);
    else this.tell(`Nothing is saved as ${i + 1}`);
  }

  save() {
    const { kind, kept: strokes } = this.current(), number = this.own.length + 1;
    if (!strokes.length) return this.tell("Draw something first");
    if (number > MOST) return this.tell(`${MOST} are saved: delete one first`);
    this.open(true);
    const isKept = this.take([...this.all, { name: `Drawing ${number}`, kind, strokes }]);
    this.tell(`Saved as ${number}${isKept ? "" : ", until this page closes: the browser keeps no more"}`);
  }

  // Go over to other drawings; tell whether the browser keeps them.
  take(all) {
    this.show(all);
    return keep(STORE, all);
  }

  show(all = this.all) {
    this.all = all;
    const { own } = this;
    byId("saved").replaceChildren(...own.map((drawing, i) => make("li", {}, button(
      [picture(drawing), i + 1], () => this.send(drawing), { title: drawing.name, "aria-label": `${i + 1}: ${drawing.name}` },
    ))));
    byId("none-saved").hidden = own.length;
    byId("drawings").replaceChildren(...own.map((drawing) => this.line(drawing)));
  }

  // A drawing that can be named or deleted.
  line(drawing) {
    const { name } = drawing, change = (...now) => this.take(this.all.flatMap((other) => (other === drawing ? now : other)));
    return make(
      "li", {}, picture(drawing),
      make("input", { value: name, maxLength: 40, "aria-label": "Name", onchange: ({ target }) => change({ ...drawing, name: target.value.trim() || name }) }),
      button("Delete", () => { change(); byId("close-tools").focus(); }, { "aria-label": `Delete ${name}` }),
    );
  }
}

function picture({ strokes }) {
  const canvas = make("canvas", { width: SIZE, height: SIZE, "aria-hidden": true }), pen = canvas.getContext("2d");
  for (const { brush = "attract", width = 0.15, points, x, y } of strokes) drawLine(pen, points ?? [[x, y]], width, SIZE, look[BRUSHES[brush]]);
  return canvas;
}
