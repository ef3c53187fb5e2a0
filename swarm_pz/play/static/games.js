// Recorded games: links with players and results.

import { make } from "./elements.js";
import { SERVER } from "./link.js";
import { sideIn } from "./progress.js";
import { clock, playerOf, SIDES, TICKS } from "./words.js";

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

function title({ name, started }) { return started ? new Date(started).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" }) : name; }
