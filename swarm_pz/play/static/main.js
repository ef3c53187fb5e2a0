// The page: its address selects the view.
//   #room=ABCD   to a room: to one's seat there, or the free one, or to look on
//   #watch=ABCD  to a room, to look on               #play=ring   straight into a game against a policy
//   #replay=FILE@TICK a recorded game                #play=ring@7 a challenge: a game from the start of a seed
//   #lesson      the first lesson                    #daily       the game of the day, without a server
//   #embed=ORIGIN  in the frame of an experiment there
// At /study/CODE/game the page shows a game of a study, and then returns to the study.

import { byId, hear, make, on } from "./elements.js";
import { Link, SERVER } from "./link.js";
import { Lobby } from "./lobby.js";
import { daily, ROUND } from "./progress.js";
import { keep } from "./store.js";
import { placeOf, Table } from "./table.js";
import { freeSides } from "./waiting.js";
import { called } from "./words.js";

const VIEWS = ["lobby", "table"];
const SAYING_MS = 6000;
const RESULT_MS = 6000; // for which the result of a study's game is shown
const CODE = /^[A-Z0-9]{4,8}$/;
const ROOMS = ["room", "watch"];
const STUDY = /^(\/study\/[^/]+)\/game$/.exec(location.pathname)?.[1];

const framed = route().name === "embed" ? await import("./embed.js") : null;
const link = new Link(wantedSeat, document.querySelector("meta[name=table]") ? (await import("./engine/table.js")).PAGE : SERVER);
const lobby = new Lobby(link, { begin, go });
// This comes before the table's own handler: hidden elements take no focus, and rooms that were left are not shown.
link.addEventListener("room", (event) => {
  const { detail } = /** @type {CustomEvent} */ (event);
  if (placeOf(detail) === table.leftPlace || table.holds(detail)) event.stopImmediatePropagation();
  else arrive(detail);
});
const table = new Table(link, { left: () => go(table.aside ? `room=${table.aside.room.code}` : ""), begin });
const embed = framed && new framed.Embed(link, route().value, begin);
let welcomed = null;
let isBeginning = false; // a room was asked for, and its seat shall be ready at once
let wantsSeat = ""; // the room of the address, while the visitor has no seat there
let fixed = null; // the message that opens a room with a fixed seed
let goal = ""; // the address to go to once a running game may be left
let noticeMs = 0, noticeTimer; // duration of the notice, and the timer that ends it

// Parse the address; codes of rooms may have small letters.
function route() {
  try {
    const [, name, value] = /^([^=]*)=?(.*)$/s.exec(decodeURIComponent(location.hash.slice(1)));
    return { name, value: ROOMS.includes(name) ? value.toUpperCase() : value };
  } catch { return { name: "", value: "" }; }
}

// Return the stored seat in the room of the address, or null: only its token is sent.
function wantedSeat() {
  const { name, value } = route();
  return name === "room" ? [link.seat, link.lastSeat].find((seat) => seat?.room === value) ?? null : null;
}

// Set the address; a new place gets an entry in the browser's history.
function mark(hash, isNew) {
  if (location.hash === (hash ? `#${hash}` : "")) return;
  history[isNew ? "pushState" : "replaceState"](null, "", hash ? `#${hash}` : location.pathname);
}

function go(hash) {
  mark(hash, true);
  show();
}

// Go back to the start, from an address that leads nowhere.
function giveUp(notice = "") {
  mark("", false);
  show();
  if (notice) say(notice);
}

// Go back to the study that the game is a part of.
function goOn(notice = "") {
  keep("told", notice, "session");
  location.replace(STUDY);
}

// Show a notice for a while.
function say(text, forMs = SAYING_MS) {
  byId("says").textContent = text;
  noticeMs = forMs;
  clearTimeout(noticeTimer);
  if (text && forMs < Infinity) noticeTimer = setTimeout(() => say(""), forMs);
}

// Show a view; return true if another one was shown.
function open(name) {
  const isNew = byId(name).hidden;
  for (const view of VIEWS) byId(view).hidden = view !== name;
  if (!isNew) return false;
  scrollTo(0, 0);
  if (noticeMs < Infinity) say(""); // the notice was about the other view
  return true;
}

// Open a room and begin at once; return true if the message could be sent.
function begin(message) {
  if (isBeginning) return false;
  fixed = "seed" in message ? message : null;
  isBeginning = link.send({ type: "create", label: byId("label").value, settings: {}, ...message });
  if (!isBeginning) say("The server does not answer yet. Try again in a moment.");
  return isBeginning;
}

// --- addresses --------------------------------------------------------------------------------------

function show() {
  const { name, value } = route(), isHere = ROOMS.includes(name) && table.room?.code === value;
  if (table.isPlaying && !isHere) return ask();
  if (name === "" && STUDY) return goOn();
  if (name === "") return showLobby();
  open("table");
  if (!welcomed || isHere) return;
  if (ROOMS.includes(name) && table.aside?.room.code === value) return table.takeUp();
  if (name === "embed" && embed) table.cover.wait(embed.waiting);
  else if (name === "play") play(value);
  else if (name === "daily" && !welcomed.guests) beginDaily();
  else if (ROOMS.includes(name)) enter(name, value);
  else if (name === "replay") {
    table.putAside();
    const [recording, from] = value.split("@");
    table.open(recording, Number(from) || 0).catch(({ message }) => { if (route().value === value) giveUp(message); });
  } else if (name === "lesson") {
    table.leave();
    table.learn();
  } else giveUp();
}

// Begin against a policy, or alone; with a seed it is a challenge, which waits until the visitor is ready.
function play(value) {
  const [, opponent, seed] = /^(.*?)(?:@(\d{1,10}))?$/.exec(value);
  if (!opponent || opponent === "none") begin({ seat: "red", settings: { blue: 0 } });
  else if (seed === undefined) begin({ seat: "red", opponent, settings: ROUND });
  else if (begin({ seat: "red", opponent, settings: ROUND, seed: Number(seed) })) {
    isBeginning = false;
    say(`A challenge: ${called(opponent)}, from the same start as in the game that you were sent.`);
  }
}

function beginDaily() {
  const { opponent, seed } = daily(welcomed.opponents);
  begin({ seat: "red", opponent, seed, settings: ROUND });
}

function showLobby() {
  table.leave();
  if (open("lobby")) byId("quick").focus({ preventScroll: true });
  lobby.show(welcomed);
}

function enter(name, code) {
  table.leave();
  table.leftPlace = null;
  if (!CODE.test(code)) giveUp("A room's code has four letters and digits.");
  else if (wantedSeat()) link.reopen();
  else if (STUDY) goOn();
  else {
    wantsSeat = name === "room" ? code : "";
    link.send({ type: "join", room: code, seat: "watch" });
  }
}

// Show a room, and sit down if the address leads to a seat.
function arrive(room) {
  const [side] = wantsSeat === room.code && table.seat === null ? freeSides(room) : [];
  const stays = !welcomed.guests && table.start.room === room.code; // without a server, only a challenge's address outlives its page
  if (room.phase !== "replay" && !stays) mark(`${table.seat !== null || side ? "room" : "watch"}=${room.code}`, ["", "replay"].includes(route().name));
  open("table");
  wantsSeat = "";
  if (side) link.send({ type: "join", room: room.code, seat: side, label: byId("label").value });
  if (room.phase !== "playing") byId("leaving").close();
}

// Ask before a running game is left: it may be a mistake.
function ask() {
  goal = location.hash.slice(1);
  mark(`room=${table.room.code}`, true);
  if (!byId("leaving").open) byId("leaving").showModal();
}

function refused({ about, code, reason }) {
  const { name, value } = route(), lostSeat = about === "hello";
  isBeginning = false;
  fixed = null;
  if (lostSeat && (STUDY || !embed)) link.seat = null;
  if (lostSeat && STUDY) return goOn(code === "unknown" ? "" : reason); // the study gives a new seat
  if (embed) embed.refused({ about, reason });
  else if (lostSeat) return welcomed.guests ? show() : giveUp(reason); // to look on, if its room is still there
  else if (!table.room && name !== "") {
    wantsSeat = "";
    table.lesson.stop();
    return giveUp(ROOMS.includes(name) && code === "unknown" ? `There is no room ${value}. If the code is right, the room is closed: look for its games under Recorded games.` : reason);
  }
  say(reason);
}

// Show the signs and keys.
function explain() {
  byId("keys-placed").hidden = byId("placing").hidden;
  byId("keys-drawn").hidden = !byId("placing").hidden;
  byId("legend").showModal();
  byId("legend").scrollTop = 0;
}

on("click", {
  signs: explain, "start-signs": explain,
  "leave-now": () => {
    byId("leaving").close();
    table.leave();
    go(goal);
  },
});
hear(link, {
  welcome: (welcome) => {
    welcomed = welcome;
    isBeginning = false;
    say("");
    lobby.show(welcome);
    const seat = wantedSeat();
    if (!seat || seat.token !== link.requestedSeat?.token) show(); // else the server sends the seat by itself
  },
  seated: ({ room }) => {
    if (fixed) table.start = { room, message: fixed };
    fixed = null;
    if (isBeginning) link.send({ type: "ready" });
    isBeginning = false;
  },
  closed: () => say(link.quiet
    ? "This seat was taken over by another window. Close this one, or reload it to take the seat back."
    : "The connection is lost; trying again…", Infinity),
  notice: ({ text }) => say(text),
  refused,
});
addEventListener("keydown", (event) => {
  const { target } = /** @type {any} */ (event);
  if (/^(Tab|Arrow)/.test(event.key)) document.documentElement.dataset.keys = "";
  if (event.key !== "?" || event.ctrlKey || event.metaKey || target.closest("input:not([type=range], [type=checkbox])")) return;
  if (!document.querySelector("dialog[open]")) explain();
  event.preventDefault();
}, true);
addEventListener("pointerdown", () => { delete document.documentElement.dataset.keys; }, true);
if (STUDY) {
  document.body.classList.add("study");
  document.title = "A game";
  byId("leave").before(make("a", { href: `${STUDY}#stop`, className: "button quiet" }, "Stop"));
  hear(link, { room: ({ phase }) => { if (phase === "over") setTimeout(goOn, RESULT_MS); } });
}
addEventListener("hashchange", show);
show();
