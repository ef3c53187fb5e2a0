// The monitor of a study: a row for each participant. It only reads.

import { byId, make } from "/static/elements.js";

const EVERY_MS = 2000;
const HEADS = ["Name", "Where", "Last seen", "Step", "Block", "Order", "Games won", "Done"];
const rows = make("tbody", { id: "rows" }), heads = HEADS.map((head) => make("th", { scope: "col" }, head));
const table = make("table", {}, make("thead", {}, make("tr", {}, ...heads)), rows);

async function look() {
  try {
    const headers = { authorization: `Bearer ${decodeURIComponent(location.hash.slice(1))}` };
    const answer = await fetch("/study/monitor/data", { headers }), report = await answer.json();
    byId("lost").textContent = report.fault ?? "";
    if (report.rows) show(report);
  } catch {
    byId("lost").textContent = "The server does not answer. You see what it said last.";
  }
  setTimeout(look, EVERY_MS);
}

function show({ title, games, rows: lines }) {
  byId("heading").textContent = document.title = title;
  rows.dataset.games = games;
  rows.replaceChildren(...lines.map(({ name, where, seen_s, step, fault, block, order, won, played, done, of }) => make(
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

document.body.classList.add("monitor");
byId("heading").textContent = document.title = "Monitor";
byId("asked").append(make("div", { className: "scrolls", role: "region", tabIndex: 0, "aria-labelledby": "heading" }, table));
addEventListener("hashchange", () => location.reload());
look();
