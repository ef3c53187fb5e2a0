// The page: which view is shown, and what its address asks for.
//   #room=ABCD   to a room: to one's seat there, or the free one, or to look on
//   #watch=ABCD  to a room, to look on               #play=ring   straight into a game against a policy
//   #replay=FILE a recorded game                     #lesson      the first lesson
//   #ladder      to one's level                      #embed=ORIGIN  in the frame of an experiment there
// At /study/CODE/game it is a game of a study, without anything but the game: afterwards one goes back there.

import { Legend } from "./legend.js";
import { Link } from "./link.js";
import { Lobby } from "./lobby.js";
import { placeOf, Table } from "./table.js";
import { freeSides } from "./waiting.js";

const at = (id) => document.getElementById(id);
const SAYING_MS = 6000;
const CODE = /^[A-Z0-9]{4,8}$/;
const ROOMS = ["room", "watch"];
const STUDY = /^(\/study\/[^/]+)\/game$/.exec(location.pathname)?.[1];
const RESULT_MS = 6000; // for which the result of a study's game is shown

const framed = wanted().name === "embed" ? await import("./embed.js") : null;
const link = new Link(wantedSeat);
new Legend();
const lobby = new Lobby(link, { begin, go });
// Before the table hears it: what is hidden takes no focus, and what one has left is not shown.
link.addEventListener("room", (event) => {
  if (placeOf(event.detail) === table.leftPlace) event.stopImmediatePropagation();
  else arrive(event.detail);
});
const table = new Table(link, { left: () => go(home), begin });
const embed = framed && new framed.Embed(link, wanted().value, begin);
let welcomed = null;
let isBeginning = false; // who comes for a game at once is ready as soon as they sit
let wantsSeat = ""; // the room that an address led to, in which one has no seat yet
let home = ""; // where one goes from a table: the ladder, for who climbs
let climbing = null; // its code is fetched when somebody wants it
let goal = ""; // where to, once a running game may be left

// What the address asks for; codes of rooms in whatever case.
function wanted() {
  try {
    const [name, value = ""] = decodeURIComponent(location.hash.slice(1)).split("=", 2);
    return { name, value: ROOMS.includes(name) ? value.toUpperCase() : value };
  } catch { return { name: "", value: "" }; }
}

// The token goes out only for the room that the address names: elsewhere one begins anew.
function wantedSeat() {
  const { name, value } = wanted();
  return name === "room" ? [link.seat, link.lastSeat].find((seat) => seat?.room === value) ?? null : null;
}

// Set the address: each place that one goes to is a step back in the browser's history.
function mark(hash, isNew) {
  if (location.hash === (hash ? `#${hash}` : "")) return;
  history[isNew ? "pushState" : "replaceState"](null, "", hash ? `#${hash}` : location.pathname);
}

// Go back to the study that the game is a part of.
function goOn(told = "") {
  try { sessionStorage.setItem("swarm-pz.told", told); } catch { /* then it is not told */ }
  location.replace(STUDY);
}

function go(hash) {
  mark(hash, true);
  show();
}

// Go back to the start, from an address that leads nowhere.
function giveUp() {
  mark("", false);
  show();
}

// Tell something; it goes away by itself unless it is still so.
function say(text, stays = false) {
  at("says").textContent = text;
  say.stays = stays;
  clearTimeout(say.later);
  if (text && !stays) say.later = setTimeout(() => say(""), SAYING_MS);
}

function open(name) {
  const isNew = at(name).hidden;
  at("lobby").hidden = name !== "lobby";
  at("table").hidden = name !== "table";
  at("ladder").hidden = name !== "ladder";
  if (isNew) {
    scrollTo(0, 0);
    if (!say.stays) say(""); // what was said was about the other view
  }
  return isNew;
}

// Open a room and begin in it at once; tell whether that could be asked for.
function begin(message) {
  if (isBeginning) return false;
  isBeginning = link.send(message.type === "climb" ? message : { type: "create", label: at("label").value, settings: {}, ...message });
  if (!isBeginning) say("The table does not answer yet; try again in a moment.");
  return isBeginning;
}

function show() {
  const { name, value } = wanted();
  const isHere = ROOMS.includes(name) && table.room?.code === value;
  if (table.isPlaying && !isHere) {
    ask();
    return;
  }
  if (name === "ladder") {
    table.leave();
    home = "ladder";
    if (open("ladder")) at("climber-code").focus({ preventScroll: true });
    if (welcomed) climb();
    return;
  }
  if (name === "" && STUDY) {
    goOn();
    return;
  }
  if (name === "") {
    home = "";
    table.leave();
    if (open("lobby")) at("quick").focus({ preventScroll: true });
    lobby.show(welcomed);
    return;
  }
  open("table");
  if (!welcomed || isHere) return;
  if (name === "embed" && embed) table.cover.wait(embed.waiting);
  else if (name === "play") begin({ seat: "red", ...(value && value !== "none" ? { opponent: value } : { settings: { blue: 0 } }) });
  else if (ROOMS.includes(name)) enter(name, value);
  else if (name === "replay") {
    table.leave();
    table.opens(value);
    link.send({ type: "open_replay", recording: value });
  } else if (name === "lesson") {
    table.leave();
    table.learn();
  } else giveUp();
}

// Show the ladder, and somebody's level, if there is one to show; else ask for that of the code that stands there.
async function climb(level = null) {
  if (!welcomed.ladder) {
    giveUp();
    say("There is no ladder at this table.");
    return;
  }
  climbing ??= import("./climb.js").then(({ Climbing }) => new Climbing(link, begin));
  const here = await climbing;
  here.offer(welcomed);
  if (level) here.show(level);
  else if (here.who.code) here.ask();
}

function enter(name, code) {
  table.leave();
  table.leftPlace = null;
  if (!CODE.test(code)) {
    giveUp();
    say("A room's code has four letters and digits.");
  } else if (wantedSeat()) link.reopen();
  else if (STUDY) goOn();
  else {
    wantsSeat = name === "room" ? code : "";
    link.send({ type: "join", room: code, seat: "watch" });
  }
}

// A room's state has come: show it, and sit down if that is what one came for.
function arrive(room) {
  const [side] = wantsSeat === room.code && table.seat === null ? freeSides(room) : [];
  if (room.phase !== "replay") {
    const how = table.seat !== null || side ? "room" : "watch";
    mark(`${how}=${room.code}`, ["", "replay"].includes(wanted().name));
  }
  lobby.forgive();
  open("table");
  wantsSeat = "";
  if (side) link.send({ type: "join", room: room.code, seat: side, label: at("label").value });
}

// A running game is not left by a slip of the hand.
function ask() {
  goal = location.hash.slice(1);
  mark(`room=${table.room.code}`, true);
  at("leaving-counts").hidden = !table.room.once; // a game of the ladder
  if (!at("leaving").open) at("leaving").showModal();
}

at("start-ladder").addEventListener("click", () => go("ladder"));
at("ladder-home").addEventListener("click", () => go(""));
at("stay").addEventListener("click", () => at("leaving").close());
at("leave-now").addEventListener("click", () => {
  at("leaving").close();
  table.leave();
  go(goal);
});
link.addEventListener("welcome", ({ detail }) => {
  welcomed = detail;
  isBeginning = false;
  say("");
  lobby.show(detail);
  const seat = wantedSeat();
  if (!seat || seat.token !== link.asked?.token) show(); // else the seat that was asked for comes by itself
});
link.addEventListener("seated", () => {
  if (isBeginning) link.send({ type: "ready" });
  isBeginning = false;
});
link.addEventListener("room", ({ detail }) => { if (detail.phase !== "playing" && at("leaving").open) at("leaving").close(); });
link.addEventListener("closed", () => say(link.quiet
  ? "This seat was taken over by another window. Close this one, or reload it to take the seat back."
  : "The connection is lost; trying again…", true));
link.addEventListener("level", ({ detail }) => {
  home = "ladder";
  climb(detail);
});
link.addEventListener("notice", ({ detail }) => say(detail.text));
link.addEventListener("refused", ({ detail }) => {
  const { name, value } = wanted();
  if (STUDY && detail.about === "hello") {
    link.seat = null;
    goOn(detail.code === "unknown" ? "" : detail.reason); // a seat that is gone is given anew there
    return;
  }
  isBeginning = false;
  if (embed) {
    embed.refused(detail);
    say(detail.reason);
    return;
  }
  if (detail.about === "hello") { // the seat is gone: see what became of it, or look on, if its room is still there
    link.seat = null;
    if (detail.recording) {
      go(`replay=${detail.recording}`);
      say(detail.reason);
    } else show();
    return;
  }
  if (!table.room && !["", "ladder"].includes(name)) {
    wantsSeat = "";
    table.lesson.stop();
    giveUp();
    if (ROOMS.includes(name)) {
      lobby.gone(value, link.restarted);
      return;
    }
  }
  say(detail.reason);
});
addEventListener("keydown", () => { document.documentElement.dataset.keys = ""; }, true);
addEventListener("pointerdown", () => { delete document.documentElement.dataset.keys; }, true);
if (STUDY) {
  document.body.classList.add("study");
  document.title = "A game";
  link.addEventListener("room", ({ detail }) => { if (detail.phase === "over") setTimeout(goOn, RESULT_MS); });
}
addEventListener("hashchange", show);
show();
