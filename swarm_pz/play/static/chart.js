// Team sizes over time: red from below, blue from above, each with its team's sign.

import { make } from "./elements.js";
import { TICKS } from "./words.js";

const SHORTEST_S = 30;
const LINE_PX = 1.5; // between the teams
export const SWING_S = 5;

export class Chart {
  border; blue; mark; sizes; marked; span;

  constructor(element) {
    this.element = element;
    [this.border, this.blue, this.mark] = ["border", "dotted", "mark"].map((className) => make("i", { className }));
    this.played = make("div", { className: "striped" }, this.border, this.blue, this.mark);
    this.cursor = make("i", { className: "cursor", hidden: true });
    element.append(this.played, this.cursor);
    this.set([]);
  }

  // Show sizes of red and blue, one entry a second; `marked` is a second to mark, `span` its seconds (0: so far).
  set(sizes, marked = null, span = 0) {
    Object.assign(this, { sizes: sizes.map((entry) => [...entry]), marked, span });
    this.paint();
  }

  add(tick, red, blue) {
    const second = Math.floor(tick / TICKS);
    if (this.sizes[second]?.[0] === red) return;
    while (this.sizes.length < second) this.sizes.push([...(this.sizes.at(-1) ?? [red, blue])]);
    this.sizes[second] = [red, blue];
    this.paint();
  }

  // Mark the moment of a recorded game that is shown; null removes the mark.
  show(seconds) {
    this.cursor.hidden = seconds === null;
    this.cursor.style.left = `${100 * seconds / this.span}%`;
    this.tell(this.sizes[Math.floor(seconds)]);
  }

  paint() {
    const { sizes, marked, span } = this, count = sizes.length, height = ([red, blue]) => 100 * blue / (red + blue || 1);
    const corners = sizes.flatMap((entry, i) => [i, i + 1].map((second) => `${100 * second / count}% calc(${height(entry)}%`));
    const above = (px) => `polygon(0 0, ${corners.map((corner) => `${corner} + ${px}px)`).join()}, 100% 0)`;
    this.played.style.width = `${100 * count / (span || Math.max(count, SHORTEST_S))}%`;
    this.border.style.clipPath = above(LINE_PX);
    this.blue.style.clipPath = above(0);
    this.mark.hidden = marked === null;
    if (marked !== null) Object.assign(this.mark.style, { left: `${100 * (marked + 0.5) / count}%`, backgroundPositionY: `${height(sizes[marked])}%` });
    this.tell(sizes.at(-1));
  }

  tell([red, blue] = [0, 0]) { this.element.setAttribute("aria-label", `Team sizes over time: now red ${red}, blue ${blue}`); }
}

// Tell if a room's game lasted until its time limit.
export function timeIsUp({ sizes, settings }) { return settings.time_limit !== null && sizes.length > settings.time_limit; }

// Return sizes once a second; a game won before its time limit also gets its final sizes, as its last second is not whole.
export function untilTheEnd(room) {
  const { sizes, outcome } = room;
  if (!sizes.length || !["red", "blue"].includes(outcome) || timeIsUp(room)) return [...sizes];
  const all = sizes[0][0] + sizes[0][1];
  return [...sizes, outcome === "red" ? [all, 0] : [0, all]];
}

// Return the second from which the winner led for good, from sizes of red and blue once a second. If the winner led all
// along, return the second after its greatest gain; null for a draw.
export function turningPoint(sizes) {
  const leads = sizes.map(([red, blue]) => red - blue), sign = Math.sign(leads.at(-1) ?? 0);
  if (sign === 0) return null;
  const behind = leads.findLastIndex((lead) => lead * sign <= 0);
  if (behind > 0) return Math.min(behind + 1, leads.length - 1);
  const gains = leads.map((lead, i) => sign * (lead - leads[Math.max(i - SWING_S, 0)]));
  const best = Math.max(0, ...gains);
  return best > 0 ? gains.indexOf(best) : null;
}
