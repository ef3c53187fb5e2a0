// The connection to the server: hello, clock, acknowledgements, and coming back to one's seat.

import { decode, FRAME } from "./frames.js";

const SUBPROTOCOL = "swarm-pz.play.v2";
const ACKNOWLEDGE_EVERY = 4;
const RETRY_MS = [250, 500, 1000, 2000, 4000];
const STORE = "swarm-pz.seat";
const FASTEST_HZ = 1000; // that the server takes: where clocks are coarse, pictures seem to come all at once

export class Link extends EventTarget {
  // wantedSeat: gives the seat to come back to, or null.
  constructor(wantedSeat) {
    super();
    this.wantedSeat = wantedSeat;
    this.offsetMs = 0; // server's clock less ours
    this.roundTripMs = 0;
    this.tries = 0;
    this.frames = 0;
    this.greeted = false;
    this.asked = null; // the seat that the greeting asked for
    this.pings = [];
    this.quiet = false; // another tab has our seat
    this.restarted = false; // the server is another one than before
    this.open();
    setInterval(() => this.ping(), 2000);
    document.addEventListener("visibilitychange", () => this.send({ type: "visibility", hidden: document.hidden }));
  }

  // This window's seat; and the latest of any window, for who closed theirs.
  get seat() { return read("sessionStorage", STORE); }

  get lastSeat() { return read("localStorage", STORE); }

  set seat(seat) {
    try {
      for (const store of [sessionStorage, localStorage]) {
        if (seat) store.setItem(STORE, JSON.stringify(seat));
        else store.removeItem(STORE);
      }
    } catch { /* a page without storage only forgets its seat when it closes */ }
  }

  // The server's clock; no number until it has been asked.
  now() { return this.pings.length ? performance.now() + this.offsetMs : NaN; }

  get isOpen() { return this.greeted && this.socket.readyState === WebSocket.OPEN; }

  // Begin anew, with the seat that is wanted now.
  reopen() { this.socket.close(); }

  open() {
    this.greeted = false;
    this.pings = [];
    this.socket = new WebSocket(`ws${location.protocol === "https:" ? "s" : ""}://${location.host}/socket`, SUBPROTOCOL);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.hello();
    this.socket.onmessage = (event) => this.receive(event.data);
    this.socket.onclose = () => {
      this.tell("closed");
      if (!this.quiet) setTimeout(() => this.open(), RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)]);
    };
  }

  async hello() {
    this.tries = 0;
    const client = {
      viewport: [innerWidth, innerHeight], pixel_ratio: devicePixelRatio, refresh_hz: await refreshRate(),
    };
    const seat = this.asked = this.wantedSeat();
    this.greeted = true;
    this.send({ type: "hello", kind: "person", client, ...(seat ? { token: seat.token } : {}) });
    this.ping();
  }

  ping() { this.send({ type: "ping", sent_ms: performance.now() }); }

  // Send a message, and tell whether it could be sent.
  send(message) {
    if (!this.isOpen) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  receive(data) {
    if (typeof data !== "string") {
      const message = decode(data);
      if (message.kind === FRAME && ++this.frames % ACKNOWLEDGE_EVERY === 0) {
        this.send({ type: "acknowledge", sequence: message.sequence });
      }
      this.tell(message.kind === FRAME ? "frame" : "target", message);
      return;
    }
    const message = JSON.parse(data);
    if (message.type === "pong") this.setClock(message);
    if (message.type === "welcome") {
      this.restarted = this.roundTripMs > 0 && performance.now() + this.offsetMs > message.server_ms + 1000;
    }
    if (message.type === "seated") this.seat = { room: message.room, token: message.token, seat: message.seat };
    if (message.type === "displaced") {
      this.quiet = true;
      this.socket.close();
    }
    this.tell(message.type, message);
  }

  // The quickest of the latest pings is the one that says most about the server's clock.
  setClock({ sent_ms: sent, server_ms: server }) {
    const back = performance.now();
    this.pings = [...this.pings.slice(-7), { trip: back - sent, offset: server - (sent + back) / 2 }];
    const best = this.pings.reduce((a, b) => (b.trip < a.trip ? b : a));
    this.offsetMs = best.offset;
    this.roundTripMs = best.trip;
  }

  tell(type, detail) { this.dispatchEvent(new CustomEvent(type, { detail })); }
}

// What a browser keeps under a name, if it keeps anything.
export function read(store, name) {
  try { return JSON.parse(window[store].getItem(name)); } catch { return null; }
}

function refreshRate() {
  return new Promise((resolve) => {
    const times = [];
    const tick = (time) => {
      times.push(time);
      if (times.length < 12) requestAnimationFrame(tick);
      else resolve(Math.min(Math.round(1000 * (times.length - 1) / (times.at(-1) - times[0])), FASTEST_HZ));
    };
    requestAnimationFrame(tick);
    setTimeout(() => resolve(0), 500); // a hidden page is never painted
  });
}
