// The table: a game that one plays or watches.

import { Arena } from "./arena.js";
import { Chart } from "./chart.js";
import { Lesson } from "./lesson.js";
import { Pen } from "./pen.js";
import { Replay } from "./replay.js";
import { freeSides, Waiting } from "./waiting.js";

const at = (id) => document.getElementById(id);
const SIDES = ["red", "blue"];
const BRUSHES = ["attract", "repel", "erase"];
const MOST_PIXELS = 900;

export class Table {
  // left: called to go back to the start; begin: opens a room by a message and begins in it at once.
  constructor(link, { left, begin }) {
    this.link = link;
    this.left = left;
    this.arena = new Arena(at("ground"), at("drones"), () => link.now());
    this.chart = new Chart(at("chart"));
    this.pen = new Pen(at("arena"), at("ink"), {
      lifted: () => { if (at("on-lift").checked) this.send(); },
      changed: () => this.showButtons(),
      mayDraw: () => this.seat !== null && this.room?.phase === "playing" && !this.lesson.held,
    });
    this.room = null;
    this.seat = null;
    this.leftPlace = null;
    this.number = 0;
    this.unseen = []; // commands in force whose effect was not painted yet
    at("on-lift").checked = matchMedia("(pointer: coarse)").matches;
    this.replay = new Replay(link);
    this.lesson = new Lesson(link, { begin, home: left });
    this.waiting = new Waiting(link);
    this.listen();
    new ResizeObserver(() => this.resize()).observe(at("arena"));
    const paint = () => {
      this.paint();
      requestAnimationFrame(paint);
    };
    requestAnimationFrame(paint);
  }

  listen() {
    const on = (id, act) => at(id).addEventListener("click", act);
    for (const brush of BRUSHES) on(brush, () => this.choose(brush));
    on("send", () => this.send());
    on("undo", () => this.pen.undo());
    on("clear", () => this.pen.clear());
    on("ready", () => this.link.send({ type: "ready" }));
    on("sit", () => this.sit());
    for (const id of ["leave", "close-replay", "go-home"]) on(id, () => this.left());
    at("take-side").addEventListener("change", () => { this.look(at("take-side").selectedIndex); });
    at("width").addEventListener("input", () => { this.pen.width = Number(at("width").value); this.pen.dirty = true; });
    at("keep").addEventListener("change", () => { this.pen.keep = at("keep").checked; });
    at("table").addEventListener("keydown", (event) => this.key(event));
    const hear = (type, act) => this.link.addEventListener(type, ({ detail }) => act.call(this, detail));
    hear("room", this.setRoom);
    hear("seated", ({ seat }) => { this.seat = SIDES.indexOf(seat); });
    hear("frame", this.takeFrame);
    hear("target", (target) => {
      if (target.team === this.arena.own) this.arena.setTarget(target);
      if (target.team === this.seat) this.number = Math.max(this.number, target.number); // go on counting after a reload
    });
    hear("in_force", (command) => this.unseen.push(command));
    hear("welcome", () => { this.seat = this.room = null; });
  }

  // --- the room ---------------------------------------------------------------------------------------

  setRoom(room) {
    const began = room.phase === "playing" && this.room?.phase !== "playing";
    const ended = room.phase === "over" && this.room?.phase === "playing";
    const place = placeOf(room);
    const entered = this.place !== place;
    this.place = place;
    if (entered && this.lesson.room !== room.code) this.lesson.stop();
    if (began || entered) {
      this.arena.forget();
      this.pen.clear();
      this.pen.before = [];
      this.unseen = [];
      this.number = 0;
    }
    this.room = room;
    if (room.phase !== "replay") this.arena.own = this.seat ?? 0;
    this.arena.isLive = room.phase === "playing";
    this.chart.set(room.sizes);
    for (const side of SIDES) {
      const { kind, name, label, connected } = room[side];
      const who = { free: "free seat", policy: name, person: label || "person", program: label || "program" }[kind];
      const you = this.seat === SIDES.indexOf(side) ? " (you)" : connected || kind === "free" ? "" : " (away)";
      at(`${side}-who`).textContent = who + you;
    }
    at("controls").hidden = room.phase === "replay";
    for (const tool of document.querySelectorAll("[data-who=plays]")) tool.hidden = this.seat === null;
    this.replay.show(room);
    this.showCover();
    this.showButtons();
    if (ended) this.lesson.over();
    if (began || entered) (at("cover").hidden || at("ready").hidden ? at("arena") : at("ready")).focus({ preventScroll: true });
  }

  showCover() {
    const { room } = this, own = this.seat === null ? null : room[SIDES[this.seat]];
    const free = freeSides(room), waiting = this.waiting.show(room, this.seat);
    at("table").dataset.phase = room.phase;
    at("cover").hidden = room.phase === "playing" || room.phase === "replay";
    const onlyPolicies = SIDES.every((side) => room[side].kind === "policy" || room.settings[side] === 0);
    at("ready").hidden = own ? own.ready : !onlyPolicies;
    at("ready").textContent = room.phase === "over" ? "Play again" : onlyPolicies ? "Begin" : "I am ready";
    at("sit").hidden = own !== null || free.length === 0 || room.phase === "playing";
    at("recording").hidden = room.phase !== "over";
    at("recording").href = `#replay=${room.recording}`;
    const text = room.phase === "over" ? this.result() : waiting;
    requestAnimationFrame(() => { at("cover-text").textContent = text; }); // said once it is shown
  }

  // See a recorded game from a side.
  look(side) {
    this.arena.own = side;
    this.arena.target = null;
    this.arena.groundDirty = true;
    this.replay.seek();
  }

  result() {
    const { outcome, sizes } = this.room, [red, blue] = sizes.at(-1) ?? [0, 0];
    if (outcome === "draw") return `A draw: red ${red}, blue ${blue} when time was up.`;
    if (outcome === "stopped") return "The game was stopped.";
    const won = this.seat === null ? `${outcome === "red" ? "Red" : "Blue"} won` : SIDES[this.seat] === outcome ? "You won" : "You lost";
    return `${won} after ${clock(Math.max(this.lastTick ?? 0, 30 * (sizes.length - 1)))}.`;
  }

  showButtons() {
    const mine = this.seat !== null && this.room?.phase === "playing";
    at("send").disabled = !mine;
    at("clear").disabled = this.pen.strokes.length === 0;
    at("undo").disabled = this.pen.before.length === 0;
  }

  sit() {
    const [side] = freeSides(this.room);
    if (side) this.link.send({ type: "join", room: this.room.code, seat: side, label: at("label").value });
  }

  // A game that others would miss one in.
  get isPlaying() {
    const { phase, settings } = this.room ?? {};
    return phase === "playing" && this.seat !== null && settings.red > 0 && settings.blue > 0 && !this.lesson.running;
  }

  // A recorded game is being read.
  opens(recording) {
    this.place = recording;
    this.leftPlace = null;
    at("table").dataset.phase = "opening";
    at("cover").hidden = false;
    for (const id of ["waiting", "invitation", "ready", "sit", "recording"]) at(id).hidden = true;
    at("cover-text").textContent = "Opening the recorded game…";
  }

  // Leave the room or the recorded game, if one is in any.
  leave() {
    this.lesson.stop();
    if (!this.place) return;
    this.leftPlace = this.place; // what is still on its way from there is not shown
    this.link.send({ type: "leave" });
    if (this.seat !== null) this.link.seat = null;
    this.seat = this.room = this.place = null;
    this.arena.own = at("take-side").selectedIndex = 0;
    at("cover").hidden = true;
    at("table").dataset.phase = "";
    this.arena.forget();
    this.pen.clear();
  }

  // --- commands ---------------------------------------------------------------------------------------

  choose(brush) {
    this.pen.brush = brush;
    this.pen.dirty = true;
    for (const other of BRUSHES) at(other).setAttribute("aria-pressed", String(other === brush));
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || event.target.closest("input, select")) return;
    const onButton = event.target.closest("button, a");
    const wider = (step) => {
      at("width").value = Number(at("width").value) + step;
      at("width").dispatchEvent(new Event("input"));
    };
    const acts = {
      1: () => this.choose("attract"), 2: () => this.choose("repel"), 3: () => this.choose("erase"),
      "+": () => wider(0.02), "=": () => wider(0.02), "-": () => wider(-0.02),
      u: () => this.pen.undo(), c: () => this.pen.clear(), r: () => { if (!at("ready").hidden) at("ready").click(); },
      Enter: () => { if (!onButton) this.send(); },
    };
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || (onButton && event.key === "Enter")) return;
    act();
    event.preventDefault();
  }

  send() {
    if (this.seat === null || this.room?.phase !== "playing" || this.lesson.held) return;
    const input = performance.now(), { strokes, drawingMs } = this.pen.take();
    const sent = this.link.send({
      type: "command", number: this.number + 1, strokes,
      timing: {
        input_ms: input, sent_ms: performance.now(), offset_ms: this.link.offsetMs,
        round_trip_ms: this.link.roundTripMs, drawing_ms: drawingMs,
      },
    });
    if (sent) {
      this.number += 1;
      this.pen.setSent();
      this.lesson.sent(strokes);
    }
    this.showButtons();
  }

  // --- what is seen -----------------------------------------------------------------------------------

  takeFrame(frame) {
    if (this.lesson.held) return;
    const captured = this.arena.take(frame);
    this.lastTick = frame.tick;
    this.replay.follow(frame.tick);
    this.lesson.watch(frame, captured, this.seat);
  }

  paint() {
    this.pen.paint();
    const shown = this.arena.paint(), told = at("arena").dataset;
    if (this.arena.shownTarget !== undefined) told.target = this.arena.shownTarget;
    if (!shown || shown === this.shown) return;
    this.shown = shown;
    told.tick = shown.tick; // for those who measure: what is painted, and how old it is
    told.age = Math.round(this.link.now() - shown.serverMs);
    const blue = shown.teams.reduce((sum, team) => sum + team, 0);
    at("red-size").textContent = shown.teams.length - blue;
    at("blue-size").textContent = blue;
    at("time").textContent = clock(shown.tick);
    this.chart.add(shown.tick, shown.teams.length - blue, blue);
    while (this.unseen.length && shown.tick > this.unseen[0].tick) {
      const { number, seat } = this.unseen.shift();
      if (SIDES.indexOf(seat) === this.seat) this.link.send({ type: "painted", number, painted_ms: this.link.now() });
    }
  }

  resize() {
    const side = Math.min(Math.round(at("arena").clientWidth * Math.min(devicePixelRatio, 2)), MOST_PIXELS);
    for (const id of ["ground", "ink", "drones"]) at(id).width = at(id).height = side;
    this.arena.groundDirty = this.pen.dirty = true;
    this.chart.resize();
  }
}

// A room by its code, a recorded game by its name.
export function placeOf(room) { return room.phase === "replay" ? room.recording : room.code; }

function clock(tick) {
  const seconds = Math.floor(tick / 30);
  return `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}
