// Recorded games in a page: logs of its messages (docs/protocol.md#recordings), kept in the browser and played again.

import { Controller } from "./controller.js";
import { Game, PERIOD } from "./game.js";
import { Ground, TRAIL } from "./ground.js";
import { momentOf } from "./wire.js";
import { SIDES, TICKS } from "../words.js";

const UNTIMED = 1e6; // seconds that stand for no limit
const MARK = 90; // ticks between moments that are kept
const LISTED = 200, ENDS = 8192; // games; bytes of a file's beginning and end that are read for its summary

export function teamOf({ seat }) { return SIDES.indexOf(seat); }

// The first line of a recording, of a table with a room's settings.
export function headerOf(table, { red, blue, time_limit: limit, speed, majority = false }, has) {
  const capture = { ...table.game.capture, enabled: red > 0 && blue > 0 };
  const game = { ...table.game, drones_per_team: red === blue ? red : [red, blue], time_limit: limit ?? UNTIMED, capture };
  const own = { ...table, game, speed, ...(majority ? { majority } : {}) };
  return { type: "game", protocol: "swarm-pz.play.v2", started: new Date().toISOString(), table: own, ...has };
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

  // Keep the messages of a game, and forget the oldest of too many games; rejected where the browser keeps no more.
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

function copy(game) {
  const made = structuredClone(game);
  for (const [of, { prototype }] of [[made, Game], [made.ground, Ground], [made.controller, Controller]]) Object.setPrototypeOf(of, prototype);
  return made;
}

// A recorded game that goes to any of its ticks: each control period begins as its frame has it.
export class Playback {
  name; header; lines; captures; end; marks;

  constructor(name, text) {
    const [header, ...lines] = text.split("\n").slice(0, -1).map((line) => JSON.parse(line));
    const of = (type) => lines.filter((line) => line.type === type), { drones_per_team: sizes, time_limit: limit } = header.table.game;
    const [red, blue] = [sizes].flat().length === 2 ? sizes : [sizes, sizes], { speed, majority } = header.table;
    Object.assign(this, { name, header, lines, captures: of("captured"), end: of("end")[0], marks: new Map() });
    this.settings = {
      red, blue, speed, time_limit: limit === UNTIMED ? null : limit, red_system: "ergodic", blue_system: "ergodic", ...(majority ? { majority } : {}),
    };
    this.frames = new Map(of("frame").map(({ tick, data }) => [tick, data]));
    this.lastTick = this.end.tick;
    const latestOf = (begun) => lines.findLast((line) => line.type === "command" && line.seat === begun.seat && line.number === begun.number);
    this.followed = of("in_force").map((begun) => ({ ...latestOf(begun), tick: begun.tick }));
    this.game = new Game({ red, blue, timeLimit: limit }, header.seed);
  }

  // Drones of red and blue, once a second.
  get sizes() {
    return Array.from({ length: Math.floor(this.lastTick / TICKS) + 1 }, (_, second) => {
      const { teams } = momentOf(this.frames.get(TICKS * second)), blue = teams.reduce((sum, team) => sum + team, 0);
      return [teams.length - blue, blue];
    });
  }

  // Go to a tick, and return the commands that came into force on the way.
  seek(tick) {
    const until = Math.min(Math.max(tick, 0), this.lastTick), mark = Math.floor(until / MARK) * MARK;
    const nearest = [...this.marks.keys()].filter((known) => known <= mark).at(-1);
    if (until < this.game.tick || nearest >= this.game.tick + MARK) this.game = copy(this.marks.get(nearest));
    const { game } = this, came = [];
    while (game.tick < until) {
      if (game.tick % MARK === 0 && !this.marks.has(game.tick)) this.marks.set(game.tick, copy(game));
      const begun = game.tick % PERIOD ? [] : this.followed.filter((command) => command.tick === game.tick);
      if (this.frames.has(game.tick)) {
        const { positions, velocities } = momentOf(this.frames.get(game.tick));
        game.positions.set(positions);
        game.velocities.set(velocities);
      }
      for (const line of begun) game.command(teamOf(line), line.density.flat());
      came.push(...begun);
      game.advance();
    }
    return came;
  }

  // Moments of the drones' trails until the present one.
  past() {
    const { tick } = this.game, ticks = [...this.frames.keys()].filter((one) => one <= tick && one > tick - TRAIL && one % (3 * PERIOD) === 0);
    return ticks.map((one) => momentOf(this.frames.get(one)));
  }

  // The command that a team follows at the present moment; none is everything.
  latest(team) { return this.followed.findLast((command) => teamOf(command) === team && command.tick < this.game.tick) ?? null; }

  // The game as rows of an experiment, one for each seat; the tables of `swarm-pz study` have more, from its lines.
  rows() {
    const { name, header, lines, captures, end, lastTick } = this, { outcome: result, ended_by: endedBy } = end;
    const { started, seed } = header, all = { recording: name, started, seed, seconds: lastTick / TICKS, ended_by: endedBy };
    return SIDES.map((side, team) => {
      const captured = captures.filter(({ seat }) => seat === side).length, { kind } = header[side], { policy: opponent } = header[SIDES[1 - team]];
      const outcome = !SIDES.includes(result) ? result : result === side ? "win" : "loss";
      const commands = lines.filter(({ type, seat }) => type === "command" && seat === side).length;
      return { ...all, side, kind, opponent, outcome, commands, captured, lost: captures.length - captured };
    }).filter(({ kind }) => kind !== "free");
  }
}
