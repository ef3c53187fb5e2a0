// A recorded game: hold it, go to any moment or capture of it, take over from there.

import { turningPoint, untilTheEnd } from "./chart.js";
import { clock } from "./news.js";

const at = (id) => document.getElementById(id);
const SIDES = ["Red", "Blue"];
const BEFORE_TICKS = 30; // a capture is seen from a moment before it on
const SEEK_EVERY_MS = 100; // the server takes so many messages a second and no more

export class Replay {
  constructor(link, chart) {
    this.link = link;
    this.chart = chart;
    this.held = false;
    at("hold").addEventListener("click", () => this.hold(!this.held));
    at("pace").addEventListener("change", () => this.hold(false));
    at("moment").addEventListener("input", () => {
      this.hold(true);
      this.tell();
      this.later ??= setTimeout(() => this.seek(), SEEK_EVERY_MS);
    });
    at("take-over").addEventListener("click", () => link.send({ type: "take_over", seat: at("take-side").value }));
  }

  show(room) {
    const isReplay = room.phase === "replay";
    at("scrubber").hidden = !isReplay;
    if (!isReplay) {
      this.chart.show(null);
      return;
    }
    this.list(untilTheEnd(room.sizes, room.outcome));
    at("pace").value = "1"; // as the server begins
    this.speed = 1;
    at("moment").max = room.last_tick;
    at("moment").value = 0;
    this.tell();
    at("take-over").disabled = !room.verified;
    at("take-over").title = room.verified ? "" : "This game plays differently on this machine.";
    this.hold(false);
  }

  // What each side gained in each second, as places to go to; and the turn, in the chart, too.
  list(sizes) {
    const turn = turningPoint(sizes), lines = [];
    this.chart.set(sizes, turn?.second ?? null);
    for (let second = 1; second < sizes.length; second++) {
      const gain = sizes[second][0] - sizes[second - 1][0];
      if (gain) lines.push(this.line(second - 1, gain, sizes[second], turn?.second === second));
    }
    at("log").replaceChildren(...lines);
  }

  line(second, gain, [red, blue], isTurn) {
    const line = document.createElement("li"), button = Object.assign(document.createElement("button"), { type: "button" });
    const shape = Object.assign(document.createElement("span"), { className: "shape" });
    const side = SIDES[gain < 0 ? 1 : 0], turn = isTurn ? ", the turn" : "";
    line.className = side.toLowerCase();
    button.append(shape, `${clock(30 * second)} ${side} +${Math.abs(gain)}: red ${red}, blue ${blue}${turn}`);
    button.addEventListener("click", () => {
      at("moment").value = Math.max(30 * second - BEFORE_TICKS, 0);
      this.tell();
      this.seek();
    });
    line.append(button);
    return line;
  }

  hold(held) {
    const speed = held ? 0 : Number(at("pace").value);
    if (speed !== this.speed) this.link.send({ type: "pace", speed });
    Object.assign(this, { held, speed });
    at("hold").textContent = held ? "Play" : "Pause";
    at("hold").setAttribute("aria-pressed", String(held));
  }

  seek() {
    this.later = null;
    this.link.send({ type: "seek", tick: Number(at("moment").value) });
  }

  follow(tick) {
    if (at("scrubber").hidden || this.held) return;
    at("moment").value = tick;
    this.tell();
  }

  tell() {
    const { value, max } = at("moment");
    this.chart.show(value / 30);
    at("moment").setAttribute("aria-valuetext", `${inWords(value)} of ${inWords(max)}`);
  }
}

function inWords(tick) {
  const seconds = Math.floor(tick / 30), minutes = Math.floor(seconds / 60);
  return `${minutes ? `${minutes} minutes ` : ""}${seconds % 60} seconds`;
}
