// The ladder: somebody's code, the level that they have reached, and whom they meet next.

import { byId, on } from "./elements.js";
import { disc, look } from "./ground.js";
import { called, systemOption } from "./words.js";

const MARGIN = 100; // points beyond the first and the last opponent

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
  offer({ systems, default_systems: [own], rungs }) {
    this.rungs = rungs;
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
    paint(byId("rungs"), level, this.rungs);
  }
}

function said({ level, low, high, games }) {
  const [from, to, value] = [low, high, level].map(Math.round);
  if (!games) return `Most people are between ${from} and ${to}.`;
  return `Your level is ${value} after ${games} ${games === 1 ? "game" : "games"}; it is likely between ${from} and ${to}.`;
}

// All opponents by their ratings, the level with its interval, and who comes next.
function paint(canvas, { level, low, high, opponent }, rungs) {
  const pen = canvas.getContext("2d"), { width, height } = canvas, base = height * 0.62, unit = height / 6;
  const ratings = rungs.map(({ rating }) => rating), least = Math.min(...ratings) - MARGIN, most = Math.max(...ratings) + MARGIN;
  const within = (x, margin) => Math.min(Math.max(x, margin), width - margin);
  const x = (points) => within(width * (points - least) / (most - least), 0);
  const bar = (colour, from, to, thick) => {
    pen.fillStyle = colour;
    pen.fillRect(from, base - thick / 2, Math.max(to - from, 4), thick);
  };
  pen.clearRect(0, 0, width, height);
  bar(`${look.asked}66`, x(low), x(high), unit);
  bar(look.line, 0, width, 2);
  pen.font = `${0.85 * unit}px system-ui, sans-serif`;
  pen.textAlign = "center";
  for (const { name, rating } of rungs) {
    if (name !== opponent) {
      bar(look.line, x(rating), x(rating), unit);
      continue;
    }
    bar(look.ink, x(rating), x(rating), 2.4 * unit);
    pen.fillText(called(name), within(x(rating), pen.measureText(called(name)).width / 2), base - 1.6 * unit);
  }
  pen.fillStyle = look.asked;
  disc(pen, within(x(level), unit / 2), base, unit / 2);
  pen.fillText("you", within(x(level), unit), base + 1.7 * unit);
  const [first, last] = [rungs[0], rungs.at(-1)].map(({ name }) => called(name));
  canvas.setAttribute("aria-label", `Level ${Math.round(level)} on the ladder from ${first} to ${last}`);
}
