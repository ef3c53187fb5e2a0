// The page in the frame of an experiment, which chooses the game and gets its result. Messages count only if they come
// from the parent window, and from an origin that the server was started for.

import { hear } from "./elements.js";
import { SERVER } from "./link.js";
import { SIDES, TICKS } from "./words.js";

const TRIES = 40, PAUSE_MS = 500; // a recording is complete soon after its game

export class Embed {
  // origin is the experiment's, from the address; begin opens a room with a message and is ready at once.
  constructor(link, origin, begin) {
    this.table = link.table;
    this.origin = origin;
    this.begin = begin;
    this.allowed = this.begun = this.ended = false;
    this.side = null;
    this.waiting = "Waiting for the experiment…"; // shown until a game begins
    document.body.classList.add("study");
    addEventListener("message", (event) => this.hear(event));
    hear(link, {
      welcome: ({ embedders }) => this.greet(embedders), seated: ({ seat }) => { this.side = seat; }, room: (room) => this.watch(room),
    });
  }

  greet(embedders) {
    if (this.allowed) return; // the link has reconnected
    this.allowed = parent !== window && embedders.includes(this.origin);
    if (this.allowed) this.tell({ type: "swarm-pz.ready" });
    else this.waiting = "This page is for the frame of an experiment that the table was started for (--embed).";
  }

  hear({ source, origin, data }) {
    const counts = this.allowed && !this.begun && source === parent && origin === this.origin && data?.type === "swarm-pz.begin";
    if (counts) this.begun = this.begin({ label: "", ...data.create, type: "create", once: true });
  }

  tell(message) { parent.postMessage(message, this.origin); }

  // Report a refusal.
  refused({ about, reason }) {
    if (["create", "ready", "hello"].includes(about)) this.giveUp(reason);
  }

  giveUp(reason) {
    if (!this.ended) this.tell({ type: "swarm-pz.refused", reason });
    this.ended = true;
  }

  watch(room) {
    const failed = [room.red, room.blue].find((seat) => seat.policy_state === "failed");
    if (failed) this.giveUp(`${failed.name} cannot play: ${failed.reason}`);
    else if (room.phase === "over") this.end(room.recording);
  }

  async end(recording) {
    if (this.ended) return;
    this.ended = true;
    for (let tries = 0; tries < TRIES; tries++) {
      const answer = await this.table.fetch(`recordings/${recording}`);
      if (answer?.ok) {
        const lines = await answer.text(), row = rowOf(recording, lines, this.side ?? "red");
        this.tell({ type: "swarm-pz.over", row: this.table === SERVER ? row : { ...row, lines } }); // a server keeps them
        return;
      }
      await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
    }
    this.ended = false;
    this.giveUp(`the game was played, but its recording ${recording} cannot be read`);
  }
}

// A side's row of a recorded game, with the factors of its seat; the tables of `swarm-pz study` have more.
export function rowOf(recording, text, side) {
  const [header, ...lines] = text.trimEnd().split("\n").map((line) => JSON.parse(line)), of = (kind) => lines.filter(({ type }) => type === kind);
  const { outcome: result, ended_by, tick } = lines.at(-1), { started, seed } = header, captures = of("captured"), { kind } = header[side];
  const captured = captures.filter(({ seat }) => seat === side).length, { policy: opponent } = header[SIDES[1 - SIDES.indexOf(side)]];
  const commands = of("command").filter(({ seat, sender }) => seat === side && !sender).length;
  const factors = header.table.factors[SIDES.indexOf(side)], hide = factors.hide.join("+");
  const outcome = !SIDES.includes(result) ? result : result === side ? "win" : "loss";
  return { ...factors, hide, recording, started, seed, side, kind, opponent, outcome, ended_by, seconds: tick / TICKS, commands, captured, lost: captures.length - captured };
}
