// The ladder: somebody's code, the level that they have reached, and whom they meet next.

import { called } from "./cards.js";
import { at } from "./elements.js";

const MARGIN = 100; // points beyond the first and the last opponent
const INK = "#1b1f24", LINE = "#767c85", LEVEL = "#0b6e4f";

export class Climbing {
  // begin: sends what opens a room, and begins in it at once.
  constructor(link, begin) {
    this.link = link;
    at("climber").addEventListener("submit", (event) => {
      event.preventDefault();
      this.ask();
    });
    at("climber-code").addEventListener("input", () => this.forget());
    at("climber-system").addEventListener("change", () => this.forget());
    at("climb").addEventListener("click", () => begin({ type: "climb", ...this.who }));
  }

  get who() { return { code: at("climber-code").value.trim(), system: at("climber-system").value || null }; }

  // Offer the control systems that there are.
  offer({ systems, default_systems: [own] }) {
    if (at("climber-system").options.length) return;
    at("climber-system").append(...systems.map(({ name, takes }) => new Option(`${called(name)}: ${takes}`, name)));
    at("climber-system").value = own;
  }

  ask() { this.link.send({ type: "ask_level", ...this.who }); }

  // What is shown is of another code or system.
  forget() { at("reached").hidden = true; }

  show(level) {
    const { code, system, games, opponent, side } = level, words = said(level);
    at("climber-code").value = code;
    at("climber-system").value = system;
    at("reached").hidden = false;
    at("reached-text").textContent = games ? words : `No game yet. ${words}`;
    at("reached-now").textContent = words;
    at("climb").textContent = `Play against ${called(opponent)}, as ${side}`;
    paint(at("rungs"), level);
  }
}

function said({ level, low, high, games }) {
  const [from, to, value] = [low, high, level].map((points) => Math.round(points));
  if (!games) return `Most people are between ${from} and ${to}.`;
  return `Your level is ${value} after ${games} ${games === 1 ? "game" : "games"}; it is likely between ${from} and ${to}.`;
}

// All opponents by their ratings, the level with its interval, and who comes next.
function paint(canvas, { level, low, high, opponent, rungs }) {
  const pen = canvas.getContext("2d"), { width, height } = canvas, base = height * 0.62, unit = height / 6;
  const ratings = rungs.map(({ rating }) => rating), least = Math.min(...ratings) - MARGIN, most = Math.max(...ratings) + MARGIN;
  const x = (points) => width * Math.min(Math.max((points - least) / (most - least), 0), 1);
  const bar = (colour, from, to, y, thick) => {
    pen.fillStyle = colour;
    pen.fillRect(from, y - thick / 2, Math.max(to - from, 4), thick);
  };
  pen.clearRect(0, 0, width, height);
  bar("#9bd3bf", x(low), x(high), base, unit);
  bar(LINE, 0, width, base, 2);
  pen.font = `${0.85 * unit}px system-ui, sans-serif`;
  pen.textAlign = "center";
  for (const { name, rating } of rungs) {
    const isNext = name === opponent;
    bar(isNext ? INK : LINE, x(rating), x(rating), base, isNext ? 2.4 * unit : unit);
    if (!isNext) continue;
    const half = pen.measureText(called(name)).width / 2;
    pen.fillText(called(name), Math.min(Math.max(x(rating), half), width - half), base - 1.6 * unit);
  }
  pen.fillStyle = LEVEL;
  pen.beginPath();
  pen.arc(Math.min(Math.max(x(level), unit / 2), width - unit / 2), base, unit / 2, 0, 7);
  pen.fill();
  pen.fillText("you", Math.min(Math.max(x(level), unit), width - unit), base + 1.7 * unit);
  canvas.setAttribute("aria-label", `Level ${Math.round(level)} on the ladder from ${called(rungs[0].name)}, ${ratings[0]}, to ${called(rungs.at(-1).name)}, ${ratings.at(-1)}`);
}
