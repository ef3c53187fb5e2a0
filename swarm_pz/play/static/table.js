// The table: a game that one plays or watches.

import { Arena } from "./arena.js";
import { called } from "./cards.js";
import { Chart } from "./chart.js";
import { Cover } from "./cover.js";
import { button } from "./elements.js";
import { Library } from "./library.js";
import { read } from "./link.js";
import { clock, News } from "./news.js";
import { Pen } from "./pen.js";
import { Sound } from "./sound.js";
import { freeSides } from "./waiting.js";

const at = (id) => document.getElementById(id);
const SIDES = ["red", "blue"];
const BRUSHES = ["attract", "repel", "erase"];
const DRAWN = ["density", "attraction"], PLACED = ["attractors", "leaders", "formation"]; // kinds of commands
const HANDS = {
  pointerdown: "begin", pointermove: "move", pointerup: "end", pointercancel: "cancel", keydown: "key", keyup: "keyUp", blur: "blur",
};
const NO_LESSON = { stop() {}, over() {}, sent() {}, watch() {} };
const HIDDEN = { opponents: "your opponents", ground: "ground that captures", trails: "trails", target: "your target" };
const TURN = 1 / 24; // by a key, or a notch of the wheel
const WHEEL_MS = 300; // after which a wheel is at rest
const MOST_PIXELS = 900;
const SILENCE_MS = 2000; // without a frame, after which one is told

export class Table {
  // left: called to go back to the start; begin: opens a room by a message and begins in it at once.
  constructor(link, { left, begin }) {
    this.link = link;
    this.left = left;
    this.arena = new Arena(at("ground"), at("drones"), () => link.now(), () => link.roundTripMs / 2);
    this.chart = new Chart(at("chart"));
    this.sound = new Sound(at("sound"));
    this.news = new News(this.sound);
    this.hand = { lifted: () => this.lifted(), changed: () => this.showButtons(), mayDraw: () => this.mayPlay };
    this.pen = this.brush = new Pen(at("arena"), at("ink"), this.hand);
    this.room = null;
    this.seat = null;
    this.leftPlace = null;
    this.number = 0;
    this.followed = 0; // of one's commands, the latest that a shared one was made of
    this.unseen = []; // commands in force whose effect was not painted yet
    this.heardMs = 0; // when the latest frame came
    this.cover = new Cover(link, begin);
    this.replay = null; // fetched with the first recorded game
    this.begin = begin;
    this.lesson = NO_LESSON;
    this.responses = null;
    this.library = new Library({
      current: () => this.pen, send: (drawing) => this.recall(drawing), tell: (text) => this.news.answer(text),
      changed: () => this.responses?.then((responses) => responses.show()),
    });
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
    for (const [type, act] of Object.entries(HANDS)) at("arena").addEventListener(type, (event) => this.pen[act](event));
    at("arena").addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    on("manage", async () => {
      await this.respond();
      at("tools").showModal();
    });
    on("close-tools", () => at("tools").close());
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
    at("turn").addEventListener("input", () => this.pen.turnTo(at("turn").valueAsNumber));
    for (const id of ["width", "turn"]) at(id).addEventListener("change", () => { if (this.pen !== this.brush) this.lifted(); });
    at("keep").addEventListener("change", () => { this.pen.keep = at("keep").checked; });
    at("on-lift").addEventListener("change", () => this.showButtons());
    at("table").addEventListener("keydown", (event) => this.key(event));
    this.setWidth();
    const hear = (type, act) => this.link.addEventListener(type, ({ detail }) => act.call(this, detail));
    hear("room", this.setRoom);
    hear("seated", ({ seat, token, commands, factors }) => {
      this.seat = SIDES.indexOf(seat);
      this.vary(factors);
      if (read("sessionStorage", "swarm-pz.rules")?.token === token) this.respond();
      this.equip(commands);
    });
    hear("frame", this.takeFrame);
    hear("target", (target) => {
      if (target.team === this.arena.own) this.arena.ground.setTarget(target);
      if (target.team === this.seat) this.number = Math.max(this.number, target.number); // go on counting after a reload
    });
    hear("in_force", this.setInForce);
    hear("acting", (acting) => this.respond().then((responses) => responses.act(acting)));
    hear("welcome", ({ policies }) => Object.assign(this, { policies, seat: null, room: null }));
    hear("closed", () => this.showButtons());
  }

  // --- the room ---------------------------------------------------------------------------------------

  get isRunning() { return isRunning(this.room); }

  get mayPlay() { return this.seat !== null && this.isRunning && this.link.isOpen && !this.lesson.held && this.isEquipped; }

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

  // What an experimenter varies at one's seat; null for nothing.
  vary(factors) {
    const { hide, frame_rate: rate, helper, share } = factors ?? { hide: [], frame_rate: 30, helper: "", share: 0 };
    const unseen = hide.length ? `Not shown here: ${hide.map((name) => HIDDEN[name]).join(", ")}.` : "";
    const shared = share ? `${called(helper)} makes ${Math.round(100 * share)} % of each command.` : "";
    at("varied").textContent = [unseen, shared].filter(Boolean).join(" ");
    at("varied").hidden = !at("varied").textContent;
    this.arena.rate = rate;
    this.arena.hasTrails = !hide.includes("trails");
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
    if (this.replay || room.phase === "replay") this.showReplay();
    this.cover.show(room, this.seat, this.lastTick);
    this.showButtons();
    this.pen.dirty = true; // what is placed is shown while one may place it
    if (began && this.seat !== null && this.pen.hint) this.news.answer(this.pen.hint);
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
    this.number = this.followed = 0;
    at("reached-now").textContent = "";
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
    this.replay?.seek();
  }

  async showReplay() {
    if (!this.replay) {
      const { Replay } = await import("./replay.js");
      this.replay ??= new Replay(this.link, this.chart);
    }
    if (this.room) this.replay.show(this.room); // as it is by now
  }

  showButtons() {
    at("send").disabled = !this.mayPlay;
    at("spread").disabled = !this.mayPlay;
    at("send").classList.toggle("primary", !at("on-lift").checked);
    at("undo").disabled = !this.mayPlay || this.pen.before.length === 0;
    at("width").value = this.pen.width;
    at("turn").value = this.pen.mark?.turn;
    for (const shape of at("shapes").children) shape.setAttribute("aria-pressed", shape.textContent === this.pen.shape);
  }

  sit() {
    const [side] = freeSides(this.room);
    if (side) this.link.send({ type: "join", room: this.room.code, seat: side, label: at("label").value });
  }

  giveUpSeat() {
    if (this.seat !== null) this.link.seat = null;
    this.seat = null;
    this.vary(null);
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

  // The lesson, and automatic responses: their code is fetched when somebody wants them.
  async learn() {
    const { Lesson } = await import("./lesson.js");
    if (this.lesson === NO_LESSON) this.lesson = new Lesson(this.link, { begin: this.begin, home: this.left });
    if (location.hash === "#lesson") this.lesson.start();
  }

  respond() {
    const how = { policies: () => this.policies.filter((policy) => this.answers(policy)), saved: () => this.library.own, say: (strokes) => this.pen.say(strokes) };
    return this.responses ??= import("./responses.js").then(({ Responses }) => new Responses(this.link, how));
  }

  // Have what commands of a seat are made with: what is not drawn has its own code, fetched when it is needed.
  async equip(commands) {
    const { takes, serves_densities: isServed } = commands, kind = PLACED.includes(takes) || takes === "accelerations" ? takes : "strokes";
    this.answers = ({ answers }) => answers === takes || answers === "any" || (answers === "density" && isServed);
    this.isEquipped = false;
    this.pen.forget();
    if (kind === "strokes") this.pen = this.brush;
    else if (takes === "accelerations") {
      const { Stick } = await import("./stick.js"), frame = () => ({ ...this.arena.frame, own: this.seat });
      this.pen = new Stick(at("arena"), at("ink"), { ...this.hand, lifted: () => this.send(), frame });
    } else this.pen = new (await import("./marks.js")).Marks(at("arena"), at("ink"), this.hand);
    this.pen.equip?.(commands);
    this.pen.keep = at("keep").checked;
    this.isEquipped = kind !== "strokes" || DRAWN.includes(takes) || isServed;
    at("hint").textContent = this.isEquipped ? this.pen.hint : `This page has no gesture for ${takes}: programs play them.`;
    this.showTools(kind, commands);
    this.library.show();
    this.showButtons();
  }

  // The tools of a kind of commands.
  showTools(kind, { shapes }) {
    const isDrawn = kind === "strokes" && this.isEquipped, isFlown = kind === "accelerations", sized = isDrawn ? "Width" : this.pen.how?.sized, [min, max] = this.pen.sizes ?? [0.05, 0.3];
    for (const [id, isShown] of Object.entries({
      brushes: isDrawn, placing: !isDrawn, hint: !shapes.length, shapes: shapes.length, sized, turned: this.pen.how?.turn,
      send: !isFlown, lifting: !isFlown, adding: isDrawn || kind === "attractors",
    })) at(id).hidden = !isShown;
    at("size-of").textContent = sized ?? "";
    Object.assign(at("width"), { min, max, step: (max - min) / 25, value: this.pen.width });
    [at("turn").min, at("turn").max] = this.pen.turns ?? [0, 1];
    at("spread").textContent = isDrawn ? "Spread out" : "Reset";
    at("shapes").replaceChildren(...shapes.map((shape) => button(shape, () => {
      this.pen.shape = shape;
      this.lifted();
    })));
  }

  choose(brush) {
    this.brush.brush = brush;
    this.brush.dirty = true;
    for (const other of BRUSHES) at(other).setAttribute("aria-pressed", String(other === brush));
  }

  setWidth() {
    this.pen.width = Number(at("width").value);
    this.pen.dirty = true;
    at("width").setAttribute("aria-valuetext", `${Math.round(100 * this.pen.width)} percent of the map`);
  }

  wider(steps) {
    const { value, step } = at("width");
    at("width").value = Number(value) + steps * step;
    this.setWidth();
  }

  wheel(event) {
    if (this.pen === this.brush || !this.mayPlay) return;
    const steps = -Math.sign(event.deltaY || event.deltaX);
    event.preventDefault();
    if (event.shiftKey) this.pen.turn?.(TURN * steps);
    else this.wider(steps);
    clearTimeout(this.wheeled);
    this.wheeled = setTimeout(() => this.lifted(), WHEEL_MS);
  }

  lifted() { if (at("on-lift").checked) this.send(); }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || event.target.closest("input, select, dialog")) return;
    const onButton = event.target.closest("button, a");
    const turn = (part) => this.pen.turn?.(part);
    const acts = {
      g: () => this.choose("attract"), k: () => this.choose("repel"), e: () => this.choose("erase"),
      "+": () => this.wider(2), "=": () => this.wider(2), "-": () => this.wider(-2),
      "[": () => turn(TURN), "]": () => turn(-TURN), n: () => this.pen.next?.(), s: () => this.library.save(),
      u: () => this.undo(), c: () => this.spread(), r: () => { if (!at("ready").hidden) at("ready").click(); },
      m: () => at("sound").click(), Enter: () => { if (!onButton) this.send(); },
    };
    if (document.body.classList.contains("study") && /^[1-9rs]$/i.test(event.key)) return;
    const act = /^[1-9]$/.test(event.key) ? () => this.library.recall(event.key - 1)
      : acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || (onButton && event.key === "Enter")) return;
    act();
    event.preventDefault();
  }

  // Send the drawing, unless it was sent already; tell whether it was.
  send() {
    if (!this.mayPlay || this.pen.sent) return false;
    const input = performance.now(), { drawingMs, ...command } = this.pen.take();
    const sent = this.link.send({
      type: "command", number: this.number + 1, ...command,
      timing: {
        input_ms: input, sent_ms: performance.now(), offset_ms: this.link.offsetMs,
        round_trip_ms: this.link.roundTripMs, drawing_ms: drawingMs,
      },
    });
    if (sent) {
      this.number += 1;
      this.pen.setSent();
      this.lesson.sent(command.strokes ?? []);
    }
    this.showButtons();
    return sent;
  }

  recall({ name, strokes }) {
    if (!this.mayPlay) return;
    this.pen.recall(strokes);
    if (this.send()) this.news.answer(`Sent: ${name}`);
  }

  // A drawing of nothing asks for the whole square; other commands have one to begin with.
  spread() {
    if (!this.mayPlay) return;
    this.pen.clear();
    if (this.send()) this.news.answer(`Sent: ${at("spread").textContent.toLowerCase()}`);
  }

  // What was sent cannot be taken back: the drawing before it is another command.
  undo() {
    if (!this.mayPlay) return;
    const wasSent = this.pen.undo();
    if (wasSent && this.send()) this.news.answer(this.pen.strokes.length ? "Undone: the drawing before was sent" : "Undone: spread out was sent");
  }

  setInForce(command) {
    const isShared = command.sender.startsWith("shared:");
    if (command.sender && !isShared) return; // a response, in one's place
    if (isShared && command.number <= this.followed) return; // one's helper alone asked for something else
    this.followed = command.number;
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
    this.replay?.follow(frame.tick);
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
