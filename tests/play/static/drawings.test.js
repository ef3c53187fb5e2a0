// The library of drawings that a browser keeps.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, reload } from "./page.js";
import { Library } from "../../../swarm_pz/play/static/library.js";

const STORE = "swarm-pz.drawings";
const STROKE = { brush: "attract", width: 0.1, points: [[0.5, 0.5]] };
let told, sent, current;

function open() {
  [told, sent] = [[], []];
  current = { kind: "strokes", kept: [STROKE] };
  return new Library({ current: () => current, send: (one) => sent.push(one.name), tell: (text) => told.push(text) });
}

beforeEach(() => {
  reload();
  localStorage.removeItem(STORE);
});

test("what is saved is kept, listed, and sent again at a tap or by its digit", () => {
  const library = open();
  current.kept = [];
  library.save();
  current.kept = [STROKE];
  at("save").click();
  library.save();
  assert.deepEqual(told, ["Draw something first", "Saved as 1", "Saved as 2"]);
  assert.deepEqual(open().own.map(({ name }) => name), ["Drawing 1", "Drawing 2"], "by the next page, too");
  const again = open();
  again.open(true);
  at("saved").all("button")[0].click();
  again.recall(1);
  again.recall(3);
  assert.deepEqual([sent, told], [["Drawing 1", "Drawing 2"], ["Nothing is saved as 4"]]);
});
