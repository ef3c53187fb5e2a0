// A room with one visitor, who plays there against a policy or alone, or looks on: what swarm_pz/play/server does for many.

import { check, GAME, Refused, SETTINGS } from "./checks.js";
import { CELLS } from "./controller.js";
import { Game, PERIOD } from "./game.js";
import { loadPlayer, PLAYERS } from "./players.js";
import { headerOf, Recorder } from "./recording.js";
import { densityOf, targetOf } from "./strokes.js";
import { base64Of, frameOf, targetMessage } from "./wire.js";
import { SIDES, TICKS } from "../words.js";

const STEPS = 1e8; // to which a command's values are rounded
const CATCH_UP = 2; // ticks that a late game makes up for at once
export const EVERYTHING = new Float32Array(CELLS * CELLS).fill(1);
export const UNVARIED = { command_delay_ms: 0, display_delay_ms: 0, frame_rate: 30, speed: 1, hide: [], share: 0, helper: "" };

export function now() { return performance.timeOrigin + performance.now(); }

function later(act, ms) {
  if (ms > 0) setTimeout(act, ms);
  else act();
}

// A policy's name, if it is here.
function known(name) {
  if (!PLAYERS.includes(name)) throw new Refused("unknown", `there is no policy '${name}' here`);
  return name;
}

// A density as it is followed and written down: its largest value 1, rounded.
function followed(values) {
  const most = Math.max(...values) || 1;
  return Array.from(values, (value) => Math.round(value / most * STEPS) / STEPS);
}

function majorityOf([red, blue]) { return red === blue ? "draw" : SIDES[Number(blue > red)]; }

// What is told of who has a seat.
export function seatOf({ kind = "free", policy = "", label = "", ready = false, state = null, reason = "" }) {
  const flies = { system: "ergodic", takes: "density" };
  return { kind, name: policy, label, connected: kind !== "free", ready, policy_state: state, reason, gone: false, ...flies };
}

// What is told of a room, besides what has no other value here.
export function stateOf(has) {
  const none = { outcome: null, recording: null, last_tick: null, starts_ms: null, verified: null, ended_by: null };
  return { type: "room", watchers: 0, once: false, forfeit: "", ...none, ...has };
}

export class Room {
  table; code; once; lesson; seed; moment; phase; sizes; games; sequence; isHere; token; game; early; before; players; recorder; outcome; endedBy;

  // table: what speaks with the visitor; asked: the message that opens the room; moment: of a recorded game, to go on from.
  constructor(table, code, asked, moment = null) {
    const { settings = {}, seat = "red", opponent = null, player = null, label = "", once = false, lesson = false, seed = null } = asked;
    const { red = 10, blue = 10, time_limit: limit = 300, mapping, speed, majority } = settings;
    check({ seed, seat }, GAME);
    check(settings, SETTINGS);
    Object.assign(this, { table, code, once, lesson, seed, moment, phase: "waiting", sizes: [], games: 0, sequence: 0, isHere: false });
    this.settings = {
      red, blue, time_limit: limit, mapping: mapping ?? "firm", red_system: "ergodic", blue_system: "ergodic",
      speed: table.factors.find((own) => own.speed !== 1)?.speed ?? speed ?? 1, ...(majority && red && blue ? { majority } : {}),
    };
    this.interval = Math.ceil(10 * table.interval - 1e-6) * PERIOD;
    this.team = seat === "watch" ? null : SIDES.indexOf(seat); // the visitor's
    this.view = table.factors[this.team] ?? UNVARIED;
    const policies = seat === "watch" ? [player, opponent] : seat === "red" ? [null, opponent] : [opponent, null];
    /** @type {any[]} */
    this.seats = policies.map((name) => (name === null ? {} : this.load(known(name))));
    if (this.team !== null) this.seats[this.team] = { kind: table.kind, label };
    const isEmpty = this.seats.some(({ kind }, team) => (this.settings[SIDES[team]] > 0) !== (kind !== undefined));
    if (isEmpty) throw new Refused("not_valid", "nobody else can come in here: each side with drones needs a player, and no other one");
    this.token = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
  }

  get isOn() { return this.phase === "starting" || this.phase === "playing"; }

  // Milliseconds since the game began.
  get ms() { return now() - this.beganMs; }

  // --- who is here ------------------------------------------------------------------------------------

  load(policy) {
    const seat = { kind: "policy", policy, ready: true, state: "loading" };
    loadPlayer(policy).then(() => { seat.state = "loaded"; }, (error) => Object.assign(seat, { state: "failed", reason: error.message }))
      .then(() => { if (this.isHere) this.beginIfReady(); });
    return seat;
  }

  // Let the visitor in, or in again.
  enter() {
    const { hide, frame_rate: rate } = this.view, isVaried = hide.length || rate < UNVARIED.frame_rate;
    this.isHere = true;
    if (this.team !== null) {
      const factors = isVaried ? { hide, frame_rate: rate } : null;
      this.say({ type: "seated", room: this.code, seat: SIDES[this.team], token: this.token, commands: this.table.commands, factors });
    }
    this.note("connected");
    this.tell();
    if (this.game || this.moment) this.show(true);
    if (this.target) this.showTarget(this.target);
  }

  // The visitor is away: a game waits for them, or is left for good.
  part(isLeft) {
    this.note("disconnected");
    this.isHere = false;
    if (this.phase === "starting") this.callOff();
    if (isLeft && this.phase === "playing") this.stop("stopped", "left");
  }

  note(event) {
    if (!this.isOn || this.team === null) return;
    this.write({ type: "seat", team: this.team, event, ms: this.ms, ...(event === "connected" ? { client: this.table.client } : {}) });
  }

  // --- what they are shown ----------------------------------------------------------------------------

  // Show something, as much later as the visitor is shown things.
  pass(act) { later(() => { if (this.isHere) act(); }, this.view.display_delay_ms); }

  say(message) { this.pass(() => this.table.say(message)); }

  tell() {
    const { code, phase, settings, once, team, view } = this, [red, blue] = this.seats.map(seatOf);
    const ended = phase === "over" ? { outcome: this.outcome, recording: this.recorder.name, ended_by: this.endedBy } : {};
    this.say(stateOf({
      code, phase, settings, red, blue, once, ...ended, sizes: [...this.sizes], watchers: Number(team === null),
      min_command_interval: this.table.interval, starts_ms: phase === "starting" ? this.beganMs + view.display_delay_ms : null,
    }));
  }

  // Show the present moment, if it is one of those that are shown; a keyframe is.
  show(isKey = false) {
    const game = this.game ?? this.moment.game, { hide, frame_rate: rate, display_delay_ms: delay } = this.view, isLast = isKey || game.isOver;
    const count = (tick) => Math.floor(tick * rate / (TICKS * this.settings.speed));
    this.hasFields ||= isLast || game.tick % PERIOD === 0;
    if (!isLast && rate < UNVARIED.frame_rate && count(game.tick) === count(game.tick - 1)) return;
    const sequence = ++this.sequence, fields = this.hasFields && !hide.includes("ground") ? game.fields() : null;
    const hidden = hide.includes("opponents") ? 1 - this.team : -1, frame = frameOf(game, { sequence, ms: now() + delay, altitudes: isKey, fields, hidden });
    this.hasFields = false;
    this.pass(() => this.table.send(frame));
  }

  showTarget(target) {
    this.target = target;
    if (!this.view.hide.includes("target")) this.pass(() => this.table.send(target));
  }

  // --- how its games begin and end --------------------------------------------------------------------

  ready(isReady) {
    const failed = this.seats.find(({ state }) => state === "failed");
    if (this.phase === "playing" || (this.once && this.phase === "over")) throw new Refused("out_of_turn", "the game runs, or was the only one here");
    if (isReady && failed) throw new Refused("not_valid", `${failed.policy} cannot play: ${failed.reason}`);
    if (this.team === null) this.isCalledFor = isReady;
    else this.seats[this.team].ready = isReady;
    if (!isReady && this.phase === "starting") this.callOff();
    this.beginIfReady();
  }

  beginIfReady() {
    const canPlay = ({ ready, state = "loaded" }, team) => !this.settings[SIDES[team]] || (ready && state === "loaded");
    if (this.seats.every(canPlay) && (this.team !== null || this.isCalledFor) && !this.isOn) this.begin();
    else this.tell();
  }

  // Set up a game, at its start or at the moment to go on from.
  prepare() {
    const { red, blue, time_limit: limit } = this.settings, { moment } = this;
    this.seed ??= moment?.seed ?? crypto.getRandomValues(new Uint32Array(1))[0];
    this.game = moment?.game ?? new Game({ red, blue, timeLimit: limit ?? 1e6 }, this.seed);
    this.sizes = moment?.sizes ?? [[...this.game.sizes]];
    this.firstTick = this.game.tick;
    this.inForce = [0, 1].map((team) => moment?.latest[team]?.tick ?? -this.interval);
    this.waiting = [null, null];
    this.numbers = [0, 0]; // of commands
    if (this.team !== null) this.target = targetMessage(this.team, 0, targetOf(moment?.latest[this.team]?.density.flat() ?? EVERYTHING));
    return Promise.all(this.seats.map(({ policy }, team) => (policy ? loadPlayer(policy, (this.seed ^ team) >>> 0) : null)));
  }

  begin() {
    const before = { game: this.game, sizes: this.sizes, phase: this.phase };
    const loaded = this.prepare(), { game, table } = this, wait = new Promise((resolve) => { setTimeout(resolve, 1000 * table.countdown); });
    this.early = this.moment?.past ?? [this.frameLine()];
    Object.assign(this, { before, phase: "starting" });
    this.beganMs = now() + 1000 * table.countdown;
    this.note("connected");
    this.tell();
    this.show(true);
    if (this.target) this.showTarget(this.target);
    Promise.all([loaded, wait]).then(([players]) => { if (this.game === game && this.phase === "starting") this.start(players); });
  }

  // Take back the countdown: what was there before is shown again, a result, too.
  callOff() {
    Object.assign(this, this.before);
    if (this.game) this.show(true);
  }

  start(players) {
    const { table, settings, lesson, moment, seed } = this, [red, blue] = this.seats.map(({ kind = "free", policy = "" }) => ({ kind, policy }));
    const has = { software: table.software, seed, red, blue, lesson, ...(moment ? { origin: moment.origin } : {}) };
    const name = `${new Date().toISOString().replace(/[-:]|\.\d+/g, "")}-${this.code}-${++this.games}.jsonl`;
    this.recorder = this.recorderOf(name);
    this.recorder.write(headerOf({ ...table.rules, min_command_interval: table.interval, factors: table.factors }, settings, has));
    for (const line of this.early) this.recorder.write(line);
    table.shelf.keepSeat(this.token, { name, code: this.code, once: this.once }).catch(() => {}); // then one cannot come back
    Object.assign(this, { players, seed: null, moment: null, isCalledFor: false, phase: "playing" });
    for (const seat of this.seats) seat.ready = seat.kind === "policy";
    this.tell();
    this.run();
  }

  // Go on with a game whose page was closed, as its recording has it.
  async resume(token, { name, lines, header }) {
    const of = (type) => lines.filter((line) => line.type === type), last = [0, 1].map((team) => of("command").findLast((line) => line.team === team));
    Object.assign(this, { token, seed: header.seed, games: Number(/-(\d+)\./.exec(name)[1]) });
    this.players = await this.prepare();
    for (const { team, number } of of("command")) this.numbers[team] = number;
    last.forEach((line, team) => {
      const isOld = of("in_force").some((one) => one.team === team && one.number === line?.number && one.tick >= line.tick);
      if (line && !isOld) this.waiting[team] = { ...line, density: line.density.flat() };
    });
    this.beganMs = now() - Math.max(...lines.map(({ ms = 0 }) => ms));
    this.recorder = this.recorderOf(name);
    Object.assign(this, { seed: null, moment: null, phase: "playing" });
    this.note("disconnected");
    this.run();
  }

  // Let time go on, while somebody sees it.
  run() {
    const period = 1000 / (TICKS * this.settings.speed), { game } = this;
    let due = now() + period;
    const wait = () => setTimeout(() => {
      const late = Math.max(now() - due, 0), ticks = this.isHere ? 1 + Math.min(Math.floor(late / period), CATCH_UP - 1) : 0;
      due = ticks && late <= CATCH_UP * period ? due + ticks * period : now() + period;
      for (let i = 0; i < ticks && this.phase === "playing"; i++) this.tick();
      if (this.game === game && this.phase === "playing") wait();
    }, Math.max(due - now(), 0));
    wait();
  }

  tick() {
    const { game } = this;
    if (game.tick % TICKS === 0 || game.tick === this.firstTick) this.players.forEach((player, team) => { if (player) this.ask(player, team); });
    if (game.tick % PERIOD === 0) [0, 1].forEach((team) => this.putInForce(team));
    for (const { drone, team } of game.advance()) this.write({ type: "captured", tick: game.tick, drone, team });
    if (game.tick % TICKS === 0) this.sizes.push([...game.sizes]);
    this.show();
    if (game.tick % PERIOD === 0 || game.isOver) this.write(this.frameLine());
    if (game.isOver) this.stop(game.outcome === "draw" && this.settings.majority ? majorityOf(game.sizes) : game.outcome, game.isDecided ? "capture" : "time");
  }

  stop(outcome, endedBy) {
    const { tick, sizes } = this.game;
    this.write({ type: "end", outcome, tick, sizes, ms: this.ms, ended_by: endedBy });
    this.recorder.close();
    this.table.shelf.dropSeat(this.token);
    Object.assign(this, { phase: "over", outcome, endedBy });
    this.tell();
  }

  recorderOf(name) {
    const text = "This browser keeps no more: the recording of this game breaks off here.";
    return new Recorder(this.table.shelf, name, () => this.say({ type: "notice", text }));
  }

  // Write a line down, once there is a file.
  write(line) {
    if (this.phase === "starting") this.early.push(line);
    else this.recorder.write(line);
  }

  frameLine() { return { type: "frame", tick: this.game.tick, data: base64Of(frameOf(this.game, { exact: true })) }; }

  // --- commands ---------------------------------------------------------------------------------------

  command({ number, strokes = null, density = null, timing }) {
    if (this.team === null || !this.isOn) throw new Refused("out_of_turn", "no game is running: commands count once both seats are ready");
    if ((strokes === null) === (density === null)) throw new Refused("not_valid", "a command here must hold either strokes or a density");
    const asked = strokes ? densityOf(strokes, this.settings.mapping) : density.flat();
    this.submit(this.team, { number, strokes, timing, density: asked });
    this.say({ type: "received", number, server_ms: now() });
    this.showTarget(targetMessage(this.team, number, targetOf(asked)));
  }

  // Let a policy command for its team.
  ask(player, team) { this.submit(team, { number: ++this.numbers[team], density: player.act(this.game, team) }); }

  // Hand a command in, when its team's delay is over.
  submit(team, { density, ...has }) {
    const command = { ...has, density: followed(density) }, received = this.ms, { game } = this;
    later(() => {
      if (!this.isOn || this.game !== game) return;
      const rows = Array.from({ length: CELLS }, (_, row) => command.density.slice(row * CELLS, (row + 1) * CELLS));
      this.waiting[team] = command;
      this.write({ type: "command", team, ...has, density: rows, received_ms: received, tick: game.tick });
    }, this.table.factors[team].command_delay_ms);
  }

  putInForce(team) {
    const command = this.waiting[team], { tick } = this.game;
    if (!command || tick - this.inForce[team] < this.interval) return;
    const { number, density } = command;
    this.waiting[team] = null;
    this.inForce[team] = tick;
    this.game.command(team, density);
    this.write({ type: "in_force", team, number, tick, ms: this.ms });
    if (team === this.team) this.say({ type: "in_force", seat: SIDES[team], number, tick, server_ms: now(), sender: "" });
  }

  painted({ number, painted_ms: painted }) {
    if (this.phase === "playing" && this.team !== null) this.write({ type: "painted", team: this.team, number, ms: painted - this.beganMs });
  }
}
