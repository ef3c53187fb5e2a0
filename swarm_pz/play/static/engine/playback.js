// A recorded game, shown from its own frames: docs/protocol.md#recordings. Nothing is simulated, so games of any
// control system and processor are shown as they were. Between frames drones accelerate evenly, as in the game.

import { Ground, TRAIL } from "./ground.js";
import { fieldsOf } from "./observation.js";
import { UNTIMED } from "./recording.js";
import { targetOf } from "./strokes.js";
import { decode, sizesOf } from "../frames.js";
import { SIDES, TICKS } from "../words.js";

const PROTOCOL = "swarm-pz.play.v2";
const PAST_TICKS = 9; // between the moments of trails
const EVERYTHING = new Float32Array(100).fill(1);

// Tell if capture fields have the default rules, by which the page can compute them from trails.
function hasOwnFields({ memory, capture, dynamics }) {
  return memory?.trail === TRAIL / TICKS && !memory.trail_forgotten_on?.length && capture?.threshold === 0.75
    && [undefined, "occupancy"].includes(capture.field) && !dynamics?.failure_rate;
}

export class Playback {
  tick = 0; ground; teams;

  // Throw an Error that says why a file cannot be shown.
  constructor(name, text) {
    const [header, ...lines] = text.split("\n").slice(0, -1).map((line) => JSON.parse(line)); // a last line that was cut short is left out
    if (header?.protocol !== PROTOCOL) throw new Error(`its first line must name the protocol ${PROTOCOL}`);
    const { game, speed } = header.table, { time_limit: limit } = game, [red, blue = red] = [game.drones_per_team].flat();
    this.seed = header.seed;
    this.frames = lines.filter(({ type }) => type === "frame").map(({ data }) => decode(Uint8Array.from(atob(data), (byte) => byte.charCodeAt(0)).buffer));
    if (!this.frames.length) throw new Error("it broke off before anything was to be seen");
    this.lastTick = this.frames.at(-1).tick;
    this.indices = new Uint32Array(this.lastTick + 1); // index of the latest frame at each tick
    this.frames.forEach(({ tick }, i) => this.indices.fill(i, tick, this.frames[i + 1]?.tick));
    this.captures = lines.filter(({ type }) => type === "captured");
    this.commands = commandsOf(lines);
    this.hasFields = hasOwnFields(game);
    const seats = SIDES.map((side) => {
      const { kind, policy, label = "" } = header[side];
      return { kind, name: policy, label, connected: true, gone: false };
    });
    const { outcome = null } = lines.findLast(({ type }) => type === "end") ?? {};
    const { reason = "" } = lines.find(({ type, event }) => type === "seat" && event === "forfeit") ?? {};
    // As in the message `room`.
    this.room = {
      code: "", phase: "replay", recording: name, red: seats[0], blue: seats[1], outcome,
      settings: { red, blue, speed, time_limit: limit >= UNTIMED ? null : limit }, last_tick: this.lastTick, forfeit: reason,
      sizes: Array.from({ length: Math.floor(this.lastTick / TICKS) + 1 }, (_, second) => sizesOf(this.teamsAt(TICKS * second))),
    };
    this.goTo(0);
  }

  teamsAt(tick) {
    const frame = this.frames[this.indices[tick]], teams = frame.teams.slice();
    if (frame.tick < tick) for (const { tick: at, drone, seat } of this.captures) if (at > frame.tick && at <= tick) teams[drone] = SIDES.indexOf(seat);
    return teams;
  }

  // Positions and velocities at a tick.
  motionAt(tick) {
    const index = this.indices[tick], from = this.frames[index], to = this.frames[index + 1], ticks = tick - from.tick;
    if (ticks <= 0 || !to) return from;
    const gap = to.tick - from.tick, positions = new Float32Array(from.positions.length), velocities = new Float32Array(positions.length);
    for (let i = 0; i < positions.length; i++) {
      const start = from.positions[i], velocity = from.velocities[i], gain = (to.velocities[i] - velocity) / gap;
      const moved = (count) => start + (count * velocity + gain * count * (count + 1) / 2) / TICKS;
      positions[i] = Math.min(Math.max(moved(ticks) + ticks / gap * (to.positions[i] - moved(gap)), 0), 1);
      velocities[i] = velocity + ticks * gain;
    }
    return { positions, velocities };
  }

  // Go to a tick. After a jump, the ground is rebuilt from the last TRAIL ticks.
  goTo(tick) {
    const until = Math.min(Math.max(tick, 0), this.lastTick);
    if (!this.ground || until < this.tick || until > this.tick + TRAIL) {
      this.tick = Math.max(until - TRAIL, 0);
      this.teams = this.teamsAt(this.tick);
      this.ground = new Ground(this.teams.length);
    }
    while (this.tick < until) {
      const { positions } = this.motionAt(this.tick + 1), { teams } = this, next = this.teamsAt(this.tick + 1);
      this.ground.extend(this.tick++, positions, teams);
      teams.forEach((team, drone) => { if (team !== next[drone]) this.ground.handOver(drone, team); });
      this.teams = next;
    }
  }

  // The present moment as a frame.
  get moment() {
    const { tick, teams, hasFields } = this;
    return { type: "frame", tick, serverMs: 0, ...this.motionAt(tick), teams, fields: hasFields ? fieldsOf(this) : null };
  }

  // Earlier frames, for the drones' trails.
  get past() {
    return this.frames.filter(({ tick }) => tick < this.tick && tick > this.tick - TRAIL && tick % PAST_TICKS === 0);
  }

  // The command that a team follows, if any.
  latest(team) { return this.commands.findLast((command) => command.team === team && command.tick < this.tick); }

  // The target of that command; uniform without a command, or for one of another kind.
  target(team) {
    const { number = 0, density } = this.latest(team) ?? {}, values = density?.flat() ?? [];
    return { type: "target", team, number, picture: targetOf(values.length === EVERYTHING.length ? values : EVERYTHING) };
  }
}

// Return the commands that came into force, in order. Numbers may restart: the latest command with a number counts.
function commandsOf(lines) {
  const densities = new Map(), keyOf = ({ seat, sender = "", number }) => `${seat} ${sender} ${number}`;
  return lines.flatMap((line) => {
    if (line.type === "command") densities.set(keyOf(line), line.density);
    if (line.type !== "in_force") return [];
    return [{ team: SIDES.indexOf(line.seat), tick: line.tick, number: line.number, density: densities.get(keyOf(line)) }];
  });
}
