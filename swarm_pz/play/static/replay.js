// A recorded game: its file is fetched and played here. Hold it, or go to any moment or capture of it.

import { turningPoint, untilTheEnd } from "./chart.js";
import { button, byId, download, make, on, putAt } from "./elements.js";
import { Playback } from "./engine/playback.js";
import { whyOf } from "./why.js";
import { clock, NAMES, SIDES, TICKS } from "./words.js";

const BEFORE_TICKS = 30; // a capture is shown from this long before it
const STEPS = { arrowleft: -1, arrowright: 1 }, FRAME_TICKS = 3; // seconds of an arrow key; ticks with Shift
const MOST_BYTES = 16 * 2 ** 20; // of a file
const LIT_TICKS = [75, 30]; // before and after the decisive loss, in which its place is lit

export class Replay {
  // opponents returns the names of the opponents.
  constructor(link, chart, opponents = () => []) {
    this.link = link;
    this.opponents = opponents;
    this.chart = chart;
    this.playback = null;
    this.held = false;
    on("change", { pace: () => this.hold(false) });
    on("input", {
      moment: () => {
        this.hold(true);
        this.goTo(Number(byId("moment").value));
      },
    });
    on("click", {
      hold: () => this.hold(!this.held),
      "capture-before": () => this.goTo(this.captures.findLast(({ tick }) => tick < byId("moment").value - BEFORE_TICKS / 2)?.tick ?? 0),
      "capture-after": () => this.goTo(this.captures.find(({ tick }) => tick > Number(byId("moment").value))?.tick),
      "save-recording": () => download(new Blob([this.text]), this.playback.room.recording),
    });
  }

  // Fetch a recorded game and show it from a tick on, if isWanted() by then. An Error says why it cannot be shown.
  async open(name, from, isWanted) {
    const text = await this.read(name);
    if (!isWanted()) return;
    try { this.playback = new Playback(name, text); } catch (error) { throw new Error(`${name} cannot be shown: ${error.message}.`); }
    const { room, seed } = this.playback, opponent = room.red.kind === "person" ? room.blue.name : "";
    byId("try").hidden = !this.opponents().includes(opponent);
    byId("try").href = `#play=${opponent}@${seed}`;
    this.why = whyOf(this.playback);
    this.text = text;
    this.owed = 0;
    this.link.tell("room", room);
    byId("scrubber").hidden = false;
    this.list(untilTheEnd(room));
    byId("pace").value = "1";
    byId("moment").max = room.last_tick;
    this.hold(false);
    this.goTo(from);
    this.link.table.keepAll?.();
    clearInterval(this.clock);
    this.clock = setInterval(() => this.step(), 1000 / TICKS);
  }

  // Read a recorded game, by its file's name or from a link that holds it.
  read(name) { return name.endsWith(".jsonl") ? readGame(this.link, name) : this.playAgain(name); }

  async playAgain(packed) {
    const { unpack } = await import("./engine/linked.js"), answer = await fetch(new URL("engine/table.json", import.meta.url)).catch(() => null);
    if (!answer?.ok) throw new Error("There is no such recorded game here.");
    const { text, isSame } = await unpack(packed, await answer.json()).catch(() => { throw new Error("This link holds no game: perhaps it was cut."); });
    if (!isSame) this.link.tell("notice", { text: "Your browser computes this game otherwise than the one that played it." });
    return text;
  }

  close() {
    clearInterval(this.clock);
    this.playback = null;
    byId("scrubber").hidden = byId("light").hidden = true;
    this.chart.show(null);
  }

  // Return the action of a key, or null; on a button, Space belongs to the button.
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
    this.playback.goTo(tick);
    for (const moment of this.playback.past) this.link.tell("frame", moment);
    this.shownCommands = [];
    this.show();
  }

  // Go on by the chosen pace, in whole ticks; the rest is left for the next step.
  step() {
    const { playback } = this, ticks = Math.floor(this.owed += this.held ? 0 : Number(byId("pace").value));
    this.owed -= ticks;
    if (!ticks || playback.tick >= playback.lastTick) return;
    playback.goTo(playback.tick + ticks);
    this.show();
  }

  // Show the present moment, with targets that are new.
  show() {
    const { playback } = this;
    for (const team of [0, 1]) {
      const command = playback.latest(team) ?? null;
      if (command !== this.shownCommands[team]) this.link.tell("target", playback.target(team));
      this.shownCommands[team] = command;
    }
    const { tick, place } = this.why ?? { tick: Infinity }, isLit = playback.tick > tick - LIT_TICKS[0] && playback.tick < tick + LIT_TICKS[1];
    this.link.tell("frame", playback.moment);
    byId("light").hidden = !isLit;
    if (isLit) putAt("light", place);
    byId("moment").value = playback.tick;
    this.tell();
  }

  // List the gains of each second as buttons that go there; the turn is marked in the chart, too.
  list(sizes) {
    const turn = turningPoint(sizes);
    this.chart.set(sizes, turn, this.playback.lastTick / TICKS);
    this.captures = [];
    for (let second = 1; second < sizes.length; second++) {
      const gain = sizes[second][0] - sizes[second - 1][0], tick = Math.max(TICKS * (second - 1) - BEFORE_TICKS, 0);
      if (gain) this.captures.push({ tick, line: this.line(tick, second - 1, gain, sizes[second], turn === second) });
    }
    byId("log").replaceChildren(...this.captures.map(({ line }) => line));
  }

  line(tick, second, gain, [red, blue], isTurn) {
    const team = gain < 0 ? 1 : 0;
    const text = `${clock(TICKS * second)} ${NAMES[team]} +${Math.abs(gain)}: red ${red}, blue ${blue}${isTurn ? `, the turn. ${this.why?.text ?? ""}` : ""}`;
    return make("li", { className: SIDES[team] }, button([make("span", { className: "shape" }), text], () => this.goTo(tick)));
  }

  hold(held) {
    this.held = held;
    byId("hold").textContent = held ? "Play" : "Pause";
    byId("hold").setAttribute("aria-pressed", String(held));
  }

  tell() {
    const { value, max } = byId("moment");
    this.chart.show(value / TICKS);
    const current = this.captures.findLast(({ tick }) => tick <= value)?.line;
    if (current !== this.current) {
      this.current?.setAttribute("aria-current", "false");
      current?.setAttribute("aria-current", "true");
      current?.scrollIntoView({ block: "nearest" });
      this.current = current;
    }
    byId("moment").setAttribute("aria-valuetext", `${clock(value)} of ${clock(max)}`);
  }
}

// Return why a game turned, in a sentence; empty if that is not known.
export async function reasonOf(link, name) {
  try { return whyOf(new Playback(name, await readGame(link, name)))?.text ?? ""; } catch { return ""; }
}

// Fetch the text of a recorded game; an Error says why it cannot be shown.
async function readGame(link, name) {
  const answer = await link.table.fetch(`recordings/${encodeURIComponent(name)}`);
  if (!answer?.ok) throw new Error(`There is no recorded game ${name} here.`);
  const text = await answer.text();
  if (text.length > MOST_BYTES) throw new Error(`${name} is too long to be watched here; swarm-pz replay --film makes a film of it.`);
  return text;
}
