// The ladder: somebody's code, the level that they have reached, and whom they meet next.

import { byId, on } from "./elements.js";
import { called, systemOption } from "./words.js";

export class Climbing {
  // begin: sends what opens a room, and begins in it at once.
  constructor(link, begin) {
    this.link = link;
    const isOld = () => { byId("reached").hidden = true; }; // what is shown is of another code or system
    on("submit", { climber: () => this.ask() });
    on("input", { "climber-code": isOld, "climber-system": isOld });
    on("click", { climb: () => begin({ type: "climb", ...this.who }) });
  }

  get who() { return { code: byId("climber-code").value.trim(), system: byId("climber-system").value || null }; }

  // Offer the control systems that there are; before this file had come, the form would have left the page.
  offer({ systems, default_systems: [own] }) {
    byId("ask-level").disabled = false;
    if (byId("climber-system").options.length) return;
    byId("climber-system").append(...systems.map(systemOption));
    byId("climber-system").value = own;
  }

  ask() { this.link.send({ type: "ask_level", ...this.who }); }

  show(level) {
    const { code, system, games, opponent, side } = level, words = said(level);
    byId("climber-code").value = code;
    byId("climber-system").value = system;
    byId("reached").hidden = false;
    byId("reached-text").textContent = games ? words : `No game yet. ${words}`;
    byId("reached-now").textContent = words;
    byId("climb").textContent = `Play against ${called(opponent)}, as ${side}`;
  }
}

function said({ level, low, high, games }) {
  const [from, to, value] = [low, high, level].map(Math.round);
  if (!games) return `Most people are between ${from} and ${to}.`;
  return `Your level is ${value} after ${games} ${games === 1 ? "game" : "games"}; it is likely between ${from} and ${to}.`;
}
