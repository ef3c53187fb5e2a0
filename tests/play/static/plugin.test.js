// The plug-in for jsPsych: which game it asks for, which messages it hears, and what a trial's row says.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { runInNewContext } from "node:vm";

import { plain, settled } from "./page.js";

const CODE = readFileSync(new URL("../../../swarm_pz/play/static/jspsych-plugin-swarm-pz.js", import.meta.url), "utf8");
const ORIGIN = "http://table", OVER = { type: "swarm-pz.over", row: { outcome: "win", recording: "a.jsonl", lines: "{}" } };

// Begin a trial on an experiment's page, and return what it does and ways to answer it.
function begin(patch = {}) {
  const posts = [], rows = [], timers = [], listeners = new Set();
  const frame = { style: {}, remove() {}, focus() {}, contentWindow: { postMessage: (message) => posts.push(plain(message)) } };
  const page = {
    URL, location: { href: "http://lab/study/index.html", origin: "http://lab" }, jsPsychModule: { ParameterType: {} },
    document: { currentScript: { src: `${ORIGIN}/game/static/jspsych-plugin-swarm-pz.js` }, createElement: () => frame },
    addEventListener: (_, act) => listeners.add(act), removeEventListener: (_, act) => listeners.delete(act),
    setTimeout: (act) => timers.push(act), clearTimeout() {},
  };
  runInNewContext(CODE, page);
  const Plugin = page.jsPsychSwarmPz, defaults = Object.entries(Plugin.info.parameters).map(([name, { default: value }]) => [name, value]);
  const jsPsych = { finishTrial: (row) => rows.push(plain(row)), pluginAPI: { setTimeout: (act) => act() } };
  new Plugin(jsPsych).trial({ replaceChildren() {} }, { ...Object.fromEntries(defaults), ...patch });
  const hear = (data, { source = frame.contentWindow, origin = ORIGIN } = {}) => { for (const act of [...listeners]) act({ source, origin, data }); };
  return { posts, rows, hear, address: frame.src, expire: () => timers.forEach((act) => act()), listeners };
}

test("a trial asks for its game once the page is ready, and hears that page alone", async () => {
  const { posts, rows, hear, address, listeners } = begin({ opponent: "ring", seat: "blue", seed: 41, settings: { speed: 2 } });
  assert.equal(address, "http://table/#embed=http%3A%2F%2Flab");
  hear({ type: "swarm-pz.ready" });
  assert.deepEqual(posts, [{ type: "swarm-pz.begin", create: { opponent: "ring", seat: "blue", seed: 41, settings: { speed: 2 }, label: "" } }]);
  hear(OVER, { source: {} });
  hear(OVER, { origin: "http://lab" });
  await settled();
  assert.deepEqual(rows, []);
  hear(OVER);
  await settled();
  assert.deepEqual([rows.length, rows[0].outcome, rows[0].error, listeners.size], [1, "win", null, 0]);
});

test("why no game was played stands in the row", async () => {
  const refused = begin(), silent = begin(), absent = begin({ engine: "page", factors: { red: { share: 0 } } });
  refused.hear({ type: "swarm-pz.refused", reason: "no policy" });
  silent.expire();
  absent.expire();
  await settled();
  const [one, two, three] = [refused, silent, absent].map(({ rows: [row] }) => row);
  assert.deepEqual([one.outcome, one.error], [null, "no policy"]);
  assert.match(two.error, /no answer from http:..table: .* --embed http:..lab/);
  assert.match(three.error, /no answer from http:..table.game.: is the folder/);
  assert.match(absent.address, /^http:..table.game.\?factors=%7B%22red%22.*#embed=/);
});

test("a recording that was saved elsewhere is not in the row, and one that could not be saved stays there", async () => {
  const saved = [], kept = begin({ save: async (...what) => saved.push(what) }), lost = begin({ save: async () => { throw new Error("full"); } });
  for (const { hear } of [kept, lost]) hear(OVER);
  await settled();
  assert.deepEqual([saved, kept.rows[0].lines], [[["a.jsonl", "{}"]], null]);
  assert.deepEqual([lost.rows[0].lines, lost.rows[0].error], ["{}", "not saved: full"]);
});
