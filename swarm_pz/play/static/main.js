// The page: which view is shown, and what its address asks for.
//   #play=ring   straight into a game against a policy      #room=ABCD   to a room
//   #replay=FILE a recorded game                            #lesson      the first lesson

import { Link } from "./link.js";
import { Lobby } from "./lobby.js";
import { Table } from "./table.js";

const link = new Link(wantedSeat);
const lobby = new Lobby(link);
const table = new Table(link, { left: () => go("") });
let welcomed = null;
let ready = false; // who comes for a game at once is ready as soon as they sit
const SAYING_MS = 6000;

function wanted() {
  try {
    const [name, value = ""] = decodeURIComponent(location.hash.slice(1)).split("=", 2);
    return { name, value };
  } catch { return { name: "", value: "" }; }
}

// The token goes out only for the room that the address names: elsewhere one begins anew.
function wantedSeat() {
  const { name, value } = wanted();
  return name === "room" ? [link.seat, link.lastSeat].find((seat) => seat?.room === value) ?? null : null;
}

function go(hash) {
  history.replaceState(null, "", hash ? `#${hash}` : location.pathname);
  show();
}

// Tell something; it goes away by itself unless it is still so.
function say(text, stays = false) {
  document.getElementById("says").textContent = text;
  say.stays = stays;
  clearTimeout(say.later);
  if (text && !stays) say.later = setTimeout(() => say(""), SAYING_MS);
}

function open(name) {
  if (document.getElementById(name).hidden && !say.stays) say(""); // what was said was about the other view
  document.getElementById("lobby").hidden = name !== "lobby";
  document.getElementById("table").hidden = name !== "table";
}

function show() {
  const { name, value } = wanted();
  open(name === "" ? "lobby" : "table");
  if (name === "") {
    table.lesson.stop();
    lobby.show(welcomed);
  }
  if (!welcomed || name === "") return;
  if (name === "play") {
    ready = true;
    link.send({ type: "create", seat: "red", ...(value && value !== "none" ? { opponent: value } : {}),
      settings: value === "none" ? { blue: 0 } : {} });
  } else if (name === "room") {
    if (table.room?.code === value) return;
    if (wantedSeat()) link.reopen();
    else link.send({ type: "join", room: value, seat: "watch" });
  } else if (name === "replay") {
    table.load(value);
    link.send({ type: "open_replay", recording: value });
  } else if (name === "lesson") {
    ready = true;
    table.lesson.start();
  } else go("");
}

link.addEventListener("welcome", ({ detail }) => {
  welcomed = detail;
  say("");
  if (!wantedSeat()) show(); // else the seat comes by itself
});
link.addEventListener("seated", ({ detail }) => {
  history.replaceState(null, "", `#room=${detail.room}`);
  if (ready) link.send({ type: "ready" });
  ready = false;
});
link.addEventListener("room", ({ detail }) => {
  if (detail.phase !== "replay") history.replaceState(null, "", `#room=${detail.code}`);
  open("table");
});
link.addEventListener("closed", () => say(link.quiet
  ? "This seat was taken over by another window. Close this one, or reload it to take the seat back."
  : "The connection is lost; trying again…", true));
link.addEventListener("notice", ({ detail }) => say(detail.text));
link.addEventListener("refused", ({ detail }) => {
  ready = false;
  if (detail.about === "hello") { // the seat is gone: look on, if its room is still there
    link.seat = null;
    show();
  } else if (["join", "create", "open_replay"].includes(detail.about) && !table.room) go("");
  say(detail.reason);
});
addEventListener("hashchange", show);
show();
