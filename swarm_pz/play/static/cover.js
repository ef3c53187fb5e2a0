// What lies over the board while no game is played: whom one waits for, the countdown, and the result.

import { Chart, turningPoint } from "./chart.js";
import { clock } from "./news.js";

const at = (id) => document.getElementById(id);
const SIDES = ["red", "blue"];
const NAMES = { red: "Red", blue: "Blue" };

export class Cover {
  constructor(link) {
    this.link = link;
    this.waitsFor = null; // what is on its way, in words
    this.isSwapping = false;
    this.chart = new Chart(at("result-chart"));
    new ResizeObserver(() => this.chart.resize()).observe(at("result-chart"));
    at("swap").addEventListener("click", () => this.swap());
    link.addEventListener("seated", () => {
      if (this.isSwapping) link.send({ type: "ready" }); // who asks for it is ready for it
      this.isSwapping = false;
    });
    link.addEventListener("refused", ({ detail }) => { if (detail.about === "create") this.isSwapping = false; });
    this.wait();
  }

  // Nothing to show yet.
  wait() {
    for (const id of ["ready", "sit", "swap", "recording", "turning", "result-chart"]) at(id).hidden = true;
    at("cover").hidden = false;
    at("cover").className = "";
    this.say(this.waitsFor ?? "One moment…");
  }

  show(room, seat, lastTick) {
    if (this.waitsFor) {
      this.wait();
      return;
    }
    this.room = room;
    this.seat = seat;
    const isOver = room.phase === "over", own = seat === null ? null : room[SIDES[seat]];
    const onlyPolicies = SIDES.every((side) => room[side].kind === "policy" || room.settings[side] === 0);
    at("cover").hidden = !isOver && room.phase !== "waiting";
    at("cover").className = isOver ? "over" : "";
    at("ready").hidden = own ? own.ready : !onlyPolicies;
    at("ready").textContent = isOver ? "Play again" : onlyPolicies ? "Begin" : "I am ready";
    at("sit").hidden = own !== null || this.free.length === 0;
    at("swap").hidden = !isOver || own === null || room[this.other].kind !== "policy";
    at("recording").hidden = !isOver;
    at("recording").href = `#replay=${room.recording}`;
    this.showResult(isOver && room.outcome !== "stopped", lastTick);
    const text = isOver ? this.result(lastTick) : this.waiting();
    requestAnimationFrame(() => this.say(text)); // said once it is shown
  }

  get free() { return SIDES.filter((side) => this.room[side].kind === "free" && this.room.settings[side] > 0); }

  get other() { return SIDES[1 - this.seat]; }

  say(text) { at("cover-text").textContent = text; }

  // Whom, or what, the room waits for.
  waiting() {
    const { room, seat } = this, { speed } = room.settings;
    const loading = SIDES.map((side) => room[side]).find((one) => one.policy_state === "loading");
    const failed = SIDES.map((side) => room[side]).find((one) => one.policy_state === "failed");
    const pace = speed === 1 ? "" : ` Time goes ${speed < 1 ? "slowly" : "fast"} here: at ${speed} of its speed.`;
    return this.whom(room, seat, loading, failed) + pace;
  }

  whom(room, seat, loading, failed) {
    if (failed) return `${failed.name} cannot play: ${failed.reason}`;
    if (seat === null) {
      if (this.free.length) return `Room ${room.code}: the ${this.free.join(" and the ")} seat is free.`;
      return loading ? `${loading.name} is getting ready.` : "Waiting for the players.";
    }
    if (this.free.length) return `Room ${room.code}: send this code, or the address of this page, to whom you want to play.`;
    const own = room[SIDES[seat]], other = room[this.other];
    if (room.settings[this.other] === 0) return "You are alone here: draw, and see where your drones go.";
    if (!own.ready) {
      if (other.kind === "policy") return `You play against ${other.name}.`;
      return `${NAMES[this.other]} is ${!other.connected ? "away" : other.ready ? "ready, and waits for you" : "here"}.`;
    }
    return loading ? `${loading.name} is getting ready.` : `Waiting for ${this.other} to be ready.`;
  }

  result(lastTick) {
    const { outcome, sizes } = this.room, [red, blue] = sizes.at(-1) ?? [0, 0];
    if (outcome === "draw") return `A draw: red ${red}, blue ${blue} when time was up.`;
    if (!SIDES.includes(outcome)) return "The game was stopped.";
    const won = this.seat === null ? `${NAMES[outcome]} won` : SIDES[this.seat] === outcome ? "You won" : "You lost";
    return `${won} after ${clock(Math.max(lastTick ?? 0, 30 * (sizes.length - 1)))}.`;
  }

  showResult(isShown, lastTick) {
    const { sizes, outcome } = this.room, ended = [...sizes];
    if (SIDES.includes(outcome) && ended.length) { // the last second is not whole
      const all = ended[0][0] + ended[0][1];
      ended.push(outcome === "red" ? [all, 0] : [0, all]);
    }
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
    const { room, seat, other } = this;
    const settings = { ...room.settings, red: room.settings.blue, blue: room.settings.red };
    this.isSwapping = this.link.send({
      type: "create", settings, seat: other, opponent: room[other].name, label: room[SIDES[seat]].label,
    });
  }

  // The seconds until a game begins.
  count(room, now) {
    const left = room?.phase === "starting" && room.starts_ms ? Math.ceil((room.starts_ms - now) / 1000) : 0;
    const text = left > 0 ? String(left) : "";
    if (at("countdown").textContent !== text) at("countdown").textContent = text;
  }
}
