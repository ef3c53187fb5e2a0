// The first lesson: a game at half speed in which one thing after the other is tried.

const at = (id) => document.getElementById(id);
const IN_CORNER = 0.35; // map widths from the corner that count as there
const SPREAD = 0.18; // mean distance of drones from their mean place that is no bunch

export class Lesson {
  constructor(link, leave) {
    Object.assign(this, { link, step: -1, room: null });
    link.addEventListener("seated", ({ detail }) => { this.room ??= this.running ? detail.room : null; });
    link.addEventListener("refused", ({ detail }) => { if (detail.about === "create") this.stop(); });
    at("lesson-next").addEventListener("click", leave);
  }

  steps() {
    return [
      {
        text: "You are red. Draw a short stroke in the top right corner and press Send: your drones go there.",
        done: (frame) => this.wasSent && share(frame, 0, (x, y) => Math.hypot(1 - x, 1 - y) < IN_CORNER) >= 0.6,
      },
      {
        text: "But a bunch is easy prey. Draw a big circle around the middle and send it: your drones spread along it.",
        done: (frame) => this.wasSent && share(frame, 0, (x, y) => Math.abs(Math.hypot(x - 0.5, y - 0.5) - 0.25) < 0.2) >= 0.6
          && spread(frame, 0) > SPREAD,
      },
      {
        text: "Striped ground is yours: a blue drone on it changes sides. Dotted ground is blue's. "
          + "Draw rings around blue drones until two are yours.",
        done: () => this.taken >= 2,
      },
      {
        text: "That is all: draw, send, surround, and don't bunch up. Now play a game.",
        last: true,
        done: () => false,
      },
    ];
  }

  get running() { return this.step >= 0; }

  start() {
    if (this.running) return;
    this.plan = this.steps();
    this.taken = 0;
    this.room = null;
    this.go(0);
    this.link.send({
      type: "create", seat: "red", opponent: "uniform", settings: { red: 12, blue: 5, speed: 0.5, time_limit: null },
    });
  }

  stop() {
    this.step = -1;
    at("lesson").hidden = true;
    at("chart").hidden = false;
  }

  go(step) {
    this.step = step;
    this.wasSent = false;
    const { text, last } = this.plan[step];
    at("lesson").hidden = false;
    at("chart").hidden = true;
    at("lesson-text").textContent = `${step + 1} of ${this.plan.length}: ${text}`;
    at("lesson-next").hidden = !last;
  }

  // The game ended before the lesson did: another one goes on with it.
  over() { if (this.running && !this.plan[this.step].last) this.link.send({ type: "ready" }); }

  sent(strokes) { if (this.running && strokes.length) this.wasSent = true; }

  watch(frame, captured, seat) {
    if (!this.running || seat === null) return;
    this.taken += captured.filter((drone) => frame.teams[drone] === seat).length;
    const blue = frame.teams.reduce((sum, team) => sum + team, 0);
    if (blue === 0 && !this.plan[this.step].last) this.go(this.plan.length - 1);
    else if (this.plan[this.step].done(frame)) this.go(this.step + 1);
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
