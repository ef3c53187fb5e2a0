// A table with one room, in a worker of the page: it speaks the server's protocol (docs/protocol.md) with one visitor.

import { ADDRESS, check, FACTORS, Refused } from "./checks.js";
import { PLAYERS } from "./players.js";
import { Playback, Shelf } from "./recording.js";
import { EVERYTHING, now, Room, seatOf, stateOf, UNVARIED } from "./room.js";
import { targetOf } from "./strokes.js";
import { frameOf, targetMessage } from "./wire.js";
import { SIDES, TICKS } from "../words.js";

const LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789";
const MOST_OWED = 8; // ticks of a recorded game that are made up for at once

export class Table {
  rules; commands; shelf; countdown; interval; room; replay; send; kind; client; pace; sought; shown; owed;

  // told: what swarm-pz site has written of rules and policies; asked: what the page's address asks for.
  constructor({ welcome, rules, commands }, shelf, asked = {}) {
    const fitting = Object.fromEntries(Object.entries(asked).filter(([of, value]) => ADDRESS[of]?.(value)));
    const { countdown = 3, min_command_interval: interval = rules.min_command_interval, factors = {} } = /** @type {any} */ (fitting);
    const isHere = (name) => PLAYERS.includes(name);
    this.asked = asked;
    this.factors = SIDES.map((side) => ({ ...UNVARIED, ...factors[side] }));
    this.welcome = { ...welcome, policies: welcome.policies.filter(({ name }) => isHere(name)), opponents: welcome.opponents.filter(isHere), min_command_interval: interval };
    this.software = `swarm-pz ${welcome.version}, in a page`;
    Object.assign(this, { rules, commands, shelf, countdown, interval, room: null, replay: null });
  }

  // --- the visitor ------------------------------------------------------------------------------------

  // Speak with a visitor from now on: send gives them a message.
  meet(send) {
    this.room?.part(false);
    this.stopReplay();
    this.send = send;
  }

  say(message) { this.send(JSON.stringify(message)); }

  async hear(text) {
    const { type, ...message } = JSON.parse(text);
    try {
      if (!Object.hasOwn(ACTS, type)) throw new Refused("unknown", `there is no ${type} where no server is`);
      await ACTS[type](this, message);
    } catch (error) {
      const { code, message: reason, recording = null } = error;
      this.say({ type: "refused", code: error instanceof Refused ? code : "not_valid", reason, about: type, recording });
    }
  }

  async greet({ kind, client, token = null }) {
    Object.assign(this, { kind, client });
    this.say({ ...this.welcome, server_ms: now() });
    if (token === null) return;
    try {
      if (this.room?.token !== token) await this.resume(token);
      this.room.enter();
    } catch (error) {
      if (error.code !== "taken") throw error;
      this.say({ type: "displaced" }); // another window has it
    }
  }

  // Take up a game again whose page was closed.
  async resume(token) {
    const seat = await this.shelf.seat(token);
    if (!seat) throw new Refused("unknown", "that seat is gone: its game is over, or the page was closed before it began");
    const replay = new Playback(seat.name, await this.shelf.untilFrame(seat.name)), { header, settings } = replay;
    const [own, other] = header.red.kind === "person" ? SIDES : SIDES.toReversed(), { once } = seat;
    const asked = { settings, seat: own, opponent: header[other].policy || null, lesson: header.lesson, once };
    replay.seek(replay.lastTick);
    const room = new Room(this, seat.code, asked, replay.moment());
    await room.resume(token, replay);
    this.room = room;
  }

  // --- rooms ------------------------------------------------------------------------------------------

  get inRoom() {
    if (!this.room) throw new Refused("out_of_turn", "create a room first");
    return this.room;
  }

  open(asked, moment = null) {
    check(this.asked, ADDRESS);
    for (const factors of this.factors) check(factors, FACTORS);
    const code = Array.from(crypto.getRandomValues(new Uint8Array(4)), (byte) => LETTERS[byte % LETTERS.length]).join("");
    const room = new Room(this, code, asked, moment);
    this.leave();
    this.room = room;
    room.enter();
  }

  leave() {
    this.room?.part(true);
    this.room = null;
    this.stopReplay();
  }

  // --- recorded games ---------------------------------------------------------------------------------

  isRunning(name) { return this.room?.phase === "playing" && this.room.recorder.name === name; }

  async recorded(name) {
    const text = this.isRunning(name) ? null : await this.shelf.read(name);
    if (text === null) throw new Refused("unknown", `there is no recording ${name} here`);
    return text;
  }

  async watch(recording) {
    const replay = new Playback(recording, await this.recorded(recording)), { header, settings, sizes, end, lastTick } = replay;
    const [red, blue] = SIDES.map((side) => seatOf(header[side])), ended = end ? { outcome: end.outcome, ended_by: end.ended_by } : {};
    const how = { code: "", phase: "replay", settings, min_command_interval: header.table.min_command_interval, watchers: 1, verified: true };
    this.leave();
    Object.assign(this, { replay, pace: 1, sought: 0, shown: 0, owed: 0 });
    this.say(stateOf({ ...how, red, blue, sizes, recording, last_tick: lastTick, ...ended }));
    this.clock = setInterval(() => this.showReplay(), 1000 / TICKS);
  }

  get watched() {
    if (!this.replay) throw new Refused("out_of_turn", "open a recorded game first");
    return this.replay;
  }

  showReplay() {
    const { replay, sought } = this, { tick } = replay.game, ticks = Math.floor(this.owed += this.pace);
    this.owed = Math.min(this.owed - ticks, MOST_OWED);
    this.sought = null;
    if (sought === null && (ticks === 0 || tick >= replay.lastTick)) return;
    const came = replay.seek(sought ?? tick + ticks), both = [0, 1].map((team) => replay.latest(team) ?? { team, density: [...EVERYTHING] });
    if (sought !== null) for (const moment of replay.past()) this.send(frameOf(moment));
    for (const { team, density } of sought === null ? came : both) this.send(targetMessage(team, 0, targetOf(density.flat())));
    this.send(frameOf(replay.game, { sequence: ++this.shown, altitudes: true, fields: replay.game.fields() }));
  }

  stopReplay() {
    clearInterval(this.clock);
    this.replay = null;
  }

  takeOver({ seat, opponent = null }) {
    const { header, settings } = this.watched, moment = this.replay.moment(), other = header[seat === "red" ? "blue" : "red"].policy;
    if (moment.game.isOver) throw new Refused("not_valid", "the game is over at this moment; go back to an earlier one");
    this.open({ settings, seat, opponent: opponent ?? (other || null) }, moment);
  }

  // What a server answers to a request: the list of recorded games, one of them, or its rows in an experiment.
  async answer(path) {
    const [, name, part] = path.split("/");
    if (!name) return JSON.stringify((await this.shelf.list()).filter((game) => !this.isRunning(game.name)));
    const text = await this.recorded(name);
    return part === "trial" ? JSON.stringify(new Playback(name, text).rows().map((row) => ({ ...row, lines: text }))) : text;
  }
}

// What a visitor may say.
const ACTS = {
  hello: (table, message) => table.greet(message),
  ping: (table, { sent_ms: sent }) => table.say({ type: "pong", sent_ms: sent, server_ms: now() }),
  acknowledge() {}, // nothing is on its way for long
  create: (table, message) => table.open(message),
  ready: (table, { ready = true }) => table.inRoom.ready(ready),
  command: (table, message) => table.inRoom.command(message),
  painted: (table, message) => table.inRoom.painted(message),
  visibility: (table, { hidden }) => table.room?.note(hidden ? "hidden" : "shown"),
  leave: (table) => table.leave(),
  open_replay: (table, { recording }) => table.watch(recording),
  seek: (table, { tick }) => Object.assign(table, { sought: table.watched && tick }),
  pace: (table, { speed }) => Object.assign(table, { pace: table.watched && speed }),
  take_over: (table, message) => table.takeOver(message),
};

// What the page's address asks for: values in JSON, by what they are of. What others add to a link on its way is passed over.
export function askedBy(search) {
  const read = (text) => { try { return JSON.parse(text); } catch { return text; } };
  return Object.fromEntries([...new URLSearchParams(search)].filter(([of]) => Object.hasOwn(ADDRESS, of)).map(([of, text]) => [of, read(text)]));
}

async function begin() {
  const told = await (await fetch(new URL("table.json", import.meta.url))).json();
  told.welcome.embedders = [location.origin];
  return new Table(told, await Shelf.find(), askedBy(self.name));
}

if ("WorkerGlobalScope" in globalThis) {
  const beginning = begin();
  // A port to speak by; or, with a request, to answer by.
  onmessage = async ({ data: path, ports: [port] }) => {
    const table = await beginning;
    if (path) return port.postMessage(await table.answer(path).catch(() => null));
    table.meet((message) => port.postMessage(message));
    port.onmessage = ({ data }) => (data === null ? table.meet(() => {}) : table.hear(data));
    return port.postMessage(null); // it is open
  };
}
