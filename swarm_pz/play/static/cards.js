// Opponents as cards: a picture of what they do, a line, and the level that their rating puts them on.

import { COLOURS, hatch } from "./ground.js";

const LEVELS = [["Easy", -Infinity], ["Fair", 900], ["Hard", 1300]]; // from which rating on; uniform has 1000
const SHOWN = 3; // cards of a level at first
const INK = "#0b6e4f";

// A policy's name, as people read it.
export function called(name) { return name.replaceAll("_", " "); }

// The levels, each with its policies, best first; those without a rating come last and have none. Here are
// those that draw, as the games do that one click begins.
export function levelsOf(policies) {
  const levels = LEVELS.map(([title, from], i) => ({
    title,
    policies: policies.filter(({ card }) => card && card.rating >= from && card.rating < (LEVELS[i + 1]?.[1] ?? Infinity))
      .sort((a, b) => b.card.rating - a.card.rating),
  }));
  const others = { title: "Not rated", policies: policies.filter(({ card, answers }) => !card && answers === "density") };
  return [...levels, others].filter((level) => level.policies.length);
}

// A level's heading and its cards; play(name) is called for the one that is chosen.
export function levelElement({ title, policies }, play) {
  const section = document.createElement("section"), heading = document.createElement("h3"), list = document.createElement("ul");
  heading.textContent = title;
  policies.forEach((policy, i) => {
    const item = document.createElement("li");
    item.append(cardElement(policy, title, play));
    item.className = i < SHOWN ? "" : "rest";
    list.append(item);
  });
  section.append(heading, list);
  return section;
}

function cardElement({ name, about, card }, title, play) {
  const button = Object.assign(document.createElement("button"), { type: "button", className: "card" });
  const canvas = Object.assign(document.createElement("canvas"), { width: 144, height: 144 });
  canvas.setAttribute("aria-hidden", "true");
  const text = document.createElement("span");
  for (const [tag, words] of [["strong", called(name)], ["span", about], ...(card ? [["small", `${title}, rating ${card.rating}`]] : [])]) {
    text.append(Object.assign(document.createElement(tag), { textContent: words }));
  }
  button.dataset.opponent = name;
  button.append(canvas, text);
  button.addEventListener("click", () => play(name));
  paintCard(canvas, card);
  return button;
}

// What a policy asked for at a moment of a game as blue, and where its drones were.
export function paintCard(canvas, card) {
  const pen = canvas.getContext("2d"), side = canvas.width;
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, side, side);
  if (!card) return paintUnknown(pen, side);
  const cells = card.target.length, small = document.createElement("canvas");
  small.width = small.height = cells;
  const draw = small.getContext("2d");
  const asked = card.target.join(""), mean = [...asked].reduce((sum, digit) => sum + digit / 9, 0) / asked.length;
  draw.fillStyle = COLOURS[1];
  card.target.forEach((row, y) => [...row].forEach((digit, x) => {
    draw.globalAlpha = 0.65 / (1 + 3 * mean) * digit / 9; // what is asked for everywhere is faint
    draw.fillRect(x, cells - 1 - y, 1, 1);
  }));
  pen.drawImage(small, 0, 0, side, side);
  paintDrones(canvas, 1, card.drones);
}

// Drones of a team, by their places in hundredths of the map.
export function paintDrones(canvas, team, drones) {
  const pen = canvas.getContext("2d"), side = canvas.width;
  for (const [x, y] of drones) shape(pen, team, x / 100 * side, (1 - y / 100) * side, side * 0.028);
}

// Ground where red captures: columns of the board's cells, by row.
export function paintHolds(canvas, rows) {
  const pen = canvas.getContext("2d"), size = canvas.width / 50;
  pen.fillStyle = hatch(pen, 0, 1);
  for (const [y, columns] of Object.entries(rows)) for (const x of columns) pen.fillRect(x * size, (49 - y) * size, size, size);
}

function paintUnknown(pen, side) {
  pen.fillStyle = "#767c85";
  pen.font = `${side / 2}px sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText("?", side / 2, side / 2);
}

// The picture beside the title: a ring that somebody draws around the opponent, and red drones on it.
export function paintPoster(canvas, card) {
  paintCard(canvas, card);
  paintDrawing(canvas, RING, 10);
}

const RING = arc(0.31, -0.4, 4.9);
export const TIGHT = arc(0.16, 0, 2 * Math.PI), CIRCLE = arc(0.27, 0, 2 * Math.PI), CORNER = [[0.78, 0.8], [0.84, 0.86], [0.9, 0.9]];

function arc(radius, from, to) {
  return Array.from({ length: 60 }, (_, k) => {
    const angle = from + (to - from) * k / 59;
    return [0.5 + radius * Math.cos(angle), 0.5 - radius * Math.sin(angle)];
  });
}

// A drawing, by its points in map widths, and red drones that have followed it.
export function paintDrawing(canvas, points, drones) {
  const pen = canvas.getContext("2d"), side = canvas.width;
  pen.strokeStyle = INK;
  pen.globalAlpha = 0.28;
  pen.lineWidth = 0.1 * side;
  pen.lineCap = pen.lineJoin = "round";
  pen.beginPath();
  for (const [x, y] of points) pen.lineTo(x * side, (1 - y) * side);
  pen.stroke();
  pen.globalAlpha = 1;
  for (let k = 0; k < drones; k++) {
    const [x, y] = points[Math.floor(k * points.length / drones)], aside = 0.03 * Math.sin(5 * k + 1);
    shape(pen, 0, (x + aside) * side, (1 - y + aside) * side, side * 0.025);
  }
}

function shape(pen, team, x, y, size) {
  pen.fillStyle = COLOURS[team];
  pen.strokeStyle = "#fff";
  pen.lineWidth = size * 0.45;
  pen.beginPath();
  if (team === 0) pen.arc(x, y, size, 0, 7);
  else for (const [dx, dy] of [[1, 0], [0, 1], [-1, 0], [0, -1]]) pen.lineTo(x + 1.25 * size * dx, y + 1.25 * size * dy);
  pen.closePath();
  pen.stroke();
  pen.fill();
}
