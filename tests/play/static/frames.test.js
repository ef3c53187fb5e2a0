// Binary messages are read as in Python, and contour lines are in the right place.

import assert from "node:assert/strict";
import { test } from "node:test";

import { bytes, fixtures, plain } from "./page.js";
import { decode, FRAME, TARGET } from "../../../swarm_pz/play/static/frames.js";
import { trace } from "../../../swarm_pz/play/static/ground.js";

const near = (got, wanted) => {
  assert.equal(got.length, wanted.length);
  got.forEach((value, i) => assert.ok(value === wanted[i] || Math.abs(value - wanted[i]) < 1e-6, `${value} is not ${wanted[i]}`));
};

test("a frame says here what it says in Python, with or without altitudes, ground and hidden drones", () => {
  for (const { bytes: base64, positions, velocities, ...rest } of fixtures.frames) {
    const { type, ...frame } = plain(decode(bytes(base64)));
    assert.equal(type, FRAME);
    near(frame.positions, positions);
    near(frame.velocities, velocities);
    assert.deepEqual({ ...frame, ...rest }, frame);
  }
});

test("a target says here what it says in Python", () => {
  for (const { bytes: base64, ...target } of fixtures.targets) {
    assert.deepEqual(plain(decode(bytes(base64))), { type: TARGET, ...target });
  }
});

test("the contour of a cone is a circle, closed and in its place", () => {
  const cells = 40, values = [], pieces = [];
  for (let row = 0; row < cells; row++) {
    for (let column = 0; column < cells; column++) values.push(Math.hypot((column + 0.5) / cells - 0.4, (row + 0.5) / cells - 0.6));
  }
  trace(values, cells, 0.25, (...piece) => pieces.push(piece));
  for (const [x0, y0, x1, y1] of pieces) {
    for (const [x, y] of [[x0, y0], [x1, y1]]) assert.ok(Math.abs(Math.hypot(x - 0.4, y - 0.6) - 0.25) < 2e-3);
  }
  const length = pieces.reduce((sum, [x0, y0, x1, y1]) => sum + Math.hypot(x1 - x0, y1 - y0), 0);
  assert.ok(Math.abs(length - 2 * Math.PI * 0.25) < 0.01 * length);
});

test("contours of a saddle do not cross, and go the other way around for what is left out", () => {
  const count = (values) => {
    const pieces = [];
    trace(values, 2, 0.5, (...piece) => pieces.push(piece));
    return pieces.length;
  };
  assert.deepEqual([count([1, 0, 0, 1]), count([0, 1, 1, 0]), count([1, 1, 1, 0]), count([1, 1, 1, 1])], [2, 2, 1, 0]);
});
