// Recorded games in a page: written as docs/protocol.md#recordings has them, kept in the browser, and played again.

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
export function headerOf(table, { red, blue, time_limit: limit, mapping, speed, majority = false }, has) {
  const capture = { ...table.game.capture, enabled: red > 0 && blue > 0 };
  const game = { ...table.game, drones_per_team: red === blue ? red : [red, blue], time_limit: limit ?? UNTIMED, capture };
  const own = { ...table, game, mapping, speed, ...(majority ? { majority } : {}) };
  return { type: "game", protocol: "swarm-pz.play.v2", started: new Date().toISOString(), table: own, ...has };
}

// The files of this browser; without a folder, they last as long as the page.
export class Shelf {
  constructor(folder = null) {
    this.folder = folder;
    this.texts = new Map();
    this.open = new Map(); // handles of files that are written
    this.writing = null; // until all is written that was given
  }

  static async find() {
    try {
      return new Shelf(await (await navigator.storage.getDirectory()).getDirectoryHandle("swarm-pz", { create: true }));
    } catch { return new Shelf(); }
  }

  // Add to a file, which is open until it is closed.
  async append(name, text) {
    if (!this.folder) this.texts.set(name, (this.texts.get(name) ?? "") + text);
    else {
      if (!this.open.has(name)) this.open.set(name, await (await this.folder.getFileHandle(name, { create: true })).createSyncAccessHandle());
      const handle = this.open.get(name);
      handle.write(new TextEncoder().encode(text), { at: handle.getSize() });
    }
  }

  close(name) {
    this.open.get(name)?.close();
    this.open.delete(name);
  }

  async blob(name) {
    await this.writing;
    if (!this.folder) return this.texts.has(name) ? new Blob([this.texts.get(name)]) : null;
    return this.folder.getFileHandle(name).then((file) => file.getFile(), () => null);
  }

  async read(name) { return (await this.blob(name))?.text() ?? null; }

  async remove(name) { return this.folder ? this.folder.removeEntry(name).catch(() => {}) : this.texts.delete(name); }

  // Names of recordings, the latest first.
  async names() {
    const names = [];
    await this.writing;
    for await (const name of this.folder ? this.folder.keys() : this.texts.keys()) if (name.endsWith(".jsonl")) names.push(name);
    return names.sort().reverse();
  }

  // What recorded games were, as the server lists them; those that are too many are forgotten.
  async list() {
    const names = await this.names();
    for (const name of names.splice(LISTED)) await this.remove(name);
    const told = await Promise.allSettled(names.map(async (name) => {
      const blob = await this.blob(name), [first] = (await blob.slice(0, ENDS).text()).split("\n");
      const last = (await blob.slice(-ENDS).text()).trimEnd().split("\n").at(-1), { started, lesson, red, blue } = JSON.parse(first);
      const end = last.startsWith('{"type":"end"') ? JSON.parse(last) : { outcome: null, ended_by: null, sizes: null, tick: null };
      const { outcome, ended_by: by, sizes, tick } = end;
      return { name, started, lesson: Boolean(lesson), red, blue, outcome, ended_by: by, sizes, seconds: tick === null ? null : tick / TICKS };
    }));
    return told.flatMap((one) => (one.status === "fulfilled" ? [one.value] : []));
  }
}

// Writes a game down, line by line. Where the browser keeps no more, the file breaks off.
export class Recorder {
  shelf; name; failed; isBroken = false;

  // failed: called once if it does.
  constructor(shelf, name, failed) { Object.assign(this, { shelf, name, failed }); }

  queue(act) {
    this.shelf.writing = Promise.resolve(this.shelf.writing).then(act).catch(() => {
      if (!this.isBroken) this.failed();
      this.isBroken = true;
    });
  }

  write(line) {
    this.queue(async () => {
      if (!this.isBroken) await this.shelf.append(this.name, `${JSON.stringify(line)}\n`);
    });
  }

  close() { this.queue(() => this.shelf.close(this.name)); }
}

// A copy of a game, with all that it holds.
function copy(game) {
  const made = structuredClone(game);
  for (const [of, { prototype }] of [[made, Game], [made.ground, Ground], [made.controller, Controller]]) Object.setPrototypeOf(of, prototype);
  return made;
}

// A recorded game that goes to any of its ticks: each control period begins as its frame has it.
export class Playback {
  name; header; lines; captures; end;

  constructor(name, text) {
    const [header, ...lines] = text.split("\n").slice(0, -1).map((line) => JSON.parse(line));
    const of = (type) => lines.filter((line) => line.type === type), { drones_per_team: sizes, time_limit: limit } = header.table.game;
    const [red, blue] = [sizes].flat().length === 2 ? sizes : [sizes, sizes], { mapping, speed, majority } = header.table;
    Object.assign(this, { name, header, lines, captures: of("captured"), commands: of("command"), end: of("end")[0] ?? null });
    this.settings = {
      red, blue, mapping, speed, time_limit: limit === UNTIMED ? null : limit, red_system: "ergodic", blue_system: "ergodic", ...(majority ? { majority } : {}),
    };
    this.frames = new Map(of("frame").map(({ tick, data }) => [tick, data]));
    this.lastTick = this.end?.tick ?? Math.max(0, ...this.frames.keys());
    const given = new Map();
    this.followed = []; // commands, by when they came into force
    for (const line of lines) {
      const called = `${line.seat} ${line.number}`;
      if (line.type === "command") given.set(called, line);
      else if (line.type === "in_force") this.followed.push({ ...given.get(called), tick: line.tick });
    }
    this.game = new Game({ red, blue, timeLimit: limit }, header.seed);
    this.marks = new Map();
    this.sizes = this.sizesUntil(this.lastTick);
  }

  // Drones of red and blue, once a second.
  sizesUntil(tick) {
    let { red } = this.settings, place = 0;
    const count = red + this.settings.blue, sizes = [];
    for (let second = 0; TICKS * second <= tick; second++) {
      for (; this.captures[place]?.tick <= TICKS * second; place++) red += this.captures[place].seat === "red" ? 1 : -1;
      sizes.push([red, count - red]);
    }
    return sizes;
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
    const { name, header, lines, captures, end, lastTick } = this, result = end?.outcome ?? "stopped";
    return SIDES.map((side, team) => {
      const other = header[SIDES[1 - team]], captured = captures.filter((capture) => capture.seat === side).length;
      const commands = lines.filter((line) => line.type === "command" && line.seat === side).length;
      return {
        recording: name, started: header.started, side, seed: header.seed, kind: header[side].kind, opponent: other.policy, seconds: lastTick / TICKS,
        outcome: !SIDES.includes(result) ? result : result === side ? "win" : "loss", ended_by: end?.ended_by ?? "", commands,
        captured, lost: captures.length - captured,
      };
    }).filter(({ kind }) => kind !== "free");
  }
}
