// The monitor of a study: a row for each participant. It only reads.

import { byId, make } from "./elements.js";

const EVERY_MS = 2000;

async function look() {
  try {
    const headers = { authorization: `Bearer ${decodeURIComponent(location.hash.slice(1))}` };
    const answer = await fetch("/study/monitor/data", { headers }), told = await answer.json();
    byId("lost").textContent = told.fault ?? "";
    if (told.rows) show(told);
  } catch {
    byId("lost").textContent = "The server does not answer. You see what it said last.";
  }
  setTimeout(look, EVERY_MS);
}

function show({ title, games, rows }) {
  byId("heading").textContent = document.title = title;
  byId("rows").dataset.games = games;
  byId("rows").replaceChildren(...rows.map(({ name, where, seen_s, step, fault, block, order, won, played, done, of }) => make(
    "tr", { "data-name": name }, make("th", { scope: "row" }, name),
    ...[where, seen(seen_s)].map((text) => make("td", {}, text)), make("td", { className: fault ? "fault" : "" }, fault || step),
    ...[block, order.join(", "), `${won} of ${played}`, of ? `${done} of ${of}` : ""].map((text) => make("td", {}, text)),
  )));
}

function seen(seconds) {
  if (seconds === null) return "never";
  if (seconds < 10) return "now";
  return seconds < 120 ? `${Math.round(seconds)} s ago` : `${Math.round(seconds / 60)} min ago`;
}

addEventListener("hashchange", () => location.reload());
look();
