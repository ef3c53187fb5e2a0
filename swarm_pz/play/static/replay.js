// A recorded game: hold it, go to any moment or capture of it, take over from there.

import { turningPoint, untilTheEnd } from "./chart.js";
import { button, byId, make, on } from "./elements.js";
import { clock, NAMES, SIDES } from "./words.js";

const BEFORE_TICKS = 30; // a capture is seen from a moment before it on
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
      "take-over": () => {
        if (this.later) this.seek(); // from the moment that was chosen
        link.send({ type: "take_over", seat: byId("take-side").value });
      },
    });
  }

  show(room) {
    const isReplay = room.phase === "replay";
    byId("scrubber").hidden = !isReplay;
    if (!isReplay) {
      this.chart.show(null);
      return;
    }
    this.list(untilTheEnd(room.sizes, room.outcome));
    byId("pace").value = "1"; // as the server begins
    this.speed = 1;
    Object.assign(byId("moment"), { max: room.last_tick, value: 0 });
    this.tell();
    byId("take-over").disabled = !room.verified;
    byId("take-over").title = room.verified ? "" : "This game plays differently on this machine.";
    this.hold(false);
  }

  // What each side gained in each second, as places to go to; and the turn, in the chart, too.
  list(sizes) {
    const turn = turningPoint(sizes)?.second ?? null, lines = [];
    this.chart.set(sizes, turn);
    for (let second = 1; second < sizes.length; second++) {
      const gain = sizes[second][0] - sizes[second - 1][0];
      if (gain) lines.push(this.line(second - 1, gain, sizes[second], turn === second));
    }
    byId("log").replaceChildren(...lines);
  }

  line(second, gain, [red, blue], isTurn) {
    const team = gain < 0 ? 1 : 0;
    const text = `${clock(30 * second)} ${NAMES[team]} +${Math.abs(gain)}: red ${red}, blue ${blue}${isTurn ? ", the turn" : ""}`;
    return make("li", { className: SIDES[team] }, button([make("span", { className: "shape" }), text], () => {
      byId("moment").value = Math.max(30 * second - BEFORE_TICKS, 0);
      this.tell();
      this.seek();
    }));
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
    this.chart.show(value / 30);
    byId("moment").setAttribute("aria-valuetext", `${inWords(value)} of ${inWords(max)}`);
  }
}

function inWords(tick) {
  const seconds = Math.floor(tick / 30), minutes = Math.floor(seconds / 60);
  return `${minutes ? `${minutes} minutes ` : ""}${seconds % 60} seconds`;
}
