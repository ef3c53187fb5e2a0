// The library of drawings that a browser keeps.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, reload } from "./page.js";
import { Library } from "../../../swarm_pz/play/static/library.js";

const STORE = "swarm-pz.drawings";
const STROKE = { brush: "attract", width: 0.1, points: [[0.5, 0.5]] };
let texts, sent, current;

function open() {
  [texts, sent] = [[], []];
  current = { kind: "strokes", kept: [STROKE] };
  return new Library({ current: () => current, send: (one, number) => sent.push(number), tell: (text) => texts.push(text) });
}

beforeEach(() => {
  reload();
  localStorage.removeItem(STORE);
});

test("what is saved is kept, listed, sent again at a tap or by its digit, and deleted after that", () => {
  const library = open(), other = { ...STROKE, width: 0.2 };
  current.kept = [];
  library.save();
  current.kept = [STROKE];
  at("save").click();
  current.kept = [other];
  library.save();
  assert.deepEqual(texts, ["Draw something first", "Saved as 1", "Saved as 2"]);
  const again = open(), widths = () => open().own.map(({ strokes: [{ width }] }) => width);
  assert.deepEqual(widths(), [0.1, 0.2], "the next page has them, too");
  again.open(true);
  again.recall(1);
  at("saved").all("button")[0].click();
  again.recall(3);
  assert.deepEqual([sent, texts], [[2, 1], ["Nothing is saved as 4"]]);
  again.delete();
  assert.deepEqual([widths(), at("delete").disabled], [[0.2], true]);
});
