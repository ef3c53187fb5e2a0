// The library of drawings that a browser keeps.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, fixtures, reload } from "./page.js";
import { checked, Library } from "../../../swarm_pz/play/static/library.js";

const STORE = "swarm-pz.drawings";
const stroke = (has = {}) => ({ brush: "attract", width: 0.1, points: [[0.5, 0.5]], ...has });
const drawing = (name = "Line", has = {}, kind = "strokes") => ({ name, kind, strokes: [stroke(has)] });
const kept = () => JSON.parse(localStorage.getItem(STORE));
let told, sent, current;

function open() {
  [told, sent] = [[], []];
  current = { kind: "strokes", kept: [stroke()] };
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
  current.kept = [stroke()];
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

const NO_DRAWINGS = [
  null, 3, "drawing", [],
  drawing("wide", { width: 7 }), drawing("brush", { brush: "constructor" }), drawing("none", { points: [] }), drawing("far", { points: [[0.5, 1e9]] }),
  drawing("text", { points: [[0.5, "0.5"]] }), drawing("many", { points: Array(4001).fill([0.5, 0.5]) }), drawing("kind", {}, {}),
  drawing("other", {}, "leaders"), drawing("object", { brush: { toString: 1 } }), drawing("list", { brush: ["attract"] }),
  { name: "None", kind: "strokes", strokes: [] }, { name: "Null", kind: "strokes", strokes: [null] }, { kind: "strokes", strokes: 3 },
  { name: "NaN", kind: "formation", strokes: [{ x: null, y: 0.5, size: 0, turn: 0, shape: 0 }] },
  { name: "Many", kind: "strokes", strokes: Array(251).fill(stroke()) },
];

test("of what the browser kept, only drawings are taken, as many as there is room for, and only what is known", () => {
  for (const thing of NO_DRAWINGS) assert.deepEqual(checked([thing]), [], JSON.stringify(thing)?.slice(0, 80));
  const entries = Array.from({ length: 12 }, (_, i) => drawing(`${"n".repeat(60)}${i}`, { more: "x" }));
  entries[0].name = { toString: 1 };
  const [first, ...others] = checked(entries);
  assert.deepEqual([first.name, others.length, Object.keys(first.strokes[0])], ["Drawing", 8, ["brush", "width", "points"]]);
  assert.ok(others.every(({ name }) => name.length === 40));
});

test("the widest and the narrowest brush that the server takes are drawings, and none beyond them", () => {
  const [narrowest, widest] = fixtures.widths;
  assert.equal(checked([drawing("a", { width: narrowest }), drawing("b", { width: widest })]).length, 2);
  assert.equal(checked([drawing("a", { width: narrowest - 0.01 }), drawing("b", { width: widest + 0.01 })]).length, 0);
});

test("a broken store is an empty library", () => {
  for (const broken of ["{", "3", "[[]]", '{"length": 1e9}', '[{"kind": "strokes", "strokes": 3}]']) {
    localStorage.setItem(STORE, broken);
    const library = open();
    assert.deepEqual(library.own, []);
    library.save();
    assert.equal(told[0], "Saved as 1");
  }
});
