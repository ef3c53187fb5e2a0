// The start: play at once, learn it, open a room or join one, go back to one's seat, watch what was recorded.

import { called, levelElement, levelsOf, paintPoster } from "./cards.js";
import { listGames } from "./games.js";

const at = (id) => document.getElementById(id);
const STORE_NAME = "swarm-pz.name", STORE_OPPONENT = "swarm-pz.opponent";
const FIRST = "uniform"; // whom a newcomer meets

export class Lobby {
  // begin: opens a room by a message and begins in it at once; go: changes the address.
  constructor(link, { begin, go }) {
    Object.assign(this, { link, begin, go });
    const on = (id, act) => at(id).addEventListener("click", act);
    on("quick", () => this.play(this.next));
    on("start-lesson", () => go("lesson"));
    on("invite-somebody", () => link.send({ type: "create", seat: "red", label: at("label").value }));
    on("return", () => go(`room=${link.lastSeat.room}`));
    on("all-opponents", () => this.showAll(!at("opponents").classList.contains("all")));
    on("all-games", () => { at("recorded").open = true; at("recorded").scrollIntoView(); });
    on("look-on", () => { if (at("code").reportValidity()) this.enter("watch"); });
    at("recorded").addEventListener("toggle", () => { if (at("recorded").open) listGames(at("games")); });
    at("create").addEventListener("submit", (event) => this.create(event));
    at("join").addEventListener("submit", (event) => {
      event.preventDefault();
      this.enter("room");
    });
    at("opponent").addEventListener("change", () => this.describe());
    at("side").addEventListener("change", () => this.showSides());
    at("label").value = recall(STORE_NAME);
    at("label").addEventListener("input", () => remember(STORE_NAME, at("label").value));
  }

  show(welcome) {
    const seat = this.link.lastSeat;
    at("return").hidden = !seat;
    if (seat) at("return").textContent = `Return to your seat in room ${seat.room}`;
    at("quick").classList.toggle("primary", !seat);
    if (at("recorded").open) listGames(at("games"));
    if (!welcome) return;
    at("quick").disabled = at("invite-somebody").disabled = false;
    at("start-ladder").hidden = !welcome.ladder;
    this.suggest(welcome.policies);
    at("label-hint").textContent = welcome.records_labels
      ? "This host records it with your games." : "It stays in this browser; those at your table see it.";
    if (at("opponent").options.length) return;
    this.policies = welcome.policies;
    const levels = levelsOf(welcome.policies);
    at("opponents").replaceChildren(...levels.map((level) => levelElement(level, (name) => this.play(name))));
    at("all-opponents").hidden = !at("opponents").querySelector(".rest");
    const players = () => [
      new Option("a person, in another window or on another device", ""),
      ...welcome.policies.map(({ name }) => new Option(called(name), name)),
    ];
    at("opponent").append(...players());
    at("opponent").add(new Option("nobody: practise alone", "none"), 1);
    at("player").append(...players());
    at("opponent").value = FIRST;
    for (const [i, side] of ["red", "blue"].entries()) {
      at(`${side}-system`).append(...welcome.systems.map(({ name, takes }) => new Option(`${called(name)}: ${takes}`, name)));
      at(`${side}-system`).value = welcome.default_systems[i];
    }
    this.describe();
  }

  // Whom the first button plays: the one of last time, or whom a newcomer meets.
  suggest(policies) {
    const find = (wanted) => policies.find(({ name }) => name === wanted);
    const policy = find(recall(STORE_OPPONENT)) ?? find(FIRST) ?? policies[0];
    this.next = policy?.name;
    at("quick").hidden = !policy;
    at("quick").textContent = policy ? `Play against ${called(policy.name)}` : "";
    paintPoster(at("poster"), policy?.card);
  }

  showAll(all) {
    at("opponents").classList.toggle("all", all);
    at("all-opponents").setAttribute("aria-expanded", String(all));
    at("all-opponents").textContent = all ? "Fewer opponents" : "All opponents";
  }

  // The form's players by their colours.
  showSides() {
    const side = at("side").value, isWatched = side === "watch";
    at("red-player").hidden = !isWatched;
    at("opponent-side").textContent = isWatched ? "Blue" : `${side === "red" ? "Blue" : "Red"}, the opponent`;
  }

  describe() {
    const policy = this.policies.find(({ name }) => name === at("opponent").value);
    at("opponent-about").textContent = policy?.about ?? "";
  }

  // To the room whose code was typed.
  enter(how) {
    this.typed = at("code").value.toUpperCase();
    this.go(`${how}=${this.typed}`);
  }

  // Say that a room is no more, and lead to what was played in it.
  async gone(room, restarted) {
    const games = listGames(at("gone-games"), room);
    if (this.typed === room && !await games) { // most likely a slip, and corrected where it was made
      at("code-fault").textContent = `There is no room ${room}. Look at its code again: it may also be closed.`;
      at("code").focus();
      at("code").select();
      return;
    }
    at("gone").hidden = false;
    const what = restarted ? `The table was started anew, and room ${room} is gone with it.` : `There is no room ${room} any more.`;
    at("gone-text").textContent = what;
    const count = await games;
    at("gone-text").textContent = count ? `${what} What was played in it is recorded:` : what;
  }

  forgive() {
    at("gone").hidden = true;
    at("code-fault").textContent = this.typed = "";
  }

  play(opponent) {
    remember(STORE_OPPONENT, opponent);
    this.begin({ seat: "red", opponent });
  }

  create(event) {
    event.preventDefault();
    const opponent = at("opponent").value, seat = at("side").value;
    const settings = {
      red: Number(at("red-drones").value),
      blue: Number(at("blue-drones").value),
      time_limit: at("time-limit").value ? Number(at("time-limit").value) : null,
      mapping: at("mapping").value,
      speed: Number(at("speed").value),
      red_system: at("red-system").value || null,
      blue_system: at("blue-system").value || null,
    };
    if (opponent === "none") settings[seat === "blue" ? "red" : "blue"] = 0;
    const isPolicy = opponent && opponent !== "none", player = seat === "watch" && at("player").value;
    this.link.send({
      type: "create", settings, seat, label: at("label").value,
      ...(isPolicy ? { opponent } : {}), ...(player ? { player } : {}),
    });
  }
}

function recall(key) {
  try { return localStorage.getItem(key) ?? ""; } catch { return ""; }
}

function remember(key, value) {
  try { localStorage.setItem(key, value); } catch { /* a page without storage forgets */ }
}
