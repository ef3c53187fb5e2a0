// The engine in the page, held to games of the simulator that tests/play/test_engine.py makes.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";

import { compare, compareDrawings } from "./engine_cases.js";

const FOLDER = process.env.SWARM_PZ_FIXTURES, ZOO = new URL("../../../policies/zoo/", import.meta.url);
const bytes = (file) => Uint8Array.from(readFileSync(file)).buffer;
const weights = async (name) => bytes(new URL(`${name}/policy.safetensors`, ZOO));
const cases = JSON.parse(readFileSync(`${FOLDER}/cases.json`, "utf8"));

function holds(t, found) {
  t.diagnostic(JSON.stringify(found));
  assert.deepEqual(found.faults, []);
}

for (const name of readdirSync(FOLDER).filter((one) => one.endsWith(".game"))) {
  test(`${name} goes on from each tick as in the simulator`, async (t) => holds(t, await compare(bytes(`${FOLDER}/${name}`), cases, weights)));
}

test("drawings ask for what they ask for in Python, and targets are shown alike", (t) => holds(t, compareDrawings(cases)));
