// The page in the frame of an experiment, which says what is played, and is told how that went. Both check whom they
// hear: messages count from the window around this one alone, and from an origin that the table was started for.

import { hear } from "./elements.js";

const TRIES = 40, PAUSE_MS = 500; // a game's file is whole soon after its end

export class Embed {
  // origin: of the experiment, as the address says; begin: opens a room by a message and begins in it at once.
  constructor(link, origin, begin) {
    this.table = link.table;
    this.origin = origin;
    this.begin = begin;
    this.allowed = this.begun = this.ended = false;
    this.side = null;
    this.waiting = "Waiting for the experiment…"; // what is said until a game begins
    document.body.classList.add("study");
    addEventListener("message", (event) => this.hear(event));
    hear(link, {
      welcome: ({ embedders }) => this.greet(embedders), seated: ({ seat }) => { this.side = seat; }, room: (room) => this.watch(room),
    });
  }

  greet(embedders) {
    if (this.allowed) return; // it came back
    this.allowed = parent !== window && embedders.includes(this.origin);
    if (this.allowed) this.tell({ type: "swarm-pz.ready" });
    else this.waiting = "This page is for the frame of an experiment that the table was started for (--embed).";
  }

  hear({ source, origin, data }) {
    const counts = this.allowed && !this.begun && source === parent && origin === this.origin && data?.type === "swarm-pz.begin";
    if (counts) this.begun = this.begin({ label: "", ...data.create, type: "create", once: true });
  }

  tell(message) { parent.postMessage(message, this.origin); }

  // What was asked for is not done; a game whose room is gone is told by its recording, if there is one.
  refused({ about, reason, recording }) {
    if (about === "hello" && recording) this.end(recording);
    else if (["create", "ready", "hello"].includes(about)) this.giveUp(reason);
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
      const answer = await this.table.fetch(`recordings/${recording}/trial`);
      if (answer?.ok) {
        const rows = await answer.json();
        this.tell({ type: "swarm-pz.over", row: rows.find(({ side }) => side === this.side) ?? rows[0] });
        return;
      }
      await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
    }
    this.ended = false;
    this.giveUp(`the game was played, but its recording ${recording} cannot be read`);
  }
}
