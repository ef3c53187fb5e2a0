// The monitor of who runs a study: each participant's row, as the server has it. Nothing here changes anything.

const at = (id) => document.getElementById(id);
const EVERY_MS = 2000;

async function look() {
  try {
    const headers = { authorization: `Bearer ${decodeURIComponent(location.hash.slice(1))}` };
    const answer = await fetch("/study/monitor/data", { headers }), told = await answer.json();
    at("lost").textContent = told.fault ?? "";
    if (told.rows) show(told);
  } catch {
    at("lost").textContent = "The server does not answer; this is what was seen last.";
  }
  setTimeout(look, EVERY_MS);
}

function show({ title, games, rows }) {
  at("heading").textContent = document.title = title;
  at("rows").replaceChildren(...rows.map((row) => {
    const line = document.createElement("tr");
    const cells = [row.name, row.where, seen(row.seen_s), row.step, row.block, row.order.join(", "),
      `${row.won} of ${row.played}`, row.of ? `${row.done} of ${row.of}` : ""];
    cells.forEach((text, place) => {
      const cell = document.createElement(place ? "td" : "th");
      if (!place) cell.scope = "row";
      cell.textContent = text;
      line.append(cell);
    });
    if (row.fault) {
      const cell = line.children[3];
      cell.textContent = row.fault;
      cell.className = "fault";
    }
    line.dataset.name = row.name;
    return line;
  }));
  at("rows").dataset.games = games;
}

function seen(seconds) {
  if (seconds === null) return "never";
  if (seconds < 10) return "now";
  return seconds < 120 ? `${Math.round(seconds)} s ago` : `${Math.round(seconds / 60)} min ago`;
}

addEventListener("hashchange", () => location.reload());
look();
