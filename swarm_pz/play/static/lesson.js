// The first lesson: three steps. The board stands still before each step, until the player goes on.

import { paintPicture, PICTURES } from "./cards.js";
import { byId, hear, on, say } from "./elements.js";
import { ROUND } from "./progress.js";

const IN_CORNER = 0.35; // map widths from the corner
const EFFECT_TICKS = 30; // that a drawing needs to have an effect
const DRAWN = { red_system: "ergodic", blue_system: "ergodic" }; // instead of the server's default control systems
const ALONE = { settings: { red: 10, blue: 0, time_limit: null, ...DRAWN } };
const against = (opponent) => ({ opponent, settings: { time_limit: 60, majority: true, ...DRAWN } });

// In most games, a circle like the dashed one beats `centre`, and `halo` beats a small circle.
const LUCKY = "You were lucky: most games with a small ring are lost. ";
const STEPS = [
  {
    title: "Draw where they should be",
    text: "You are red, the discs. Drag a short stroke in the top right corner: your drones fly there by themselves.",
    task: "Draw a short stroke in the dashed corner, and nowhere else.",
    goal: [1, 1, IN_CORNER],
    room: ALONE,
    done: (frame) => share(frame, (x, y) => Math.hypot(1 - x, 1 - y) < IN_CORNER) >= 0.6,
  },
  {
    title: "Go all around",
    text: "A game of a minute. Blue crowds in the middle. Draw a big circle around it, and leave it so: ground that your drones fly "
      + "around becomes yours, and blue drones there turn red.",
    task: "Draw the dashed circle around blue, all the way, and leave it so.",
    goal: [0.5, 0.5, 0.25],
    room: against("centre"),
    isWon: true,
  },
  {
    title: "Why a small ring loses",
    text: "Now blue flies the big ring. Draw a small one in the middle, and look: it leaves no middle free, so your drones crowd. "
      + "A crowd holds one small place, and blue flies around it.",
    task: "Draw the small dashed ring, and see what becomes of your drones.",
    goal: [0.5, 0.5, 0.1],
    room: against("halo"),
  },
];

export class Lesson {
  // begin opens a room with a message and is ready at once, home leads to the start, next returns the next opponent.
  constructor(link, { begin, home, next }) {
    this.begin = begin;
    this.next = next;
    this.step = -1;
    this.room = null; // the code of the step's room
    this.held = false;
    this.drawnTick = null; // of the first frame after a drawing was sent
    this.isDrawn = false;
    hear(link, {
      seated: ({ room }) => { this.room ??= this.running ? room : null; },
      refused: ({ about }) => { if (about === "create" && this.running) this.go(this.step); },
    });
    on("click", { "lesson-next": () => this.act(), "lesson-leave": home, "lesson-skip": () => this.go(this.step + 1) });
    on("change", { "on-lift": () => { if (this.running && !this.held) this.ask(); } });
  }

  get running() { return this.step >= 0; }

  get isLast() { return this.step === STEPS.length; }

  start() { if (!this.running) this.go(0); }

  stop() {
    this.step = -1;
    this.held = false;
    byId("lesson").hidden = byId("step").hidden = true;
    this.mark(null);
    byId("chart").hidden = false;
  }

  // Stop the board and explain a step; `before` is a remark on the last one.
  go(step, before = "") {
    this.step = step;
    const { title, text } = STEPS[step] ?? {
      title: "That is the game",
      text: "Begin with a big ring, and leave it; never crowd. Own every drone to win, or most of them after two minutes.",
    };
    this.hold(this.isLast ? title : `${step + 1} of ${STEPS.length}: ${title}`, before + text, this.isLast ? "Play" : "Try it");
  }

  hold(title, text, button) {
    this.held = true;
    byId("step").hidden = false;
    byId("lesson").hidden = true;
    this.mark(null);
    byId("step-title").textContent = title;
    byId("step-picture").hidden = this.isLast;
    if (!this.isLast) paintPicture(byId("step-picture"), PICTURES[this.step]);
    byId("lesson-text").textContent = text;
    byId("lesson-next").textContent = button;
    byId("lesson-next").focus({ preventScroll: true });
  }

  // Begin, in the room that the step needs.
  act() {
    if (this.isLast) {
      this.stop();
      this.begin({ seat: "red", opponent: this.next(), settings: ROUND });
      return;
    }
    this.room = null;
    if (!this.begin({ seat: "red", ...STEPS[this.step].room, lesson: true })) return;
    this.held = false;
    byId("step").hidden = true;
    byId("lesson").hidden = false;
    byId("chart").hidden = true;
    this.drawnTick = null;
    this.isDrawn = false;
    this.ask();
    byId("arena").focus({ preventScroll: true });
  }

  // Show the task.
  ask() {
    const keys = "keys" in document.documentElement.dataset ? " Arrows move, Space draws." : "";
    const send = byId("on-lift").checked ? "" : " Then press Send.";
    say("lesson-task", `${this.step + 1} of ${STEPS.length}: ${STEPS[this.step].task}${keys}${send}`);
  }

  // Mark a circle [x, y, radius] on the board, in map widths; null hides it.
  mark(circle) {
    byId("goal").toggleAttribute("hidden", !circle);
    if (!circle) return;
    const [x, y, r] = circle;
    for (const [name, value] of Object.entries({ cx: x, cy: 1 - y, r })) byId("goal-circle").setAttribute(name, 100 * value);
  }

  // The game of a step is over: go on if the step is done, else try it again.
  over(isWon) {
    if (!this.running || this.isLast) return;
    const { isWon: hasToWin } = STEPS[this.step];
    if (this.isDrawn && (isWon || !hasToWin)) return this.go(this.step + 1, !isWon ? "" : hasToWin ? "You won. " : LUCKY);
    this.hold("Once more", "Draw the dashed circle at once, when the game begins, and leave it so.", "Try it");
  }

  sent(strokes) { this.isDrawn ||= this.running && strokes.length > 0; }

  // Go on if the step was done by a drawing, not by chance.
  watch(frame, seat) {
    if (!this.running || this.held || seat === null) return;
    this.mark(STEPS[this.step].goal);
    if (this.isDrawn) this.drawnTick ??= frame.tick;
    if (this.isDrawn && frame.tick - this.drawnTick >= EFFECT_TICKS && STEPS[this.step].done?.(frame)) this.go(this.step + 1);
  }
}

// Return the fraction of all drones that are red and at a place where isThere(x, y).
function share({ teams, positions }, isThere) {
  const drones = [...teams.keys()].filter((i) => teams[i] === 0 && isThere(positions[2 * i], positions[2 * i + 1]));
  return drones.length / teams.length;
}
