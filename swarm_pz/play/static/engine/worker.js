// The game in a worker of the page: it answers the messages of docs/protocol.md that one person's game needs.

import { ADDRESS, check, FACTORS, Refused } from "./checks.js";
import { PLAYERS } from "./players.js";
import { Shelf } from "./recording.js";
import { now, Room, UNVARIED } from "./room.js";
import { SIDES } from "../words.js";

const LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789";

export class Table {
  query; rules; commands; shelf; countdown; interval; room; kind; client;

  // The first argument is table.json of `swarm-pz site`; query holds values of the page's address; say sends a message.
  constructor({ welcome, rules, commands }, shelf, query = {}) {
    const fitting = Object.fromEntries(Object.entries(query).filter(([key, value]) => ADDRESS[key]?.(value)));
    const { countdown = 3, factors = {} } = /** @type {any} */ (fitting);
    const isHere = (name) => PLAYERS.includes(name);
    this.factors = SIDES.map((side) => ({ ...UNVARIED, ...factors[side] }));
    this.welcome = { ...welcome, policies: welcome.policies.filter(({ name }) => isHere(name)), opponents: welcome.opponents.filter(isHere) };
    this.software = `swarm-pz ${welcome.version}, in a page`;
    /** @type {any} */
    this.say = () => {};
    Object.assign(this, { query, rules, commands, shelf, countdown, interval: rules.min_command_interval, room: null });
  }

  async hear(text) {
    const { type, ...message } = JSON.parse(text);
    try {
      if (!Object.hasOwn(ACTS, type)) throw new Refused("unknown", `there is no ${type} where no server is`);
      await ACTS[type](this, message);
    } catch (error) {
      this.say({ type: "refused", code: error instanceof Refused ? error.code : "not_valid", reason: error.message, about: type });
    }
  }

  // Greet a visitor. Seats end with their page, so tokens are refused.
  greet({ kind, client, token = null }) {
    this.leave();
    Object.assign(this, { kind, client });
    this.say({ ...this.welcome, server_ms: now() });
    if (token !== null) throw new Refused("unknown", "Your game ended when its page was closed.");
  }

  // --- rooms ------------------------------------------------------------------------------------------

  get inRoom() {
    if (!this.room) throw new Refused("out_of_turn", "create a room first");
    return this.room;
  }

  open(message) {
    check(this.query, ADDRESS);
    for (const factors of this.factors) check(factors, FACTORS);
    const code = Array.from(crypto.getRandomValues(new Uint8Array(4)), (byte) => LETTERS[byte % LETTERS.length]).join("");
    const room = new Room(this, code, message);
    this.leave();
    this.room = room;
    room.enter();
  }

  leave() {
    const { room } = this;
    this.room = null; // the visitor hears nothing more of it
    room?.leave();
  }

  // Answer a request as a server does: the list of recorded games, or one of them; null if there is no such game.
  async answer(path) {
    const [, name] = path.split("/");
    return name ? this.shelf.read(name) : JSON.stringify(await this.shelf.list());
  }
}

const ACTS = {
  hello: (table, message) => table.greet(message),
  ping: (table, { sent_ms: sent }) => table.say({ type: "pong", sent_ms: sent, server_ms: now() }),
  create: (table, message) => table.open(message),
  ready: (table) => table.inRoom.ready(),
  pause: (table, { paused = true }) => table.inRoom.pause(paused),
  command: (table, message) => table.inRoom.command(message),
  visibility: (table, { hidden }) => table.room?.note(hidden ? "hidden" : "shown"),
  leave: (table) => table.leave(),
};

// Return the values in the page's address, read as JSON, by name. Unknown names, which other sites add, are skipped.
export function queryOf(search) {
  const read = (text) => { try { return JSON.parse(text); } catch { return text; } };
  return Object.fromEntries([...new URLSearchParams(search)].filter(([key]) => Object.hasOwn(ADDRESS, key)).map(([key, text]) => [key, read(text)]));
}

async function begin() {
  const tableFile = await (await fetch(new URL("table.json", import.meta.url))).json();
  tableFile.welcome.embedders = [location.origin];
  return new Table(tableFile, await Shelf.find(), queryOf(self.name));
}

if ("WorkerGlobalScope" in globalThis) {
  const beginning = begin();
  // Without a path, the port is a new connection; with one, it gets the answer.
  onmessage = async ({ data: path, ports: [port] }) => {
    const table = await beginning;
    if (path) return port.postMessage(await table.answer(path).catch(() => null));
    table.say = (message) => port.postMessage(message);
    port.onmessage = ({ data }) => table.hear(data);
    return port.postMessage(null); // it is open
  };
}
