// What happened: a list of captures, a word over the board, and now and then a sentence for who hears the page.

const at = (id) => document.getElementById(id);
const SIDES = ["Red", "Blue"];
const TOGETHER_TICKS = 30; // captures of a second are one piece of news
const MOST = 12; // pieces in the list
const TOAST_MS = 1400;
const ANSWER_MS = 2000; // for so long what one did oneself is answered, whatever is captured meanwhile
const TOLD_EVERY_MS = 4000;

export class News {
  constructor(sound) {
    this.sound = sound;
    this.seat = null;
    this.forget();
  }

  // Begin with another game; seat: whose drones are "yours".
  forget(seat = null) {
    this.seat = seat;
    this.pieces = []; // newest first
    this.untold = [0, 0]; // captures of red and blue that were not told yet
    at("log").replaceChildren();
    this.hush();
  }

  // Say nothing more.
  hush() {
    clearTimeout(this.telling);
    this.telling = null;
    at("told").textContent = "";
    at("toast").hidden = true;
    this.answered = -Infinity;
  }

  // Drones that changed sides in a frame.
  captures(changed, frame) {
    const counts = [0, 0];
    for (const drone of changed) counts[frame.teams[drone]]++;
    counts.forEach((count, team) => { if (count) this.capture(team, count, frame.tick); });
    if (!changed.length) return;
    const blue = frame.teams.reduce((sum, team) => sum + team, 0);
    this.sizes = [frame.teams.length - blue, blue];
    this.telling ??= setTimeout(() => this.tell(), TOLD_EVERY_MS);
  }

  capture(team, count, tick) {
    const same = this.pieces.find((piece) => piece.team === team && tick - piece.tick < TOGETHER_TICKS);
    if (same) same.count += count;
    else this.pieces.unshift({ team, count, tick });
    this.pieces.length = Math.min(this.pieces.length, MOST);
    this.untold[team] += count;
    at("log").replaceChildren(...this.pieces.map((piece) => this.line(piece)));
    this.toast(this.words(same ?? this.pieces[0]), team);
    this.sound.play(this.seat === null || this.seat === team ? "took" : "lost");
  }

  words({ team, count }) {
    const drones = count === 1 ? "1 drone" : `${count} drones`;
    if (this.seat === null) return `${SIDES[team]} took ${drones}`;
    return this.seat === team ? `You took ${drones}` : `${SIDES[team]} took ${count} of yours`;
  }

  line(piece) {
    const line = document.createElement("li"), shape = document.createElement("span");
    shape.className = "shape";
    line.className = piece.team ? "blue" : "red";
    line.append(shape, `${clock(piece.tick)} ${this.words(piece)}`);
    return line;
  }

  // A word over the board, for a moment.
  toast(text, team) {
    if (performance.now() - this.answered < ANSWER_MS) return;
    this.show(text, team ? "blue" : "red", TOAST_MS);
  }

  // What one did oneself, to who sees the board and to who hears it.
  answer(text) {
    this.answered = performance.now();
    this.show(text, "", ANSWER_MS);
    this.say(text);
  }

  show(text, team, forMs) {
    Object.assign(at("toast"), { textContent: text, className: team, hidden: false });
    clearTimeout(this.fading);
    this.fading = setTimeout(() => { at("toast").hidden = true; }, forMs);
  }

  // To who hears the page, at once.
  say(text) { at("told").textContent = text; }

  tell() {
    const waits = this.answered + ANSWER_MS - performance.now();
    this.telling = waits > 0 ? setTimeout(() => this.tell(), waits) : null;
    if (waits > 0) return;
    const [red, blue] = this.untold.map((count, team) => ({ count, team })).map((piece) => (piece.count ? this.words(piece) : ""));
    this.untold = [0, 0];
    this.say(`${[red, blue].filter(Boolean).join(", ")}. Red ${this.sizes[0]}, blue ${this.sizes[1]}.`);
  }
}

export function clock(tick) {
  const seconds = Math.floor(tick / 30);
  return `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}
