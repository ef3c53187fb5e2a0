// The connection to a table: hello, clock, acknowledgements, and coming back to one's seat.
// `send` sends a message. Received ones, also frames and targets, become events named by their type.

import { decode, FRAME } from "./frames.js";
import { keep, recall } from "./store.js";

const SUBPROTOCOL = "swarm-pz.play.v2";
const ACKNOWLEDGE_EVERY = 4;
const RETRY_MS = [250, 500, 1000, 2000, 4000];
const PING_EVERY_MS = 2000;

// The server: a socket to it, and its answers to requests; null without an answer.
export const SERVER = {
  connect: () => new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`, SUBPROTOCOL),
  fetch: (path) => fetch(`/${path}`).catch(() => null),
};

export class Link extends EventTarget {
  // wantedSeat returns the seat to come back to, or null.
  constructor(wantedSeat, table = SERVER) {
    super();
    this.wantedSeat = wantedSeat;
    this.table = table;
    this.offsetMs = 0; // server's clock minus ours
    this.roundTripMs = 0;
    this.tries = 0;
    this.frames = 0;
    this.requestedSeat = null; // the seat in the greeting
    this.quiet = false; // another tab has our seat
    this.open();
    setInterval(() => this.ping(), PING_EVERY_MS);
    document.addEventListener("visibilitychange", () => this.send({ type: "visibility", hidden: document.hidden }));
  }

  // This window's seat, and the latest seat of any window, to return to after a window was closed.
  get seat() { return recall("seat", "session"); }

  get lastSeat() { return recall("seat"); }

  set seat(seat) {
    keep("seat", seat, "session");
    if (this.table === SERVER) keep("seat", seat); // else it ends with its page
  }

  // The server's clock; NaN before its first answer.
  now() { return this.pings.length ? performance.now() + this.offsetMs : NaN; }

  get isOpen() { return this.greeted && this.socket.readyState === WebSocket.OPEN; }

  // Reconnect with the seat that is wanted now.
  reopen() { this.socket.close(); }

  open() {
    this.greeted = false;
    this.pings = [];
    this.socket = this.table.connect();
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.hello();
    this.socket.onmessage = (event) => this.receive(event.data);
    this.socket.onclose = () => {
      this.tell("closed");
      if (!this.quiet) setTimeout(() => this.open(), RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)]);
    };
  }

  hello() {
    this.tries = 0;
    const client = { viewport: [innerWidth, innerHeight], pixel_ratio: devicePixelRatio };
    const seat = this.requestedSeat = this.wantedSeat();
    this.greeted = true;
    this.send({ type: "hello", kind: "person", client, ...(seat ? { token: seat.token } : {}) });
    this.ping();
  }

  ping() { this.send({ type: "ping", sent_ms: performance.now() }); }

  // Send a message; return true if it could be sent.
  send(message) {
    if (!this.isOpen) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  receive(data) {
    const message = typeof data === "string" ? JSON.parse(data) : data instanceof ArrayBuffer ? decode(data) : data; // else from the worker
    switch (message.type) {
      case FRAME:
        if (message.sequence && ++this.frames % ACKNOWLEDGE_EVERY === 0) this.send({ type: "acknowledge", sequence: message.sequence });
        break;
      case "pong": this.setClock(message); break;
      case "seated": this.seat = { room: message.room, token: message.token, seat: message.seat }; break;
      case "room": // the seat of a game that is over is kept for this window alone
        if (this.table === SERVER && message.code === this.seat?.room) keep("seat", message.phase === "over" ? null : this.seat);
        break;
      case "displaced":
        this.quiet = true;
        this.socket.close();
        break;
    }
    this.tell(message.type, message);
  }

  // The quickest of the latest pings gives the best estimate of the server's clock.
  setClock({ sent_ms: sent, server_ms: server }) {
    const back = performance.now();
    this.pings = [...this.pings.slice(-7), { trip: back - sent, offset: server - (sent + back) / 2 }];
    const best = this.pings.reduce((a, b) => (b.trip < a.trip ? b : a));
    this.offsetMs = best.offset;
    this.roundTripMs = best.trip;
  }

  tell(type, detail = null) { this.dispatchEvent(new CustomEvent(type, { detail })); }
}
