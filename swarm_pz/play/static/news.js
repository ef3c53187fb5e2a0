// News of captures: a list, a word over the board, and sentences for screen readers.

import { byId, make } from "./elements.js";
import { sizesOf } from "./frames.js";
import { clock, NAMES, SIDES } from "./words.js";

const TOGETHER_TICKS = 30; // captures within a second are one piece of news
const MOST = 12; // pieces in the list
const MIXED_TICKS = 60; // captures this early come from the mixed start
const TOAST_MS = 1400;
const ANSWER_MS = 2000; // an answer to the player's own action stays this long, whatever is captured
const TOLD_EVERY_MS = 4000;

export class News {
  constructor(sound) {
    this.sound = sound;
    this.forget();
  }

  // Begin another game; the drones of `seat` are "yours".
  forget(seat = null) {
    this.seat = seat;
    this.isExplained = false;
    this.pieces = []; // newest first
    this.latest = null; // a piece to be shown
    this.untold = [0, 0]; // captures of red and blue that were not announced yet
    byId("log").replaceChildren();
    this.hush();
  }

  // Say nothing more.
  hush() {
    this.paint();
    clearTimeout(this.telling);
    this.telling = null;
    this.say("");
    byId("toast").hidden = true;
    this.answered = -Infinity;
  }

  // Count drones that changed sides in a frame.
  captures(changed, { teams, tick }) {
    if (!changed.length) return;
    for (const team of [0, 1]) {
      const count = changed.filter((drone) => teams[drone] === team).length;
      if (count) this.capture(team, count, tick);
    }
    this.sizes = sizesOf(teams);
    this.telling ??= setTimeout(() => this.tell(), TOLD_EVERY_MS);
  }

  capture(team, count, tick) {
    const same = this.pieces.find((piece) => piece.team === team && tick - piece.tick < TOGETHER_TICKS);
    if (same) same.count += count;
    else this.pieces = [{ team, count, tick }, ...this.pieces].slice(0, MOST);
    this.untold[team] += count;
    this.latest = same ?? this.pieces[0];
    if (this.mayShow && tick < MIXED_TICKS && !this.isExplained) this.answer("The swarms start mixed: some drones change sides at once.");
    this.isExplained = true;
    this.sound.play(this.seat === null || this.seat === team ? "took" : "lost");
  }

  get mayShow() { return performance.now() - this.answered >= ANSWER_MS; }

  // Show captures that are not shown yet.
  paint() {
    const { latest } = this;
    if (!latest) return;
    this.latest = null;
    byId("log").replaceChildren(...this.pieces.map((piece) => (
      make("li", { className: SIDES[piece.team] }, make("span", { className: "shape" }), `${clock(piece.tick)} ${this.words(piece)}`))));
    if (this.mayShow) this.show(this.words(latest), SIDES[latest.team], TOAST_MS);
  }

  words({ team, count }) {
    const drones = count === 1 ? "1 drone" : `${count} drones`;
    if (this.seat === null) return `${NAMES[team]} took ${drones}`;
    return this.seat === team ? `You took ${drones}` : `${NAMES[team]} took ${count} of yours`;
  }

  // Answer the player's own action, on the board and for screen readers.
  answer(text) {
    this.answered = performance.now();
    this.show(text, "", ANSWER_MS);
    this.say(text);
  }

  show(text, className, forMs) {
    Object.assign(byId("toast"), { textContent: text, className, hidden: false });
    clearTimeout(this.fading);
    this.fading = setTimeout(() => { byId("toast").hidden = true; }, forMs);
  }

  // Tell screen readers something at once.
  say(text) { byId("told").textContent = text; }

  tell() {
    const waits = this.answered + ANSWER_MS - performance.now();
    this.telling = waits > 0 ? setTimeout(() => this.tell(), waits) : null;
    if (waits > 0) return;
    const parts = this.untold.map((count, team) => (count ? this.words({ team, count }) : "")).filter(Boolean);
    this.untold = [0, 0];
    this.say(`${parts.join(", ")}. Red ${this.sizes[0]}, blue ${this.sizes[1]}.`);
  }
}
