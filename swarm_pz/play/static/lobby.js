// The start: play, learn, open or join a room, return to a seat, watch recorded games.

import { opponentCards, paintPoster } from "./cards.js";
import { byId, make, on } from "./elements.js";
import { onLook } from "./ground.js";
import { SERVER } from "./link.js";
import { daily, daysInARow, inARow, isDayWon, progress, ROUND, sideIn } from "./progress.js";
import { called, clock, playerOf, SIDES, TICKS } from "./words.js";

const FIRST = "uniform"; // chosen in the form at first

export class Lobby {
  // begin: opens a room with a message and is ready at once; go: changes the address.
  constructor(link, { begin, go }) {
    this.link = link;
    this.begin = begin;
    this.go = go;
    on("click", {
      quick: () => this.play(this.next),
      "start-lesson": () => go("lesson"),
      daily: () => go("daily"),
      "invite-somebody": () => link.send({ type: "create", seat: "red", settings: ROUND, label: byId("label").value }),
      return: () => go(`room=${link.lastSeat.room}`),
      "look-on": () => { if (byId("code").reportValidity()) this.enter("watch"); },
    });
    on("toggle", { recorded: () => { if (byId("recorded").open) listGames(this.link.table, byId("games")); } });
    on("submit", { create: () => this.create(), join: () => this.enter("room") });
    on("change", { side: () => this.showSides() });
    onLook(() => { if (this.welcome) this.suggest(this.welcome); });
  }

  show(welcome) {
    const seat = this.link.lastSeat;
    byId("return").hidden = !seat;
    if (seat) byId("return").textContent = `Return to your seat in room ${seat.room}`;
    byId("quick").classList.toggle("primary", !seat);
    if (byId("recorded").open) listGames(this.link.table, byId("games"));
    if (!welcome) return;
    byId("quick").disabled = byId("invite-somebody").disabled = false;
    for (const id of ["invite-somebody", "join", "side-watch"]) byId(id).hidden = !welcome.guests;
    byId("daily").hidden = welcome.guests;
    byId("side-watch").disabled = !welcome.guests; // some browsers list hidden options
    this.suggest(this.welcome = welcome);
    if (!byId("opponent").options.length) this.offer(welcome);
  }

  // Fill the form with players and control systems.
  offer({ policies, systems, default_systems: defaults, guests }) {
    for (const id of ["opponent", "player"]) {
      const people = guests ? [new Option("a person, in another window or on another device", "")] : [];
      byId(id).append(...people, ...policies.map(({ name, about }) => new Option(`${called(name)}${about ? `: ${about}` : ""}`, name)));
    }
    byId("opponent").add(new Option("nobody: practise alone", "none"), guests ? 1 : 0);
    byId("opponent").value = FIRST;
    SIDES.forEach((side, i) => {
      byId(`${side}-system`).append(...systems.map(({ name, takes }) => new Option(`${called(name)}: ${takes}`, name)));
      byId(`${side}-system`).value = defaults[i];
    });
  }

  // Show the next opponent, and the list of opponents.
  suggest({ policies, opponents }) {
    const reached = progress(opponents), policy = policies.find(({ name }) => name === reached.next);
    this.next = reached.next;
    const { day, opponent } = daily(opponents);
    byId("daily").textContent = `Game of the day: ${called(opponent)}${isDayWon(day) ? ", won" : ""}${daysInARow(day)}`;
    byId("next").textContent = `Next: ${called(reached.next)}. ${inARow(reached.streak)}`;
    byId("opponents").replaceChildren(...opponentCards(policies, opponents, reached, (name) => this.play(name)));
    paintPoster(byId("poster"), policy.card);
  }

  // Label the form's players by their colours.
  showSides() {
    const side = byId("side").value, isWatched = side === "watch";
    byId("red-player").hidden = !isWatched;
    byId("opponent-side").textContent = isWatched ? "Blue" : `${side === "red" ? "Blue" : "Red"}, the opponent`;
  }

  // Go to the room of the typed code.
  enter(view) { this.go(`${view}=${byId("code").value.toUpperCase()}`); }

  play(opponent) { this.begin({ seat: "red", opponent, settings: ROUND }); }

  create() {
    const value = (id) => byId(id).value || null, opponent = value("opponent"), seat = value("side");
    const player = seat === "watch" ? value("player") : null;
    const settings = {
      red: Number(value("red-drones")), blue: Number(value("blue-drones")),
      time_limit: value("time-limit") && Number(value("time-limit")), speed: Number(value("speed")),
      majority: value("decided") === "majority", red_system: value("red-system"), blue_system: value("blue-system"),
    };
    if (opponent === "none") settings[seat === "blue" ? "red" : "blue"] = 0;
    this.link.send({
      type: "create", settings, seat, label: byId("label").value, player, opponent: opponent === "none" ? null : opponent,
    });
  }
}

// Fill a list with links to the recorded games.
async function listGames(table, list) {
  const answer = await table.fetch("recordings");
  const games = answer?.ok ? await answer.json() : [];
  const shown = games.filter(({ lesson }) => !lesson);
  list.replaceChildren(...shown.map((game) => {
    const parts = [["strong", players(game, table !== SERVER)], ["span", ending(game)], ["small", title(game)]].filter(([, words]) => words);
    const href = `#replay=${encodeURIComponent(game.name)}`;
    return make("li", {}, make("a", { href }, ...parts.flatMap(([tag, words]) => [make(tag, {}, words), " "])));
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
