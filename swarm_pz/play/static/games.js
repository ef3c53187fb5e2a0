// Recorded games: links with players and results.

import { make } from "./elements.js";
import { SERVER } from "./link.js";
import { sideIn } from "./progress.js";
import { clock, playerOf, SIDES, TICKS } from "./words.js";

const NAME = /^(\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d)Z-([A-Z0-9]+)-(\d+)/;

// Fill a list with links to the recorded games.
export async function listGames(table, list) {
  const answer = await table.fetch("recordings");
  const games = answer?.ok ? await answer.json() : [];
  const shown = games.filter(({ lesson }) => !lesson);
  list.replaceChildren(...shown.map((game) => {
    const told = [["strong", players(game, table !== SERVER)], ["span", ending(game)], ["small", title(game)]].filter(([, words]) => words);
    const href = `#replay=${encodeURIComponent(game.name)}`;
    return make("li", {}, make("a", { href }, ...told.flatMap(([tag, words]) => [make(tag, {}, words), " "])));
  }));
  if (!shown.length) list.append(make("li", {}, "None so far."));
}

// Name the players; without a server every person is the visitor.
function players({ name, red, blue }, isAlone) {
  const [one, other] = [red ?? {}, blue ?? {}].map((seat, i) => (
    sideIn(name) === SIDES[i] || (isAlone && seat.kind === "person") ? "you" : playerOf(seat)));
  return red && blue ? `${one} (red) against ${other} (blue)` : "";
}

function ending({ outcome, ended_by: by, seconds, sizes }) {
  if (!outcome) return "not finished";
  const left = { left: ", somebody had left", forfeit: ", by forfeit" }[by] ?? "", after = `after ${clock(TICKS * seconds)}`;
  if (outcome === "stopped") return `stopped ${after}${left}`;
  return `${outcome === "draw" ? `a draw, ${sizes.join(" to ")},` : `${outcome} won`} ${after}${left}`;
}

function title({ name }) {
  const parts = name.match(NAME);
  if (!parts) return name;
  const [year, month, day, hour, minute, second] = parts.slice(1, 7).map(Number);
  const began = new Date(Date.UTC(year, month - 1, day, hour, minute, second));
  return `${began.toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" })}, room ${parts[7]}, game ${parts[8]}`;
}
