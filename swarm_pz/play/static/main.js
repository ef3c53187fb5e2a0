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

function wanted() {
  const [name, value = ""] = decodeURIComponent(location.hash.slice(1)).split("=", 2);
  return { name, value };
}

// The token goes out only for the room that the address names: elsewhere one begins anew.
function wantedSeat() {
  const { name, value } = wanted();
  return name === "room" && link.seat?.room === value ? link.seat : null;
}

function go(hash) {
  history.replaceState(null, "", hash ? `#${hash}` : location.pathname);
  show();
}

export function say(text) {
  document.getElementById("says").textContent = text;
}

function show() {
  const { name, value } = wanted();
  const atTable = name !== "";
  document.getElementById("lobby").hidden = atTable;
  document.getElementById("table").hidden = !atTable;
  if (!atTable) lobby.show(welcomed);
  if (!welcomed || !atTable) return;
  if (name === "play") {
    link.send({ type: "create", seat: "red", ...(value && value !== "none" ? { opponent: value } : {}),
      settings: value === "none" ? { blue: 0 } : {} });
    link.send({ type: "ready" });
  } else if (name === "room") {
    if (!wantedSeat()) link.send({ type: "join", room: value, seat: "watch" });
  } else if (name === "replay") link.send({ type: "open_replay", recording: value });
  else if (name === "lesson") table.startLesson();
  else go("");
}

link.addEventListener("welcome", ({ detail }) => {
  welcomed = detail;
  say("");
  show();
});
link.addEventListener("seated", ({ detail }) => history.replaceState(null, "", `#room=${detail.room}`));
link.addEventListener("room", ({ detail }) => {
  if (detail.phase !== "replay") history.replaceState(null, "", `#room=${detail.code}`);
  document.getElementById("lobby").hidden = true;
  document.getElementById("table").hidden = false;
});
link.addEventListener("closed", () => say(link.quiet
  ? "This seat was taken over by another window. Close this one, or reload it to take the seat back."
  : "The connection is lost; trying again…"));
link.addEventListener("notice", ({ detail }) => say(detail.text));
link.addEventListener("refused", ({ detail }) => {
  if (detail.about === "hello") {
    link.seat = null;
    go("");
  }
  if (["join", "create", "open_replay"].includes(detail.about)) go("");
  say(detail.reason);
});
addEventListener("hashchange", show);
show();
