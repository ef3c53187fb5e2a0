// The cover of the board while no game is played: the room that waits, the countdown, and the result.

import { Chart, timeIsUp, turningPoint, untilTheEnd } from "./chart.js";
import { byId, hear, on, say } from "./elements.js";
import { IDEAS, LEVELS } from "./levels.js";
import { FAST_S, fewAgainst, inARow, progress, ROUND, starsOf } from "./progress.js";
import { freeSides, meetsSomebody, Waiting } from "./waiting.js";
import { called, clock, isStudy, NAMES, SIDES, SIGNS, TICKS } from "./words.js";

const DECISIVE_S = 5; // the recording is shown from this long before the turn

export class Cover {
  // begin opens a room with a message and is ready at once.
  constructor(link, begin) {
    this.opponents = [];
    this.note = ""; // to add to a result
    this.isNew = false; // the seat was taken after the game
    /** @type {any} */
    this.picture = null; // of an idea
    this.link = link;
    this.waiting = new Waiting(link);
    this.chart = new Chart(byId("result-chart"));
    on("click", {
      share: async () => (await import("./share.js")).share(link.table, this.room, this.seat, this.opponents),
      "next-game": () => begin({ seat: "red", opponent: this.next, settings: ROUND }),
    });
    hear(link, { welcome: ({ opponents }) => { this.opponents = opponents; } });
  }

  // Show a text while something is on its way.
  wait(text) {
    byId("cover").hidden = false;
    byId("table").dataset.phase = "opening";
    byId("cover-text").textContent = text;
  }

  show(room, seat, lastTick) {
    this.room = room;
    this.seat = seat;
    const { phase } = room, isOver = phase === "over", own = seat === null ? null : room[SIDES[seat]];
    const onlyPolicies = SIDES.every((side) => room[side].kind === "policy" || room.settings[side] === 0);
    const isDone = isOver && (room.once || isStudy()); // no other game follows here
    // Before a game against policies the board stays in view.
    byId("table").dataset.phase = phase === "waiting" && !meetsSomebody(room, seat) ? "before" : phase;
    byId("cover").hidden = !isOver && phase !== "waiting";
    byId("ready").hidden = isDone || (own ? own.ready : !onlyPolicies);
    this.offerNext(isOver && !isDone && own !== null);
    byId("ready").textContent = isOver ? "Play again" : onlyPolicies ? "Begin" : "I am ready";
    byId("sit").hidden = isDone || own !== null || freeSides(room).length === 0;
    byId("recording").hidden = !isOver;
    byId("share").hidden = !isOver || isDone || own === null || room.outcome === "stopped";
    byId("go-home").textContent = isDone ? "Go on" : "Back to the start";
    byId("go-home").classList.toggle("primary", Boolean(isDone));
    this.showResult(isOver && room.outcome !== "stopped");
    this.teach(isOver && !isDone && own && room.outcome !== SIDES[seat] ? LEVELS[room[this.other].name]?.idea : null);
    const waiting = this.waiting.show(room, seat), text = isOver ? this.result(lastTick) : `${this.unready ?? waiting}${this.pace}`;
    say("practice-text", text);
    requestAnimationFrame(() => { byId("cover-text").textContent = text; }); // announced only once shown
  }

  // Offer the next opponent after a game that was won against another, or tell if somebody wants to play again.
  offerNext(isOffered) {
    const { next, streak } = progress(this.opponents), isPolicy = isOffered && this.room[this.other].kind === "policy";
    const isWon = isPolicy && this.room.outcome === SIDES[this.seat];
    this.next = next;
    byId("next-game").hidden = !isWon || !next || this.room[this.other].name === next;
    byId("next-game").textContent = `Next: ${called(next ?? "")}`;
    byId("ready").classList.toggle("primary", byId("next-game").hidden);
    const sentences = isWon ? [this.stars, inARow(streak)] : [isOffered && !isPolicy ? this.again() : ""];
    say("streak", [...sentences, isOffered ? this.note : ""].filter(Boolean).join(" "));
  }

  // Return the score between two people, and who wants to play again.
  again() {
    const own = this.room[SIDES[this.seat]], other = this.room[this.other], name = other.label || "Your opponent";
    if (this.room.settings[this.other] === 0) return "";
    if (other.kind === "free") return "Your opponent has left. Send somebody the link to the free seat.";
    const wins = this.room.wins[this.seat], lost = this.room.wins[1 - this.seat], score = wins + lost ? `${`You ${wins} : ${lost} ${other.label}`.trim()}. ` : "";
    if (own.ready) return `${score}You want to play again, and wait for the other player.`;
    return score + (!other.connected ? `${name} is away.` : other.ready ? `${name} wants to play again.` : "In the next game you change sides.");
  }

  // The stars won against this opponent, and how to win more.
  get stars() {
    const { name } = this.room[this.other], won = progress([]).stars[name];
    if (!won) return "";
    const more = [won[1] ? "" : `win within ${FAST_S} s`, won[2] ? "" : `with at most ${fewAgainst(name)} drawings`].filter(Boolean);
    return `${starsOf(won)}${more.length ? ` For more: ${more.join(", ")}.` : ""}`;
  }

  // After a game that was not won, show the idea that beats this opponent; its code is fetched when needed.
  async teach(idea) {
    byId("idea").hidden = !idea;
    if (!idea && !this.picture) return;
    const { IdeaPicture } = await import("./ideas.js");
    this.picture ??= new IdeaPicture(byId("idea-picture"));
    byId("idea-text").textContent = idea ? IDEAS[idea].says : "";
    this.picture.show(IDEAS[idea] ?? null);
  }

  get other() { return SIDES[1 - this.seat]; }

  // A text about a policy that loads or failed; null if all are ready.
  get unready() {
    const seats = SIDES.map((side) => this.room[side]), find = (state) => seats.find((seat) => seat.policy_state === state);
    const failed = find("failed"), loading = find("loading");
    if (failed) return `${called(failed.name)} cannot play: ${failed.reason}`;
    return loading ? `${called(loading.name)} is getting ready.` : null;
  }

  get pace() {
    const { speed } = this.room.settings;
    return speed === 1 ? "" : ` The game runs at ${speed} of full speed.`;
  }

  result(lastTick) {
    const { outcome, sizes, forfeit } = this.room, [red, blue] = sizes.at(-1) ?? [0, 0];
    if (outcome === "draw") return `A draw: red ${red}, blue ${blue} when time was up.`;
    if (!SIDES.includes(outcome)) return "The game was stopped.";
    const winner = SIDES.indexOf(outcome), own = this.seat === winner ? "You won" : "You lost";
    const won = this.seat === null || this.isNew ? `${NAMES[winner]} won` : own;
    if (timeIsUp(this.room) && red && blue) return `${won}: red ${red}, blue ${blue} when time was up.`;
    return `${won} after ${clock(Math.max(lastTick ?? 0, TICKS * (sizes.length - 1)))}. ${forfeit}`.trim();
  }

  showResult(isShown) {
    const sizes = untilTheEnd(this.room), hasChart = isShown && sizes.length > 1;
    const turn = hasChart ? turningPoint(sizes) : null;
    byId("result-chart").hidden = !hasChart;
    byId("turning").hidden = turn === null;
    byId("recording").href = `#replay=${this.room.recording}${turn === null ? "" : `@${TICKS * Math.max(turn - DECISIVE_S, 0)}`}`;
    byId("recording").textContent = turn === null ? "Watch" : "Watch the turn";
    if (hasChart) this.chart.set(sizes, turn);
    if (turn === null) return;
    const [red, blue] = sizes[turn], when = clock(TICKS * (turn - 1));
    this.explain(this.room.recording, `The turn, at ${when}: red ${red}, blue ${blue}.`);
  }

  // Say when the game turned, and why as soon as that is known; the code for it is fetched when needed.
  async explain(recording, turn) {
    if (this.explained === recording) return;
    this.explained = recording;
    say("turning", turn);
    if (isStudy()) return;
    const why = await (await import("./replay.js")).reasonOf(this.link, recording);
    if (this.explained === recording) say("turning", `${turn} ${why}`.trim());
  }

  // Show the seconds until a game begins.
  count(room, now) {
    const left = room?.phase === "starting" && room.starts_ms ? Math.ceil((room.starts_ms - now) / 1000) : 0;
    say("countdown", left > 0 ? `${left}\n${this.seat === null ? "" : `You are ${SIDES[this.seat]} ${SIGNS[this.seat]}`}` : "");
  }
}
