// What lies over the board while no game is played: whom one waits for, the countdown, and the result.

import { called } from "./cards.js";
import { Chart, turningPoint, untilTheEnd } from "./chart.js";
import { clock } from "./news.js";
import { freeSides, meetsSomebody, Waiting } from "./waiting.js";

const at = (id) => document.getElementById(id);
const SIDES = ["red", "blue"];
const NAMES = { red: "Red", blue: "Blue" };

export class Cover {
  // begin: opens a room by a message and begins in it at once.
  constructor(link, begin) {
    this.begin = begin;
    this.waiting = new Waiting(link);
    this.chart = new Chart(at("result-chart"));
    new ResizeObserver(() => this.chart.resize()).observe(at("result-chart"));
    at("swap").addEventListener("click", () => this.swap());
  }

  // Something is on its way.
  wait(text) {
    for (const id of ["waiting", "invitation", "ready", "sit", "swap", "recording", "turning", "result-chart"]) at(id).hidden = true;
    at("cover").hidden = false;
    at("table").dataset.phase = "opening";
    this.say(text);
  }

  show(room, seat, lastTick) {
    this.room = room;
    this.seat = seat;
    const isOver = room.phase === "over", own = seat === null ? null : room[SIDES[seat]];
    const onlyPolicies = SIDES.every((side) => room[side].kind === "policy" || room.settings[side] === 0);
    // Who waits for policies alone keeps the board in view.
    at("table").dataset.phase = room.phase === "waiting" && !meetsSomebody(room, seat) ? "before" : room.phase;
    at("cover").hidden = !isOver && room.phase !== "waiting";
    const isDone = isOver && (room.once || document.body.classList.contains("study")); // there is no other game here
    at("ready").hidden = isDone || (own ? own.ready : !onlyPolicies);
    at("ready").textContent = isOver ? "Play again" : onlyPolicies ? "Begin" : "I am ready";
    at("sit").hidden = isDone || own !== null || freeSides(room).length === 0;
    at("swap").hidden = isDone || !isOver || own === null || room[this.other].kind !== "policy";
    at("recording").hidden = !isOver;
    at("go-home").textContent = isDone ? "Go on" : "Back to the start";
    at("go-home").classList.toggle("primary", Boolean(isDone));
    at("recording").href = `#replay=${room.recording}`;
    this.showNotice();
    this.showResult(isOver && room.outcome !== "stopped", lastTick);
    const waiting = this.waiting.show(room, seat), text = isOver ? this.result(lastTick) : `${this.unready ?? waiting}${this.pace}`;
    requestAnimationFrame(() => this.say(text)); // said once it is shown
  }

  // Whether the game goes on against a swarm that nobody steers, and what of that is told.
  showNotice() {
    const { room, seat } = this, isAlone = room.phase === "playing" && seat !== null && room[this.other].gone;
    if (!isAlone) this.playsOn = false;
    at("notice").hidden = !isAlone || this.playsOn;
    const text = isAlone ? `${room[this.other].label || "Your opponent"} has left for good: their swarm goes on with its last command.` : "";
    if (at("notice-text").textContent !== text) at("notice-text").textContent = text;
  }

  get other() { return SIDES[1 - this.seat]; }

  say(text) { at("cover-text").textContent = text; }

  // What is to be said of a policy that loads, or cannot.
  get unready() {
    const seats = SIDES.map((side) => this.room[side]), failed = seats.find((seat) => seat.policy_state === "failed");
    if (failed) return `${called(failed.name)} cannot play: ${failed.reason}`;
    const loading = seats.find((seat) => seat.policy_state === "loading");
    return loading ? `${called(loading.name)} is getting ready.` : null;
  }

  get pace() {
    const { speed } = this.room.settings;
    return speed === 1 ? "" : ` Time goes at ${speed} of its speed here.`;
  }

  result(lastTick) {
    const { outcome, sizes } = this.room, [red, blue] = sizes.at(-1) ?? [0, 0];
    if (outcome === "draw") return `A draw: red ${red}, blue ${blue} when time was up.`;
    if (!SIDES.includes(outcome)) return "The game was stopped.";
    const won = this.seat === null ? `${NAMES[outcome]} won` : SIDES[this.seat] === outcome ? "You won" : "You lost";
    return `${won} after ${clock(Math.max(lastTick ?? 0, 30 * (sizes.length - 1)))}. ${this.room.forfeit}`.trim();
  }

  showResult(isShown, lastTick) {
    const ended = untilTheEnd(this.room.sizes, this.room.outcome);
    const turn = isShown ? turningPoint(ended) : null;
    at("result-chart").hidden = !isShown || ended.length < 2;
    at("turning").hidden = !turn;
    if (at("result-chart").hidden) return;
    this.chart.set(ended, turn?.second ?? null);
    if (!turn) return;
    const [red, blue] = ended[turn.second], leader = red > blue ? "red" : "blue";
    const when = clock(Math.min(30 * turn.second, lastTick ?? Infinity));
    at("turning").textContent = turn.kind === "lead"
      ? `The turn, at ${when}: from then on ${leader} was ahead.`
      : `The turn, at ${when}: red ${red}, blue ${blue}.`;
  }

  // The same game from the other side, in a room of its own; a room knows no other way.
  swap() {
    const { room, other } = this;
    const { red, blue, red_system, blue_system } = room.settings;
    const settings = { ...room.settings, red: blue, blue: red, red_system: blue_system, blue_system: red_system };
    this.begin({ settings, seat: other, opponent: room[other].name });
  }

  // The seconds until a game begins.
  count(room, now) {
    const left = room?.phase === "starting" && room.starts_ms ? Math.ceil((room.starts_ms - now) / 1000) : 0;
    const text = left > 0 ? String(left) : "";
    if (at("countdown").textContent !== text) at("countdown").textContent = text;
  }
}
