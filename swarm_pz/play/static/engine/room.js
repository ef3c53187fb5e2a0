// A room of one visitor, who plays against a policy or practises alone. Messages are those of swarm_pz/play/server.

import { check, GAME, Refused, SETTINGS } from "./checks.js";
import { CELLS } from "./controller.js";
import { Game, PERIOD } from "./game.js";
import { loadPlayer, PLAYERS } from "./players.js";
import { fieldsOf } from "./observation.js";
import { headerOf } from "./recording.js";
import { densityOf, targetOf } from "./strokes.js";
import { encode, momentOf, TARGET } from "../frames.js";
import { SIDES, TICKS } from "../words.js";

const STEPS = 1e8; // a command's values are rounded to 1 / STEPS
const CATCH_UP = 2; // ticks that a late game may run at once
const HELD_MS = 100; // between two checks of a paused game
const EVERYTHING = new Float32Array(CELLS * CELLS).fill(1);
export const UNVARIED = { command_delay_ms: 0, display_delay_ms: 0, frame_rate: 30, speed: 1, hide: [], share: 0, helper: "" };

export function now() { return performance.timeOrigin + performance.now(); }

function later(act, ms) {
  if (ms > 0) setTimeout(act, ms);
  else act();
}

// Scale a density to a maximum of 1 and round it, as it is followed and recorded.
function rounded(values) {
  const most = Math.max(...values) || 1;
  return Array.from(values, (value) => Math.round(value / most * STEPS) / STEPS);
}

// Return the state of a seat, as in the message `room`.
function seatOf({ kind = "free", policy = "", label = "", ready = false, state = null, reason = "" }) {
  return { kind, name: policy, label, connected: kind !== "free", ready, policy_state: state, reason, gone: false };
}

export class Room {
  phase = "waiting"; sizes = []; games = 0; game; log; player; loading; recording = null; outcome = null; endedBy = null;

  table; code; once; lesson; seed;

  // message is the one that opens the room.
  constructor(table, code, message) {
    const { settings = {}, seat = "red", opponent = null, label = "", once = false, lesson = false, seed = null } = message;
    const { red = 10, blue = 10, time_limit: limit = 300, speed, majority } = settings;
    check({ seed, seat }, GAME);
    check(settings, SETTINGS);
    if (opponent !== null && !PLAYERS.includes(opponent)) throw new Refused("unknown", `there is no policy '${opponent}' here`);
    Object.assign(this, { table, code, once, lesson, seed });
    this.settings = {
      red, blue, time_limit: limit, red_system: "ergodic", blue_system: "ergodic",
      speed: table.factors.find((own) => own.speed !== 1)?.speed ?? speed ?? 1, ...(majority && red && blue ? { majority } : {}),
    };
    this.interval = Math.ceil(10 * table.interval - 1e-6) * PERIOD;
    this.team = SIDES.indexOf(seat); // of the visitor
    this.view = table.factors[this.team];
    const other = SIDES[1 - this.team];
    if (!this.settings[seat] || (this.settings[other] > 0) !== (opponent !== null)) {
      throw new Refused("not_valid", `an opponent leads the drones of ${other} if there are any, and you those of ${seat}: nobody else can come in here`);
    }
    /** @type {any[]} */
    this.seats = [{}, {}];
    this.seats[this.team] = { kind: table.kind, label };
    if (opponent !== null) this.seats[1 - this.team] = this.load(opponent);
    this.token = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
  }

  get isOn() { return this.phase === "starting" || this.phase === "playing"; }

  // --- the visitor ------------------------------------------------------------------------------------

  load(policy) {
    const seat = { kind: "policy", policy, ready: true, state: "loading" };
    this.loading = loadPlayer(policy).then((player) => {
      this.player = player;
      seat.state = "loaded";
    }, (error) => Object.assign(seat, { state: "failed", reason: error.message })).then(() => { if (this.table.room === this) this.beginIfReady(); });
    return seat;
  }

  enter() {
    const { hide, frame_rate: rate } = this.view, isVaried = hide.length || rate < UNVARIED.frame_rate;
    const factors = isVaried ? { hide, frame_rate: rate } : null;
    this.say({ type: "seated", room: this.code, seat: SIDES[this.team], token: this.token, commands: this.table.commands, factors });
    this.tell();
  }

  leave() {
    this.note("disconnected");
    if (this.phase === "playing") this.stop("stopped", "left");
    else this.phase = "over";
  }

  note(event) {
    if (this.isOn) this.log.push({ type: "seat", seat: SIDES[this.team], event, server_ms: now(), ...(event === "connected" ? { client: this.table.client } : {}) });
  }

  // Send a message after the visitor's display delay, if they are still here.
  say(message) { later(() => { if (this.table.room === this) this.table.say(message); }, this.view.display_delay_ms); }

  tell() {
    const { code, phase, settings, once, outcome, recording, endedBy, view } = this, [red, blue] = this.seats.map(seatOf);
    const ended = phase === "over" ? { outcome, recording, ended_by: endedBy } : { outcome: null, recording: null, ended_by: null };
    this.say({
      type: "room", code, phase, settings, red, blue, once, ...ended, sizes: [...this.sizes], wins: [0, 0], forfeit: "",
      paused: this.isOn && this.isPaused, starts_ms: phase === "starting" ? this.beganMs + view.display_delay_ms : null,
    });
  }

  // Send the present frame if the frame rate allows it; first and last frames are always sent.
  show(isFirst = false) {
    const { game } = this, { hide, frame_rate: rate, display_delay_ms: delay } = this.view, isWhole = isFirst || game.isOver;
    const count = (tick) => Math.floor(tick * rate / (TICKS * this.settings.speed));
    this.hasFields ||= isWhole || game.tick % PERIOD === 0;
    if (!isWhole && rate < UNVARIED.frame_rate && count(game.tick) === count(game.tick - 1)) return;
    const fields = this.hasFields && !hide.includes("ground") ? fieldsOf(game) : null, hidden = hide.includes("opponents") ? 1 - this.team : -1;
    this.hasFields = false;
    this.say(momentOf(game, now() + delay, fields, hidden));
  }

  showTarget(number, density) {
    if (!this.view.hide.includes("target")) this.say({ type: TARGET, team: this.team, number, picture: targetOf(density) });
  }

  // --- how its games begin and end --------------------------------------------------------------------

  ready() {
    const failed = this.seats.find(({ state }) => state === "failed");
    if (this.phase === "playing" || (this.once && this.phase === "over")) throw new Refused("out_of_turn", "the game runs, or was the only one here");
    if (failed) throw new Refused("not_valid", `${failed.policy} cannot play: ${failed.reason}`);
    this.seats[this.team].ready = true;
    this.beginIfReady();
  }

  pause(isPaused) {
    if (this.once) throw new Refused("out_of_turn", "a game that is the only one here cannot be paused");
    this.isPaused = isPaused;
    this.tell();
  }

  beginIfReady() {
    const canPlay = this.seats.every(({ kind, ready, state = "loaded" }) => !kind || (ready && state === "loaded"));
    if (canPlay && !this.isOn) this.begin();
    else this.tell();
  }

  begin() {
    const { red, blue, time_limit: limit } = this.settings, ms = 1000 * this.table.countdown;
    this.seed ??= crypto.getRandomValues(new Uint32Array(1))[0];
    const game = this.game = new Game({ red, blue, timeLimit: limit ?? 1e6 }, this.seed);
    this.sizes = [[...game.sizes]];
    this.inForce = [-this.interval, -this.interval];
    this.waiting = [null, null];
    this.isPaused = false;
    this.phase = "starting";
    this.beganMs = now() + ms;
    this.log = [this.frameMessage()];
    this.note("connected");
    this.tell();
    this.show(true);
    this.showTarget(0, EVERYTHING);
    setTimeout(() => { if (this.game === game && this.phase === "starting") this.start(); }, ms);
  }

  start() {
    const { table, settings, lesson, seed } = this, [red, blue] = this.seats.map(({ kind = "free", policy = "" }) => ({ kind, policy }));
    const header = headerOf({ ...table.rules, min_command_interval: table.interval, factors: table.factors }, settings, { software: table.software, began_ms: now(), seed, red, blue, lesson });
    this.log.unshift(header);
    this.recording = `${new Date().toISOString().replace(/[-:]|\.\d+/g, "")}-${this.code}-${++this.games}.jsonl`;
    Object.assign(this, { seed: null, phase: "playing" });
    this.seats[this.team].ready = false;
    this.tell();
    this.run(now() + 1000 / (TICKS * settings.speed));
  }

  // Run the next tick when it is due, and up to CATCH_UP ticks at once if it is late.
  run(due) {
    const period = 1000 / (TICKS * this.settings.speed), { game } = this;
    setTimeout(() => {
      if (this.game !== game || this.phase !== "playing") return;
      if (this.isPaused) return this.run(now() + HELD_MS);
      const late = Math.max(now() - due, 0), ticks = Math.min(1 + Math.floor(late / period), CATCH_UP);
      for (let i = 0; i < ticks && this.phase === "playing"; i++) this.tick();
      this.run(late <= CATCH_UP * period ? due + ticks * period : now() + period);
    }, Math.max(due - now(), 0));
  }

  tick() {
    const { game, player } = this, other = 1 - this.team;
    if (player && game.tick % TICKS === 0) this.submit(other, { number: game.tick / TICKS + 1, density: player.act(game, other) });
    if (game.tick % PERIOD === 0) [0, 1].forEach((team) => this.putInForce(team));
    for (const { drone, team } of game.advance()) this.log.push({ type: "captured", seat: SIDES[team], tick: game.tick, drone });
    if (game.tick % TICKS === 0) this.sizes.push([...game.sizes]);
    this.show();
    if (game.tick % PERIOD === 0 || game.isOver) this.log.push(this.frameMessage());
    const [red, blue] = game.sizes, hasMajority = this.settings.majority && red !== blue;
    if (game.isDecided) this.stop(game.outcome, "capture");
    else if (game.isOver) this.stop(hasMajority ? SIDES[Number(blue > red)] : "draw", "time");
  }

  stop(outcome, endedBy) {
    const { tick, sizes } = this.game;
    this.log.push({ type: "end", outcome, tick, sizes, server_ms: now(), ended_by: endedBy });
    this.table.shelf.save(this.recording, this.log).catch(() => this.say({ type: "notice", text: "This browser keeps no more: this game is not recorded." }));
    Object.assign(this, { phase: "over", outcome, endedBy });
    this.tell();
  }

  frameMessage() { return { type: "frame", tick: this.game.tick, data: encode(this.game) }; }

  // --- commands ---------------------------------------------------------------------------------------

  command({ number, strokes = null, timing }) {
    if (!this.isOn) throw new Refused("out_of_turn", "no game is running: commands count once both seats are ready");
    if (strokes === null) throw new Refused("not_valid", "a command here must hold strokes");
    const density = densityOf(strokes);
    this.submit(this.team, { number, strokes, timing, density });
    this.say({ type: "received", number, server_ms: now() });
    this.showTarget(number, density);
  }

  // Submit a command when its team's delay is over.
  submit(team, { density, ...rest }) {
    const command = { ...rest, density: rounded(density) }, received = now(), { game } = this;
    later(() => {
      if (!this.isOn || this.game !== game) return;
      const rows = Array.from({ length: CELLS }, (_, row) => command.density.slice(row * CELLS, (row + 1) * CELLS));
      this.waiting[team] = command;
      this.log.push({ type: "command", ...rest, density: rows, seat: SIDES[team], tick: game.tick, server_ms: received });
    }, this.table.factors[team].command_delay_ms);
  }

  putInForce(team) {
    const command = this.waiting[team], { tick } = this.game;
    if (!command || tick - this.inForce[team] < this.interval) return;
    const { number, density } = command;
    this.waiting[team] = null;
    this.inForce[team] = tick;
    this.game.command(team, density);
    const message = { type: "in_force", seat: SIDES[team], number, tick, server_ms: now(), sender: "" };
    this.log.push(message);
    if (team === this.team) this.say(message);
  }
}
