// The first lesson: three steps. Each waits, with the board held, until one goes on; and again until it is done.

import { CIRCLE, CORNER, paintCard, paintDrawing, paintDrones, TIGHT } from "./cards.js";
import { byId, hear, on, say } from "./elements.js";
import { CELLS } from "./frames.js";
import { hatch } from "./ground.js";

const IN_CORNER = 0.35; // map widths from the corner that count as there
const SPREAD = 0.18; // mean distance of drones from their mean place that is no bunch
const NEAR = 0.2; // map widths from what was drawn within which a capture is the drawing's
const EFFECT_TICKS = 30; // after which a drawing can have had an effect
const STUCK_MS = 15_000, STUCK_SENDS = 3; // after which one is told what is wrong
const DRAWN = { time_limit: null, red_system: "ergodic", blue_system: "ergodic" }; // whatever else the table flies
const ALONE = { settings: { red: 12, blue: 0, ...DRAWN } };
const AGAINST = { opponent: "uniform", settings: { red: 12, blue: 5, speed: 0.5, ...DRAWN } };

const LEAVE_IT = "That is the place: now leave it so, your drones are on their way.";

const STEPS = [
  {
    title: "Draw where they should be",
    text: "You are red, the discs. Drag a short stroke in the top right corner: your drones fly there by themselves.",
    shows: CORNER,
    task: "Draw a short stroke in the top right corner.",
    goal: () => [1, 1, IN_CORNER],
    hint: (points) => (part(points, (x, y) => Math.hypot(1 - x, 1 - y) < IN_CORNER) < 0.7
      ? "Draw inside the dashed corner, and nowhere else: drones go to all that is drawn." : LEAVE_IT),
    room: ALONE,
    done: (frame) => share(frame, 0, (x, y) => Math.hypot(1 - x, 1 - y) < IN_CORNER) >= 0.6,
  },
  {
    title: "Go all around",
    text: "A bunch holds no more than the ground around itself. Draw a big circle around the middle: your drones spread along it.",
    shows: CIRCLE,
    task: "Draw a big circle around the middle.",
    goal: () => [0.5, 0.5, 0.27],
    hint: (points) => (part(points, (x, y) => Math.abs(Math.hypot(x - 0.5, y - 0.5) - 0.27) < 0.12) < 0.7 || !surrounds(points)
      ? "Follow the dashed circle all the way around, in one stroke." : LEAVE_IT),
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
    goal: nearestBlue,
    hint: (points, frame) => {
      const [x, y] = nearestBlue(frame) ?? [0.5, 0.5];
      return part(points, (px, py) => Math.hypot(px - x, py - y) < NEAR) < 0.3
        ? "Draw around the blue drone in the dashed circle: your drones must fly where it is."
        : "Right there. Your ground needs some seconds; if the blue drone has gone, draw around it anew.";
    },
    room: AGAINST,
    done: (frame, captured) => captured.some((drone) => frame.teams[drone] === 0),
  },
];

export class Lesson {
  // begin: opens a room by a message and begins in it at once; home: leads back to the start.
  constructor(link, { begin, home }) {
    this.link = link;
    this.begin = begin;
    this.step = -1;
    this.room = this.setting = null; // where it goes on, and what its step needs
    this.held = this.isOver = false;
    this.try();
    hear(link, {
      seated: ({ room }) => { this.room ??= this.running ? room : null; },
      refused: ({ about }) => {
        if (about !== "create" || !this.running) return;
        this.setting = null;
        this.go(this.step);
      },
    });
    on("click", { "lesson-next": () => this.act(), "lesson-leave": home, "lesson-skip": () => this.go(this.step + 1) });
    on("change", { "on-lift": () => { if (this.running && !this.held) this.ask(); } });
  }

  get running() { return this.step >= 0; }

  get isLast() { return this.step === STEPS.length; }

  start() {
    if (this.running) return;
    this.room = this.setting = null;
    this.isOver = false;
    this.go(0);
  }

  // Begin anew with what is drawn, and with help.
  try() {
    this.drawn = this.sinceMs = null;
    this.hinted = undefined;
    this.sends = 0;
  }

  stop() {
    this.step = -1;
    this.held = false;
    byId("lesson").hidden = byId("step").hidden = true;
    this.mark(null);
    byId("chart").hidden = false;
  }

  // Hold the board, and say what comes next.
  go(step) {
    this.step = step;
    const { title, text } = STEPS[step] ?? {
      title: "That is the game",
      text: "Draw, send, look, and draw anew. Own every drone to win; after five minutes it is a draw.",
    };
    this.hold(this.isLast ? title : `${step + 1} of ${STEPS.length}: ${title}`, text, this.isLast ? "Play a game" : "Try it");
  }

  hold(title, text, button) {
    this.held = true;
    byId("step").hidden = false;
    byId("lesson").hidden = true;
    this.mark(null);
    byId("step-title").textContent = title;
    this.paint(STEPS[this.step]);
    byId("lesson-text").textContent = text;
    byId("lesson-next").textContent = button;
    byId("lesson-next").focus({ preventScroll: true });
  }

  // What is to be drawn in a step, and what comes of it.
  paint(step) {
    byId("step-picture").hidden = !step;
    if (!step) return;
    const canvas = byId("step-picture"), pen = canvas.getContext("2d"), zoom = step.holds ? 2 : 1, shift = (1 - zoom) / 2 * canvas.width;
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
    const { room } = STEPS[this.step];
    if (this.setting !== room) {
      this.setting = this.room = null;
      if (!this.begin({ seat: "red", ...room, lesson: true })) return;
      this.setting = room;
    } else if (this.isOver) this.link.send({ type: "ready" });
    this.isOver = this.held = false;
    byId("step").hidden = true;
    byId("lesson").hidden = false;
    byId("chart").hidden = true;
    this.try();
    this.ask();
    byId("arena").focus({ preventScroll: true });
  }

  // What is to be done, and what is wrong with what was done so far.
  ask(hint = "") {
    const { task } = STEPS[this.step], send = byId("on-lift").checked ? "" : " Then press Send.";
    say("lesson-task", `${this.step + 1} of ${STEPS.length}: ${hint || task}${hint ? "" : send}`);
  }

  // Where it is to be done, as a circle in map widths; null nowhere.
  mark(circle) {
    byId("goal").toggleAttribute("hidden", !circle);
    if (!circle) return;
    const [x, y, r] = circle;
    for (const [name, value] of Object.entries({ cx: x, cy: 1 - y, r })) byId("goal-circle").setAttribute(name, 100 * value);
  }

  // Tell who does not get on what is wrong: once for each drawing, when it can have had an effect.
  help(frame) {
    const { drawn } = this;
    this.sinceMs ??= performance.now();
    const isStuck = this.sends >= STUCK_SENDS || performance.now() - this.sinceMs > STUCK_MS;
    if (!isStuck || this.hinted === drawn) return;
    this.hinted = drawn;
    this.ask(STEPS[this.step].hint(drawn?.points ?? [], frame));
  }

  // The game ended before the step was done: another one goes on with it.
  over() {
    if (!this.running || this.isLast) return;
    this.isOver = true;
    this.hold("Once more", "All drones are on one side, and not by a drawing of yours. Try it again.", "Try it");
  }

  sent(strokes) {
    if (!this.running || !strokes.length) return;
    this.drawn = { points: strokes.flatMap(({ points }) => points), tick: null };
    this.sends++;
  }

  // Look whether the step is done, by what was drawn and not by chance.
  watch(frame, captured, seat) {
    if (!this.running || this.held || seat === null) return;
    this.mark(STEPS[this.step].goal(frame));
    if (this.drawn) this.drawn.tick ??= frame.tick;
    const mayTell = !this.drawn || frame.tick - this.drawn.tick >= EFFECT_TICKS;
    if (mayTell && this.drawn && this.isDone(frame, captured)) this.go(this.step + 1);
    else if (mayTell) this.help(frame);
  }

  isDone(frame, captured) {
    const there = captured.filter((drone) => this.drawn.points.some(
      ([x, y]) => Math.hypot(frame.positions[2 * drone] - x, frame.positions[2 * drone + 1] - y) < NEAR,
    ));
    return STEPS[this.step].done(frame, there);
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

// The part of a drawing's points that is somewhere.
function part(points, isThere) { return points.filter(([x, y]) => isThere(x, y)).length / Math.max(points.length, 1); }

// Whether a drawing leads most of the way around the middle.
function surrounds(points) {
  return new Set(points.map(([x, y]) => Math.floor(Math.atan2(y - 0.5, x - 0.5) / (Math.PI / 4)))).size >= 6;
}

// A circle around the blue drone that is nearest to the red ones.
function nearestBlue(frame) {
  const reds = own(frame, 0), far = ([x, y]) => Math.min(...reds.map(([a, b]) => Math.hypot(a - x, b - y)));
  const [nearest] = own(frame, 1).sort((one, other) => far(one) - far(other));
  return nearest ? [...nearest, 0.1] : null;
}

function spread(frame, team) {
  const places = own(frame, team), count = Math.max(places.length, 1);
  const [x, y] = [0, 1].map((axis) => places.reduce((sum, place) => sum + place[axis], 0) / count);
  return places.reduce((sum, place) => sum + Math.hypot(place[0] - x, place[1] - y), 0) / count;
}

// Ground where red captures: columns of the board's cells, by row.
function paintHolds(canvas, rows) {
  const pen = canvas.getContext("2d"), size = canvas.width / CELLS;
  pen.fillStyle = hatch(pen, 0, 1);
  for (const [row, columns] of Object.entries(rows)) {
    for (const column of columns) pen.fillRect(column * size, (CELLS - 1 - Number(row)) * size, size, size);
  }
}
