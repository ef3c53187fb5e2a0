// The service worker: each version caches its own files, fetched anew, and deletes older versions but no other page's files.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { runInNewContext } from "node:vm";

const CODE = readFileSync(new URL("../../../swarm_pz/play/static/engine/sw.js", import.meta.url), "utf8"), SCOPE = "https://host/game/";

// Return a function that sends events to a worker of some version, in a browser with these caches.
function worker(version, stores) {
  const acts = {}, caches = {
    open: async (name) => {
      const files = stores.get(name) ?? stores.set(name, new Map()).get(name);
      return {
        addAll: async (all) => { for (const { url, cache } of all) files.set(new URL(url, SCOPE).href, `${version} ${cache}`); },
        match: async (wanted) => files.get(wanted.url ?? wanted),
      };
    },
    keys: async () => [...stores.keys()], delete: async (name) => stores.delete(name),
  };
  runInNewContext(CODE.replace('VERSION = "", FILES = []', `VERSION = "${version}", FILES = ["./", "static/main.js"]`), {
    caches, registration: { scope: SCOPE }, addEventListener: (type, act) => { acts[type] = act; }, fetch: async () => "from the network",
    Request: class { constructor(url, options) { Object.assign(this, { url, ...options }); } },
  });
  return async (type, request = {}) => {
    let done;
    acts[type]({ request, waitUntil: (promise) => { done = promise; }, respondWith: (promise) => { done = promise; } });
    return done;
  };
}

test("a new version serves its own files, fetched anew, and clears away the old one alone", async () => {
  const stores = new Map([["https://host/other/ 1", new Map()]]), old = worker("1", stores), next = worker("2", stores);
  const script = { url: `${SCOPE}static/main.js`, mode: "cors" }, page = { url: `${SCOPE}?countdown=0#play=ring`, mode: "navigate" };
  await old("install");
  await next("install");
  assert.deepEqual([await old("fetch", script), await next("fetch", script)], ["1 no-cache", "2 no-cache"], "a page that is open keeps its own");
  await next("activate");
  assert.deepEqual([...stores.keys()], ["https://host/other/ 1", `${SCOPE} 2`]);
  assert.deepEqual([await next("fetch", page), await next("fetch", { url: `${SCOPE}none.js`, mode: "cors" })], ["2 no-cache", "from the network"]);
});
