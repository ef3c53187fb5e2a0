// A recorded game: hold it, or go to any moment or capture of it.

import { turningPoint, untilTheEnd } from "./chart.js";
import { button, byId, make, on } from "./elements.js";
import { clock, NAMES, SIDES, TICKS } from "./words.js";

const BEFORE_TICKS = 30; // a capture is seen from a moment before it on
const STEPS = { arrowleft: -1, arrowright: 1 }, FRAME_TICKS = 3; // of an arrow, and with Shift
const SEEK_EVERY_MS = 100; // the server takes so many messages a second and no more

export class Replay {
  constructor(link, chart) {
    this.link = link;
    this.chart = chart;
    this.held = false;
    on("change", { pace: () => this.hold(false) });
    on("input", {
      moment: () => {
        this.hold(true);
        this.tell();
        this.later ??= setTimeout(() => this.seek(), SEEK_EVERY_MS);
      },
    });
    on("click", {
      hold: () => this.hold(!this.held),
      "capture-before": () => this.goTo(this.captures.findLast(({ tick }) => tick < byId("moment").value - BEFORE_TICKS / 2)?.tick ?? 0),
      "capture-after": () => this.goTo(this.captures.find(({ tick }) => tick > Number(byId("moment").value))?.tick),
      "save-recording": () => this.save(),
    });
  }

  // Show a room's recorded game, from a tick on.
  show(room, from) {
    const isReplay = room.phase === "replay";
    byId("scrubber").hidden = !isReplay;
    if (!isReplay) return this.chart.show(null);
    this.recording = room.recording;
    this.list(untilTheEnd(room));
    byId("pace").value = "1"; // as the server begins
    this.speed = 1;
    Object.assign(byId("moment"), { max: room.last_tick, value: 0 });
    this.tell();
    this.hold(false);
    if (from) this.goTo(from);
  }

  // What a key does; null for nothing. On a button the space is the button's.
  actOf(key, isFine, onButton) {
    if (key === " " && !onButton) return () => this.hold(!this.held);
    if (key === "arrowup" || key === "arrowdown") return () => byId(key === "arrowup" ? "capture-before" : "capture-after").click();
    if (!STEPS[key]) return null;
    return () => {
      if (isFine) this.hold(true);
      this.goTo(Number(byId("moment").value) + STEPS[key] * (isFine ? FRAME_TICKS : TICKS));
    };
  }

  goTo(tick) {
    if (tick === undefined) return;
    byId("moment").value = Math.min(Math.max(tick, 0), byId("moment").max);
    this.tell();
    this.seek();
  }

  // What each side gained in each second, as places to go to; and the turn, in the chart, too.
  list(sizes) {
    const turn = turningPoint(sizes);
    this.chart.set(sizes, turn);
    this.captures = [];
    for (let second = 1; second < sizes.length; second++) {
      const gain = sizes[second][0] - sizes[second - 1][0], tick = Math.max(TICKS * (second - 1) - BEFORE_TICKS, 0);
      if (gain) this.captures.push({ tick, line: this.line(tick, second - 1, gain, sizes[second], turn === second) });
    }
    byId("log").replaceChildren(...this.captures.map(({ line }) => line));
  }

  line(tick, second, gain, [red, blue], isTurn) {
    const team = gain < 0 ? 1 : 0;
    const text = `${clock(TICKS * second)} ${NAMES[team]} +${Math.abs(gain)}: red ${red}, blue ${blue}${isTurn ? ", the turn" : ""}`;
    return make("li", { className: SIDES[team] }, button([make("span", { className: "shape" }), text], () => this.goTo(tick)));
  }

  // Give what is watched as a file.
  async save() {
    const answer = await this.link.table.fetch(`recordings/${this.recording}`), href = URL.createObjectURL(await answer.blob());
    make("a", { href, download: this.recording }).click();
    setTimeout(() => URL.revokeObjectURL(href), 1000);
  }

  hold(held) {
    const speed = held ? 0 : Number(byId("pace").value);
    if (speed !== this.speed) this.link.send({ type: "pace", speed });
    this.held = held;
    this.speed = speed;
    byId("hold").textContent = held ? "Play" : "Pause";
    byId("hold").setAttribute("aria-pressed", String(held));
  }

  seek() {
    clearTimeout(this.later);
    this.later = null;
    this.link.send({ type: "seek", tick: Number(byId("moment").value) });
  }

  follow(tick) {
    if (byId("scrubber").hidden || this.held) return;
    byId("moment").value = tick;
    this.tell();
  }

  tell() {
    const { value, max } = byId("moment");
    this.chart.show(value / TICKS);
    const now = this.captures.findLast(({ tick }) => tick <= value)?.line;
    if (now !== this.now) {
      this.now?.setAttribute("aria-current", "false");
      now?.setAttribute("aria-current", "true");
      now?.scrollIntoView({ block: "nearest" });
      this.now = now;
    }
    byId("moment").setAttribute("aria-valuetext", `${inWords(value)} of ${inWords(max)}`);
  }
}

function inWords(tick) {
  const seconds = Math.floor(tick / TICKS), minutes = Math.floor(seconds / 60);
  return `${minutes ? `${minutes} minutes ` : ""}${seconds % 60} seconds`;
}
