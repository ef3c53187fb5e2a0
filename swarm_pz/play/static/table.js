// The table: a game that is played or watched.

import { Arena } from "./arena.js";
import { Chart } from "./chart.js";
import { Controls } from "./controls.js";
import { Cover } from "./cover.js";
import { byId, hear, on, putAt, say } from "./elements.js";
import { sizesOf } from "./frames.js";
import { LEVELS } from "./levels.js";
import { News } from "./news.js";
import { Sound } from "./sound.js";
import { count, counts, daily, daysInARow, keepSide, progress, sideIn, winDay } from "./progress.js";
import { freeSides } from "./waiting.js";
import { called, clock, isStudy, playerOf, SIDES, TICKS } from "./words.js";

const NO_LESSON = { stop() {}, over() {}, sent() {}, watch() {}, held: false, running: false, room: null };
const HIDDEN = { opponents: "your opponents", ground: "ground that captures", trails: "trails", target: "your target" };
const UNVARIED = { hide: [], frame_rate: 30, share: 0 };
const MOST_PIXELS = 900;
const SILENCE_MS = 2000; // without a frame, after which the page says so
const SHOWN_EVERY_MS = 100; // numbers, chart and captures: with many captures, these would cost as much as the board

export class Table {
  // left: called to go back to the start; begin: opens a room with a message and is ready at once.
  constructor(link, { left, begin }) {
    this.link = link;
    this.left = left;
    this.begin = begin;
    this.room = null;
    this.seat = null;
    this.place = this.leftPlace = null; // present and last room or recording
    this.heardMs = this.shownMs = 0; // when the latest frame came, and when numbers were shown
    this.isAway = false; // this page stopped the clock
    /** @type {any} */
    this.lesson = NO_LESSON;
    this.replay = null; // fetched with the first recorded game
    this.practice = null; // while a room waits
    this.start = { room: "", message: null }; // a room with a fixed seed, and the message that opened it
    this.aside = null; // a room whose game is over, and the seat there, while a recorded game is watched
    this.arena = new Arena(byId("ground"), byId("drones"), () => link.now(), () => link.roundTripMs / 2);
    this.chart = new Chart(byId("chart"));
    this.sound = new Sound(byId("sound"));
    this.news = new News(this.sound);
    this.cover = new Cover(link, begin);
    this.controls = new Controls(link, {
      mayPlay: () => this.mayPlay, answer: (text) => this.news.answer(text),
      send: (message) => (this.practice ?? link).send(message), sent: (strokes) => this.lesson.sent(strokes),
    });
    this.listen();
    new ResizeObserver(() => this.resize()).observe(byId("arena"));
    const paint = () => {
      this.paint();
      requestAnimationFrame(paint);
    };
    requestAnimationFrame(paint);
  }

  listen() {
    on("click", {
      ready: () => this.again(),
      practise: () => this.practise(),
      "practice-stop": () => {
        this.endPractice();
        this.setRoom(this.room);
      },
      sit: () => this.sit(),
      leave: () => this.left(),
      "close-replay": () => this.left(),
      "go-home": () => this.left(),
    });
    addEventListener("visibilitychange", () => this.pause());
    addEventListener("keydown", (event) => this.key(event)); // on the window: after a click beside the board nothing has the focus
    hear(this.link, {
      room: (room) => this.setRoom(room),
      seated: (seated) => this.sitDown(seated),
      frame: (frame) => this.takeFrame(frame),
      target: (target) => { if (target.team === this.arena.ground.own) this.arena.ground.setTarget(target); },
      welcome: () => {
        this.seat = this.room = this.aside = null;
        this.isAway = false;
      },
      closed: () => {
        this.endPractice();
        this.controls.show();
      },
    });
  }

  key(event) {
    if (!this.room || document.querySelector("dialog[open]")) return;
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || event.target.closest("input:not(#moment), select")) return;
    const key = event.key.toLowerCase(), pressed = { r: "ready", m: "sound" }[key], onButton = event.target.closest("button, a");
    const watched = this.room?.phase === "replay" ? this.replay?.actOf(key, event.shiftKey, onButton) : null;
    const act = watched ?? (pressed ? () => { if (byId(pressed).checkVisibility()) byId(pressed).click(); } : this.controls.actOf(key, onButton));
    if (!act) return;
    act();
    event.preventDefault();
  }

  // --- the room ---------------------------------------------------------------------------------------

  get mayPlay() { return this.seat !== null && (isRunning(this.room) || this.practice !== null) && this.link.isOpen && !this.lesson.held; }

  // The player's side, now or in a recorded game; -1 without one.
  get own() { return this.room?.phase === "replay" ? SIDES.indexOf(sideIn(this.room.recording)) : this.seat ?? -1; }

  get opponent() { return this.room[SIDES[1 - this.seat]]; }

  // A running game that the player should not leave by mistake.
  get isPlaying() {
    const { phase, settings } = this.room ?? {};
    return phase === "playing" && this.seat !== null && settings.red > 0 && settings.blue > 0 && !this.opponent.gone && !this.lesson.running;
  }

  // Stop the clock of a game against a policy while the player looks at something else.
  pause() {
    const isAway = document.hidden || this.lesson.held || document.querySelector("dialog[open]") !== null;
    if (isAway === this.isAway || this.seat === null || !isRunning(this.room) || this.room.once || isStudy()) return;
    if (["policy", "free"].includes(this.opponent.kind) && this.link.send({ type: "pause", paused: isAway })) this.isAway = isAway;
  }

  // Show a recorded game from a tick on; the code for it is fetched when needed. An Error says why it cannot be shown.
  async open(recording, from) {
    this.place = recording;
    this.leftPlace = null;
    this.cover.wait("Opening the recorded game…");
    const { Replay } = await import("./replay.js");
    this.replay ??= new Replay(this.link, this.chart, () => this.cover.opponents);
    await this.replay.open(recording, from, () => this.place === recording);
  }

  // Store a win in the game of the day; return a note about the game.
  noteDay(room) {
    const { day, seed } = daily(this.cover.opponents);
    if (this.start.room !== room.code || this.start.message.seed !== seed) return "";
    if (room.outcome !== SIDES[this.seat]) return "The game of the day has the same start each time: try again.";
    winDay(day);
    return `You won the game of the day${daysInARow(day)}.`;
  }

  // Be ready, or begin again from the same seed.
  again() {
    const { room, message } = this.start;
    if (this.room.phase === "over" && this.room.code === room) this.begin(message);
    else this.link.send({ type: "ready", label: byId("label").value });
  }

  async practise() {
    const { Practice } = await import("./practice.js"), { room } = this;
    if (this.practice || this.seat === null || room?.phase !== "waiting") return;
    this.practice = new Practice(this.link, this.seat);
    this.setRoom(room);
    this.forget();
    this.focus();
  }

  endPractice() {
    if (!this.practice) return;
    this.practice.stop();
    this.practice = null;
    this.forget();
  }

  sitDown({ seat, commands, factors }) {
    this.cover.isNew = this.seat === null && this.room?.phase === "over";
    this.seat = SIDES.indexOf(seat);
    this.vary(factors);
    this.controls.equip(this.seat, commands);
  }

  // Apply the factors of an experiment at the seat; null for none.
  vary(factors) {
    const { hide, frame_rate: rate, share } = factors ?? UNVARIED;
    const unseen = hide.length ? `Not shown here: ${hide.map((name) => HIDDEN[name]).join(", ")}.` : "";
    const shared = share ? `A program makes ${Math.round(100 * share)} % of each command.` : "";
    byId("varied").textContent = [unseen, shared].filter(Boolean).join(" ");
    byId("varied").hidden = !byId("varied").textContent;
    this.arena.rate = rate;
    this.arena.hasTrails = !hide.includes("trails");
  }

  setRoom(room) {
    const { phase } = room, began = isRunning(room) && !isRunning(this.room), place = placeOf(room);
    const starts = phase === "playing" && this.room?.phase !== "playing", ended = phase === "over" && this.room?.phase === "playing";
    const entered = this.place !== place;
    const opened = phase === "replay" && this.room?.phase !== phase;
    this.place = place;
    if (phase !== "waiting" || entered) this.endPractice();
    if (entered && this.lesson.room !== room.code) this.lesson.stop();
    if (began || entered) this.forget();
    if (began) this.isAway = this.cover.isNew = false;
    if (starts || this.room?.paused) this.heardMs = performance.now();
    this.room = room;
    if (phase !== "replay") this.arena.look(this.seat ?? 0, this.seat === null ? [0, 1] : [this.seat]);
    else if (entered) this.arena.look(Math.max(this.own, 0));
    this.arena.isLive = phase === "playing";
    this.arena.speed = room.settings.speed;
    if (!this.practice) this.chart.set(room.sizes);
    this.showScores();
    byId("controls").hidden = this.seat === null || ["replay", "over"].includes(phase);
    if (phase !== "replay") this.replay?.close();
    if (ended && this.seat !== null) {
      keepSide(room.recording, SIDES[this.seat]);
      this.cover.note = this.noteDay(room);
      if (counts(room, this.opponent, this.lesson.running)) {
        count(this.opponent.name, room.outcome === SIDES[this.seat], this.lastTick / TICKS, this.controls.number);
      }
    }
    this.cover.show(room, this.seat, this.lastTick);
    this.showPractice();
    this.controls.show();
    this.controls.pen.dirty = true; // marks show only while they may be placed
    if (began && this.seat !== null) this.introduce();
    if (ended) this.end();
    this.pause();
    if (began || entered || opened || (ended && !this.lesson.running)) requestAnimationFrame(() => this.focus()); // once it is shown
  }

  // Offer practice in a room that waits for somebody; while it runs, the cover is hidden.
  showPractice() {
    const isOn = this.practice !== null;
    byId("practise").hidden = byId("waiting").hidden || this.seat === null || this.controls.pen.kind !== "strokes";
    byId("practice").hidden = !isOn;
    if (!isOn) return;
    byId("cover").hidden = true;
    byId("table").dataset.phase = "practice";
  }

  // Say how commands are placed, or something about the opponent.
  introduce() {
    const { name } = this.opponent, says = isStudy() || this.lesson.running ? "" : LEVELS[name]?.says;
    const hint = this.controls.pen.hint || (says ? `${called(name)}: ${says}` : "");
    if (hint) this.news.answer(hint);
  }

  focus() {
    // After a game no button gets the focus: a key meant for the game would press it.
    const first = byId(this.room?.phase === "over" ? "cover-text" : "ready");
    (first.checkVisibility() ? first : byId("arena")).focus({ preventScroll: true });
  }

  // Reset for another game.
  forget() {
    this.arena.forget();
    this.controls.forget();
    this.news.forget(this.seat);
    this.lastTick = this.shown = null;
    byId("waves").className = "";
  }

  end() {
    const { outcome } = this.room, isWon = SIDES.includes(outcome) && (this.seat === null || outcome === SIDES[this.seat]);
    this.news.hush();
    this.controls.pen.forget(); // a drawing that came too late must not stay on the last moment, or on a recorded game
    putAt("waves", this.arena.lastCapture(SIDES.indexOf(outcome)));
    byId("waves").className = outcome;
    this.sound.play(isWon ? "won" : "over");
    this.lesson.over(isWon);
  }

  showScores() {
    const { room } = this;
    for (const side of SIDES) {
      const { kind, label, connected, gone } = room[side], who = playerOf(room[side], room.settings[side] ? "free seat" : "nobody");
      const isOwn = this.own === SIDES.indexOf(side), away = connected || kind === "free" ? "" : gone ? " (left)" : " (away)";
      if (this.lastTick === null) byId(`${side}-size`).textContent = room.settings[side]; // until a frame says how many
      byId(`${side}-who`).textContent = isOwn ? `${label} (you)`.trim() : this.practice ? "practice" : who + away;
    }
    this.showTime(this.lastTick ?? 0);
  }

  // Show the time since the start, as news and recordings do, and the time limit.
  showTime(tick) {
    const { settings, phase, last_tick: last } = this.room, limit = phase === "replay" ? last / TICKS : settings.time_limit;
    say("time", clock(tick));
    say("time-of", limit === null ? "no limit" : `of ${clock(TICKS * limit)}`);
  }

  // Start the lesson; its code is fetched when needed.
  async learn() {
    const { Lesson } = await import("./lesson.js");
    if (this.lesson === NO_LESSON) this.lesson = new Lesson(this.link, { begin: this.begin, home: this.left, next: () => progress(this.cover.opponents).next });
    if (location.hash === "#lesson") this.lesson.start();
  }

  sit() {
    const [side] = freeSides(this.room);
    if (side) this.link.send({ type: "join", room: this.room.code, seat: side, label: byId("label").value });
  }

  giveUpSeat() {
    if (this.seat !== null) this.link.seat = null;
    this.seat = null;
    this.vary(null);
  }

  // Leave the room for a recorded game; if the room's game is over, the player can come back.
  putAside() {
    if (this.room?.phase !== "over") return this.leave();
    this.aside = { room: this.room, seat: this.seat };
    this.seat = null;
  }

  // Tell if a room stays aside; if its next game begins, it is shown again.
  holds(room) {
    if (this.aside?.room.code !== room.code) return false;
    this.aside.room = room;
    if (room.phase === "over") return true;
    this.seat ??= this.aside.seat;
    this.aside = null;
    return false;
  }

  // Come back from a recorded game, whose last moment stays on the board.
  takeUp() {
    const { room, seat } = this.aside, playback = this.replay?.playback;
    Object.assign(this, { aside: null, seat });
    this.setRoom(room);
    playback?.goTo(playback.lastTick);
    if (playback) this.takeFrame(playback.moment);
  }

  // Leave the room or the recorded game, if there is one.
  leave() {
    this.lesson.stop();
    this.endPractice();
    if (this.aside) Object.assign(this, { place: this.aside.room.code, seat: this.aside.seat, aside: null });
    if (!this.place) return;
    this.leftPlace = this.place; // late messages from there are not shown
    this.link.send({ type: "leave" });
    this.giveUpSeat();
    this.room = this.place = null;
    this.replay?.close();
    for (const id of ["controls", "cover", "watching"]) byId(id).hidden = true;
    byId("table").dataset.phase = "";
    this.arena.look(0);
    this.forget();
  }

  // --- what is seen -----------------------------------------------------------------------------------

  takeFrame(frame) {
    if (!this.room) return; // a late frame of a game that was left
    this.heardMs = performance.now();
    if (this.lesson.held) return;
    const captured = this.arena.take(frame);
    this.lastTick = frame.tick;
    if (this.room.phase !== "replay") this.news.captures(captured, frame);
    this.lesson.watch(frame, this.seat);
  }

  paint() {
    this.controls.pen.paint();
    this.pause();
    this.cover.count(this.room, this.link.now());
    const isSilent = this.room?.phase === "playing" && !this.room.paused && performance.now() - this.heardMs > SILENCE_MS;
    const isLeft = this.room?.phase === "playing" && this.seat !== null && this.opponent.gone;
    const left = isLeft ? `${this.opponent.label || "Your opponent"} has left for good: their swarm goes on with its last command.` : "";
    say("silence", this.room?.paused ? "Paused." : isSilent ? "The server is silent. You see the last moment that it sent." : left);
    const shown = this.arena.paint(), dataset = byId("arena").dataset, now = performance.now();
    if (this.arena.shownTarget !== undefined) dataset.target = this.arena.shownTarget;
    if (!shown || shown === this.shown || !this.room) return;
    dataset.tick = shown.tick; // for measurements
    if (now - this.shownMs < SHOWN_EVERY_MS) return;
    this.shown = shown;
    this.shownMs = now;
    const [red, blue] = sizesOf(shown.teams);
    say("red-size", String(red));
    say("blue-size", String(blue));
    this.showTime(shown.tick);
    if (this.room.phase === "replay") return;
    this.chart.add(shown.tick, red, blue);
    this.news.paint();
  }

  resize() {
    const side = Math.min(Math.round(byId("arena").clientWidth * Math.min(devicePixelRatio, 2)), MOST_PIXELS);
    if (side === 0 || side === byId("ground").width) return;
    for (const id of ["ground", "ink", "drones"]) byId(id).width = byId(id).height = side;
    this.arena.ground.dirty = true;
    this.controls.pen.dirty = true;
  }
}

// Return a room's code, or a recorded game's name.
export function placeOf(room) { return room.phase === "replay" ? room.recording : room.code; }

// Tell if a game counts down or is played: drawing is allowed in both.
function isRunning(room) { return room?.phase === "playing" || room?.phase === "starting"; }
