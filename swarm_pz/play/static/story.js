// Why a game was won or lost: how many drones stood close together when drones were captured, computed from the frames.

import { NAMES, SIDES, TICKS } from "./words.js";

const REACH = 0.1; // map widths; drones this near to one drone are within a fifth of the board of each other
const JUMP_TICKS = 30; // what happened between frames farther apart was not seen
export const DECISIVE_S = 5; // seconds before a turn that decided it

export class Story {
  constructor() { this.forget(); }

  forget() {
    this.captures = [];
    this.since = this.tick = -Infinity; // from when on all was seen
  }

  // Drones that changed sides in a frame.
  take(captured, { tick, teams, positions }) {
    if (tick > this.tick + JUMP_TICKS) this.since = tick;
    this.tick = tick;
    for (const team of [0, 1]) {
      const taken = captured.filter((drone) => teams[drone] === team);
      if (!taken.length) continue;
      const losers = [...teams.keys()].filter((drone) => teams[drone] !== team || taken.includes(drone));
      const far = (i, j) => Math.hypot(positions[2 * i] - positions[2 * j], positions[2 * i + 1] - positions[2 * j + 1]);
      const crowd = Math.max(...taken.map((drone) => losers.filter((other) => far(drone, other) <= REACH).length));
      this.captures.push({ tick, team, taken: taken.length, crowd, of: losers.length });
    }
  }

  // What a team's captures before a turn had in common, to who sits in a seat; nothing if not all was seen.
  why(team, second, seat) {
    const within = (span) => this.captures.filter(({ tick }) => tick > TICKS * (second - span) && tick <= TICKS * second);
    const gained = (span) => within(span).reduce((sum, one) => sum + (one.team === team ? one.taken : -one.taken), 0);
    let span = Math.min(DECISIVE_S, second); // or as many of them as ended with a gain
    while (span > 0 && gained(span) <= 0) span--;
    if (!span || this.since > Math.max(TICKS * (second - span), TICKS)) return "";
    const gain = gained(span), drones = gain === 1 ? "1 drone" : `${gain} drones`, time = span === 1 ? "a second" : `${span} seconds`;
    const own = within(span).filter((one) => one.team === team), most = own.reduce((a, b) => (b.crowd / b.of > a.crowd / a.of ? b : a));
    const who = seat === team ? "you" : SIDES[team], whose = seat === 1 - team ? "your" : `${SIDES[1 - team]}’s`;
    if (most.crowd >= 3 && 3 * most.crowd >= most.of) {
      return `${most.crowd} of ${whose} ${most.of} drones stood within a fifth of the board’s width; ${who} had flown around them, and gained ${drones} in ${time}.`;
    }
    const Who = seat === team ? "You" : NAMES[team];
    return `${Who} gained ${drones} in ${time}, on ground that ${who} had flown around.`;
  }
}
