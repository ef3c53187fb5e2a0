// Recorded games in a page: logs of its messages (docs/protocol.md#recordings), kept in the browser.

import { TICKS } from "../words.js";

export const UNTIMED = 1e6; // seconds that stand for no limit
const LISTED = 200, ENDS = 8192; // games; bytes of a file's beginning and end that are read for its summary

// Return the first line of a recording: the table with a room's settings.
export function headerOf(table, { red, blue, time_limit: limit, speed, majority = false }, fields) {
  const capture = { ...table.game.capture, enabled: red > 0 && blue > 0 };
  const game = { ...table.game, drones_per_team: red === blue ? red : [red, blue], time_limit: limit ?? UNTIMED, capture };
  const own = { ...table, game, speed, ...(majority ? { majority } : {}) };
  return { type: "game", protocol: "swarm-pz.play.v2", started: new Date().toISOString(), table: own, ...fields };
}

// The recordings of this browser; without a folder, they last as long as the page.
export class Shelf {
  folder; texts = new Map(); saving = null; // the last save

  constructor(folder = null) { this.folder = folder; }

  static async find() {
    try {
      return new Shelf(await (await navigator.storage.getDirectory()).getDirectoryHandle("swarm-pz", { create: true }));
    } catch { return new Shelf(); }
  }

  // Store the messages of a game, and delete the oldest of too many games; rejects if the browser stores no more.
  save(name, messages) {
    this.saving = this.write(name, messages.map((message) => `${JSON.stringify(message)}\n`).join(""));
    return this.saving;
  }

  async write(name, text) {
    if (!this.folder) this.texts.set(name, text);
    else {
      const file = await (await this.folder.getFileHandle(name, { create: true })).createSyncAccessHandle();
      try { file.write(new TextEncoder().encode(text), { at: 0 }); } finally { file.close(); }
    }
    for (const old of (await this.names()).slice(LISTED)) await (this.folder ? this.folder.removeEntry(old).catch(() => {}) : this.texts.delete(old));
  }

  async blob(name) {
    await this.saving?.catch(() => {});
    if (!this.folder) return this.texts.has(name) ? new Blob([this.texts.get(name)]) : null;
    return this.folder.getFileHandle(name).then((file) => file.getFile(), () => null);
  }

  async read(name) { return (await this.blob(name))?.text() ?? null; }

  async names() {
    const names = [];
    for await (const name of this.folder ? this.folder.keys() : this.texts.keys()) if (name.endsWith(".jsonl")) names.push(name);
    return names.sort().reverse();
  }

  // Summaries of recorded games, as the server lists them.
  async list() {
    const summaries = await Promise.allSettled((await this.names()).map(async (name) => {
      const blob = await this.blob(name), [first] = (await blob.slice(0, ENDS).text()).split("\n");
      const last = (await blob.slice(-ENDS).text()).trimEnd().split("\n").at(-1), { started, lesson, red, blue } = JSON.parse(first);
      const { outcome, ended_by, sizes, tick } = JSON.parse(last);
      return { name, started, lesson, red, blue, outcome, ended_by, sizes, seconds: tick / TICKS };
    }));
    return summaries.flatMap((one) => (one.status === "fulfilled" ? [one.value] : []));
  }
}
