// The table: a game that one plays or watches.

import { Arena } from "./arena.js";
import { called } from "./cards.js";
import { Chart } from "./chart.js";
import { Cover } from "./cover.js";
import { Lesson } from "./lesson.js";
import { clock, News } from "./news.js";
import { Pen } from "./pen.js";
import { Replay } from "./replay.js";
import { Sound } from "./sound.js";
import { freeSides } from "./waiting.js";

const at = (id) => document.getElementById(id);
const SIDES = ["red", "blue"];
const BRUSHES = ["attract", "repel", "erase"];
const MOST_PIXELS = 900;
const SILENCE_MS = 2000; // without a frame, after which one is told

export class Table {
  // left: called to go back to the start; begin: opens a room by a message and begins in it at once.
  constructor(link, { left, begin }) {
    this.link = link;
    this.left = left;
    this.arena = new Arena(at("ground"), at("drones"), () => link.now());
    this.chart = new Chart(at("chart"));
    this.sound = new Sound(at("sound"));
    this.news = new News(this.sound);
    this.pen = new Pen(at("arena"), at("ink"), {
      lifted: () => { if (at("on-lift").checked) this.send(); },
      changed: () => this.showButtons(),
      mayDraw: () => this.mayPlay,
    });
    this.room = null;
    this.seat = null;
    this.leftPlace = null;
    this.number = 0;
    this.unseen = []; // commands in force whose effect was not painted yet
    this.heardMs = 0; // when the latest frame came
    this.cover = new Cover(link, begin);
    this.replay = new Replay(link, this.chart);
    this.lesson = new Lesson(link, { begin, home: left });
    this.listen();
    new ResizeObserver(() => this.resize()).observe(at("arena"));
    new ResizeObserver(() => this.chart.resize()).observe(at("chart"));
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
    on("undo", () => this.undo());
    on("spread", () => this.spread());
    on("ready", () => this.link.send({ type: "ready" }));
    on("sit", () => this.sit());
    for (const id of ["leave", "close-replay", "go-home"]) on(id, () => this.left());
    on("end-game", () => {
      this.leave();
      this.left();
    });
    on("play-on", () => {
      this.cover.playsOn = true;
      this.cover.showNotice();
      this.focus();
    });
    at("take-side").addEventListener("change", () => this.look(at("take-side").selectedIndex));
    at("width").addEventListener("input", () => this.setWidth());
    at("keep").addEventListener("change", () => { this.pen.keep = at("keep").checked; });
    at("on-lift").addEventListener("change", () => this.showButtons());
    at("table").addEventListener("keydown", (event) => this.key(event));
    this.setWidth();
    const hear = (type, act) => this.link.addEventListener(type, ({ detail }) => act.call(this, detail));
    hear("room", this.setRoom);
    hear("seated", ({ seat }) => { this.seat = SIDES.indexOf(seat); });
    hear("frame", this.takeFrame);
    hear("target", (target) => {
      if (target.team === this.arena.own) this.arena.ground.setTarget(target);
      if (target.team === this.seat) this.number = Math.max(this.number, target.number); // go on counting after a reload
    });
    hear("in_force", this.setInForce);
    hear("welcome", () => { this.seat = this.room = null; });
    hear("closed", () => this.showButtons());
  }

  // --- the room ---------------------------------------------------------------------------------------

  get isRunning() { return isRunning(this.room); }

  get mayPlay() { return this.seat !== null && this.isRunning && this.link.isOpen && !this.lesson.held; }

  // A game that others would miss one in.
  get isPlaying() {
    const { phase, settings } = this.room ?? {};
    return phase === "playing" && this.seat !== null && settings.red > 0 && settings.blue > 0 && !this.lesson.running;
  }

  // A recorded game is being read.
  opens(recording) {
    this.place = recording;
    this.leftPlace = null;
    this.cover.wait("Opening the recorded game: it is played through first, which may take a while…");
  }

  setRoom(room) {
    const began = isRunning(room) && !this.isRunning;
    const ended = room.phase === "over" && this.room?.phase === "playing";
    const place = placeOf(room);
    if (room.phase === "replay") this.giveUpSeat(); // the server has done so
    const entered = this.place !== place;
    this.place = place;
    if (entered && this.lesson.room !== room.code) this.lesson.stop();
    if (began || entered) this.forget();
    if (room.phase === "playing" && this.room?.phase !== "playing") this.heardMs = performance.now();
    this.room = room;
    if (room.phase !== "replay") this.arena.look(this.seat ?? 0, this.seat === null ? [0, 1] : [this.seat]);
    else if (entered) this.arena.look(at("take-side").selectedIndex);
    this.arena.isLive = room.phase === "playing";
    this.arena.speed = room.settings.speed;
    this.chart.set(room.sizes);
    this.showScores();
    at("controls").hidden = this.seat === null || ["replay", "over"].includes(room.phase);
    this.replay.show(room);
    this.cover.show(room, this.seat, this.lastTick);
    this.showButtons();
    if (ended) this.end();
    if (began || entered) requestAnimationFrame(() => this.focus()); // once it is shown
  }

  focus() { (at("ready").checkVisibility() ? at("ready") : at("arena")).focus({ preventScroll: true }); }

  // Begin with another game.
  forget() {
    this.arena.forget();
    this.pen.forget();
    this.news.forget(this.seat);
    this.unseen = [];
    this.number = 0;
    this.lastTick = this.shown = null;
  }

  end() {
    this.news.hush();
    const { outcome } = this.room, won = this.seat === null || outcome === SIDES[this.seat];
    this.sound.play(won && SIDES.includes(outcome) ? "won" : "over");
    this.lesson.over();
  }

  showScores() {
    const { room } = this;
    for (const side of SIDES) {
      const { kind, name, label, connected, gone } = room[side], free = room.settings[side] ? "free seat" : "nobody";
      const who = { free, policy: called(name), person: label || "person", program: label || "program" }[kind];
      const isOwn = this.seat === SIDES.indexOf(side), away = connected || kind === "free" ? "" : gone ? " (left)" : " (away)";
      if (this.lastTick === null) at(`${side}-size`).textContent = room.settings[side]; // until a frame says how many
      at(`${side}-who`).textContent = isOwn ? `${label} (you)`.trim() : who + away;
    }
    this.showTime(this.lastTick ?? 0);
  }

  // Time goes up here as in what happened, in the result and in recordings; and how long a game may last.
  showTime(tick) {
    const { settings, phase, last_tick: last } = this.room, limit = phase === "replay" ? last / 30 : settings.time_limit;
    at("time").textContent = clock(tick);
    at("time-of").textContent = limit === null ? "no limit" : `of ${clock(30 * limit)}`;
  }

  // See a recorded game from a side.
  look(side) {
    this.arena.look(side);
    this.replay.seek();
  }

  showButtons() {
    at("send").disabled = !this.mayPlay;
    at("spread").disabled = !this.mayPlay;
    at("send").classList.toggle("primary", !at("on-lift").checked);
    at("undo").disabled = !this.mayPlay || this.pen.before.length === 0;
  }

  sit() {
    const [side] = freeSides(this.room);
    if (side) this.link.send({ type: "join", room: this.room.code, seat: side, label: at("label").value });
  }

  giveUpSeat() {
    if (this.seat !== null) this.link.seat = null;
    this.seat = null;
  }

  // Leave the room or the recorded game, if one is in any.
  leave() {
    this.lesson.stop();
    if (!this.place) return;
    this.leftPlace = this.place; // what is still on its way from there is not shown
    this.link.send({ type: "leave" });
    this.giveUpSeat();
    this.room = this.place = null;
    at("take-side").selectedIndex = 0;
    for (const id of ["controls", "scrubber", "cover", "notice", "watching"]) at(id).hidden = true;
    at("table").dataset.phase = "";
    this.arena.look(0);
    this.forget();
  }

  // --- commands ---------------------------------------------------------------------------------------

  choose(brush) {
    this.pen.brush = brush;
    this.pen.dirty = true;
    for (const other of BRUSHES) at(other).setAttribute("aria-pressed", String(other === brush));
  }

  setWidth() {
    this.pen.width = Number(at("width").value);
    this.pen.dirty = true;
    at("width").setAttribute("aria-valuetext", `${Math.round(100 * this.pen.width)} percent of the map`);
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || event.target.closest("input, select, dialog")) return;
    const onButton = event.target.closest("button, a");
    const wider = (step) => {
      at("width").value = Number(at("width").value) + step;
      this.setWidth();
    };
    const acts = {
      1: () => this.choose("attract"), 2: () => this.choose("repel"), 3: () => this.choose("erase"),
      "+": () => wider(0.02), "=": () => wider(0.02), "-": () => wider(-0.02),
      u: () => this.undo(), c: () => this.spread(), r: () => { if (!at("ready").hidden) at("ready").click(); },
      m: () => at("sound").click(), Enter: () => { if (!onButton) this.send(); },
    };
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || (onButton && event.key === "Enter")) return;
    act();
    event.preventDefault();
  }

  // Send the drawing, unless it was sent already; tell whether it was.
  send() {
    if (!this.mayPlay || this.pen.sent) return false;
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
    return sent;
  }

  // A drawing of nothing asks for the whole square.
  spread() {
    if (!this.mayPlay) return;
    this.pen.clear();
    if (this.send()) this.news.answer("Sent: spread out");
  }

  // What was sent cannot be taken back: the drawing before it is another command.
  undo() {
    if (!this.mayPlay) return;
    const wasSent = this.pen.undo();
    if (wasSent && this.send()) this.news.answer(this.pen.strokes.length ? "Undone: the drawing before was sent" : "Undone: spread out was sent");
  }

  setInForce(command) {
    this.unseen.push(command);
    if (SIDES.indexOf(command.seat) === this.seat && command.number >= this.number) this.pen.setInForce();
  }

  // --- what is seen -----------------------------------------------------------------------------------

  takeFrame(frame) {
    if (!this.room) return; // left, and this one was under way
    this.heardMs = performance.now();
    if (this.lesson.held) return;
    const captured = this.arena.take(frame);
    this.lastTick = frame.tick;
    if (this.room.phase !== "replay") this.news.captures(captured, frame);
    this.replay.follow(frame.tick);
    this.lesson.watch(frame, captured, this.seat);
  }

  paint() {
    this.pen.paint();
    this.cover.count(this.room, this.link.now());
    this.watchSilence();
    const shown = this.arena.paint(), told = at("arena").dataset;
    if (this.arena.shownTarget !== undefined) told.target = this.arena.shownTarget;
    if (!shown || shown === this.shown || !this.room) return;
    this.shown = shown;
    told.tick = shown.tick; // for those who measure: what is painted, and how old it is
    told.age = Math.round(this.link.now() - shown.serverMs);
    told.endangered = this.arena.endangered;
    const blue = shown.teams.reduce((sum, team) => sum + team, 0);
    at("red-size").textContent = shown.teams.length - blue;
    at("blue-size").textContent = blue;
    this.showTime(shown.tick);
    if (this.room.phase !== "replay") this.chart.add(shown.tick, shown.teams.length - blue, blue);
    while (this.unseen.length && shown.tick > this.unseen[0].tick) {
      const { number, seat } = this.unseen.shift();
      if (SIDES.indexOf(seat) === this.seat) this.link.send({ type: "painted", number, painted_ms: this.link.now() });
    }
  }

  watchSilence() {
    const isSilent = this.room?.phase === "playing" && performance.now() - this.heardMs > SILENCE_MS;
    const text = isSilent ? "The server is silent; this is what was seen last." : "";
    if (at("silence").textContent !== text) at("silence").textContent = text;
  }

  resize() {
    const side = Math.min(Math.round(at("arena").clientWidth * Math.min(devicePixelRatio, 2)), MOST_PIXELS);
    if (side === 0 || side === at("ground").width) return;
    for (const id of ["ground", "ink", "drones"]) at(id).width = at(id).height = side;
    this.arena.ground.resize();
    this.pen.dirty = true;
  }
}

// A room by its code, a recorded game by its name.
export function placeOf(room) { return room.phase === "replay" ? room.recording : room.code; }

// A game counts down, in which one may draw already, or is played.
function isRunning(room) { return room?.phase === "playing" || room?.phase === "starting"; }
