// The first lesson: three steps. Each waits, with the board held, until one goes on; and again until it is done.

import { CIRCLE, CORNER, paintCard, paintDrawing, paintDrones, paintHolds, TIGHT } from "./cards.js";

const at = (id) => document.getElementById(id);
const IN_CORNER = 0.35; // map widths from the corner that count as there
const SPREAD = 0.18; // mean distance of drones from their mean place that is no bunch
const NEAR = 0.2; // map widths from what was drawn within which a capture is the drawing's
const EFFECT_TICKS = 30; // after which a drawing can have had an effect
const ALONE = { settings: { red: 12, blue: 0, time_limit: null } };
const AGAINST = { opponent: "uniform", settings: { red: 12, blue: 5, speed: 0.5, time_limit: null } };

const STEPS = [
  {
    title: "Draw where they should be",
    text: "You are red, the discs. Drag a short stroke in the top right corner and send it: your drones fly there by themselves.",
    shows: CORNER,
    task: "Draw in the top right corner, and send it.",
    room: ALONE,
    done: (frame) => share(frame, 0, (x, y) => Math.hypot(1 - x, 1 - y) < IN_CORNER) >= 0.6,
  },
  {
    title: "Spread out",
    text: "A bunch holds no more than the ground around itself. Draw a big circle around the middle: your drones spread along it.",
    shows: CIRCLE,
    task: "Draw a big circle around the middle, and send it.",
    room: ALONE,
    done: (frame) => share(frame, 0, (x, y) => Math.abs(Math.hypot(x - 0.5, y - 0.5) - 0.25) < 0.2) >= 0.6
      && spread(frame, 0) > SPREAD,
  },
  {
    title: "Make one change sides",
    text: "Filled ground is yours: around it your drones flew most in the last five seconds. A blue drone on it turns red. "
      + "Blue has such ground, too, and yours turn blue there. Draw a ring around blue drones.",
    shows: TIGHT,
    flown: [[52, 65], [34, 53], [48, 34], [66, 48]], // red drones, in hundredths
    meets: [[61, 63], [49, 51], [71, 31]], // blue ones: caught, safe in the middle, and on its way
    holds: { // cells by row that such a ring held in a game after twelve seconds
      17: [20, 27, 31], 18: [20, 27, 31], 19: [20, 21, 27, 29, 31], 20: [21, 23, 24, 27, 29], 21: [17, 19, 20, 21, 23,
      27, 28, 29], 22: [17, 19, 21, 28], 23: [21, 28, 30, 31, 32], 24: [21], 25: [17, 21, 28], 26: [31], 27: [21, 30,
      31, 32], 30: [19, 20, 21, 30], 31: [21, 22, 30], 32: [29, 30], 33: [30], 34: [18, 26],
    },
    task: "Draw a ring around blue drones, and again as they move, until one turns red there.",
    room: AGAINST,
    done: (frame, captured) => captured.some((drone) => frame.teams[drone] === 0),
  },
];

export class Lesson {
  // begin: opens a room by a message and begins in it at once; home: leads back to the start.
  constructor(link, { begin, home }) {
    Object.assign(this, { link, begin, home, step: -1, room: null, held: false });
    link.addEventListener("seated", ({ detail }) => { this.room ??= this.running ? detail.room : null; });
    link.addEventListener("refused", ({ detail }) => {
      if (detail.about !== "create" || !this.running) return;
      this.setting = null;
      this.go(this.step);
    });
    at("lesson-next").addEventListener("click", () => this.act());
    at("lesson-leave").addEventListener("click", home);
  }

  get running() { return this.step >= 0; }

  get isLast() { return this.step === STEPS.length; }

  start() {
    if (this.running) return;
    Object.assign(this, { room: null, setting: null, isOver: false });
    this.go(0);
  }

  stop() {
    Object.assign(this, { step: -1, held: false });
    at("lesson").hidden = at("step").hidden = true;
    at("chart").hidden = false;
  }

  // Hold the board, and say what comes next.
  go(step) {
    this.step = step;
    const { title, text } = STEPS[step] ?? {
      title: "That is the game",
      text: "Draw, send, look, and draw anew. Who owns every drone wins; after five minutes it is a draw.",
    };
    this.hold(this.isLast ? title : `${step + 1} of ${STEPS.length}: ${title}`, text, this.isLast ? "Play a game" : "Try it");
  }

  hold(title, text, button) {
    Object.assign(this, { held: true, drawn: null });
    at("step").hidden = false;
    at("lesson").hidden = true;
    at("step-title").textContent = title;
    this.paint(STEPS[this.step]);
    at("lesson-text").textContent = text;
    at("lesson-next").textContent = button;
    at("lesson-next").focus({ preventScroll: true });
  }

  // What is to be drawn in a step, and what comes of it.
  paint(step) {
    at("step-picture").hidden = !step;
    if (!step) return;
    const canvas = at("step-picture"), pen = canvas.getContext("2d"), zoom = step.holds ? 2 : 1, shift = (1 - zoom) / 2 * canvas.width;
    pen.setTransform(zoom, 0, 0, zoom, shift, shift);
    paintCard(canvas, { target: ["0"], drones: [] });
    paintDrawing(canvas, step.shows, step.holds ? 0 : step.shows === CORNER ? 3 : 9);
    if (!step.holds) return;
    paintHolds(canvas, step.holds);
    paintDrones(canvas, 0, step.flown);
    paintDrones(canvas, 1, step.meets);
  }

  // Let the board go on, in the room that the step needs.
  act() {
    if (this.isLast) {
      this.stop();
      this.begin({ seat: "red", opponent: "uniform" });
      return;
    }
    const { room, task } = STEPS[this.step];
    if (this.setting !== room) {
      Object.assign(this, { setting: null, room: null });
      if (!this.begin({ seat: "red", ...room, lesson: true })) return;
      this.setting = room;
    } else if (this.isOver) this.link.send({ type: "ready" });
    this.isOver = this.held = false;
    at("step").hidden = true;
    at("lesson").hidden = false;
    at("chart").hidden = true;
    at("lesson").textContent = `${this.step + 1} of ${STEPS.length}: ${task}`;
    at("arena").focus({ preventScroll: true });
  }

  // The game ended before the step was done: another one goes on with it.
  over() {
    if (!this.running || this.isLast) return;
    this.isOver = true;
    this.hold("Once more", "All drones are on one side, and not by a drawing of yours. Try it again.", "Try it");
  }

  sent(strokes) { if (this.running && strokes.length) this.drawn = { points: strokes.flatMap(({ points }) => points), tick: null }; }

  // Look whether the step is done, by what was drawn and not by chance.
  watch(frame, captured, seat) {
    if (!this.running || this.held || seat === null || !this.drawn) return;
    this.drawn.tick ??= frame.tick;
    if (frame.tick - this.drawn.tick < EFFECT_TICKS) return;
    const there = captured.filter((drone) => this.drawn.points.some(
      ([x, y]) => Math.hypot(frame.positions[2 * drone] - x, frame.positions[2 * drone + 1] - y) < NEAR,
    ));
    if (STEPS[this.step].done(frame, there)) this.go(this.step + 1);
  }
}

function own(frame, team) {
  const places = [];
  frame.teams.forEach((of, i) => { if (of === team) places.push([frame.positions[2 * i], frame.positions[2 * i + 1]]); });
  return places;
}

function share(frame, team, isThere) {
  const places = own(frame, team);
  return places.filter(([x, y]) => isThere(x, y)).length / Math.max(places.length, 1);
}

function spread(frame, team) {
  const places = own(frame, team), count = Math.max(places.length, 1);
  const [x, y] = [0, 1].map((axis) => places.reduce((sum, place) => sum + place[axis], 0) / count);
  return places.reduce((sum, place) => sum + Math.hypot(place[0] - x, place[1] - y), 0) / count;
}
