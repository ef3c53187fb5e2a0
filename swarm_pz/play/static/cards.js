// Opponents as cards: a picture of what they do, a line, and the level that their rating puts them on.

import { button, make } from "./elements.js";
import { CELLS } from "./frames.js";
import { addDrone, COLOURS, hatch, INK, newCanvas } from "./ground.js";
import { called } from "./words.js";

/** @type {[string, number][]} */
const LEVELS = [["Easy", -Infinity], ["Fair", 900], ["Hard", 1300]]; // from which rating on; uniform has 1000
const SHOWN = 3; // cards of a level at first

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
  const cards = policies.map((policy, i) => make("li", { className: i < SHOWN ? "" : "rest" }, card(policy, title, play)));
  return make("section", {}, make("h3", {}, title), make("ul", {}, ...cards));
}

function card({ name, about, card: has }, title, play) {
  const canvas = make("canvas", { width: 144, height: 144, "aria-hidden": "true" });
  const level = has ? [make("small", {}, `${title}, rating ${has.rating}`)] : [];
  paintCard(canvas, has);
  const text = make("span", {}, make("strong", {}, called(name)), make("span", {}, about), ...level);
  return button([canvas, text], () => play(name), { className: "card", "data-opponent": name });
}

// What a policy asked for at a moment of a game as blue, and where its drones were.
export function paintCard(canvas, card) {
  const pen = canvas.getContext("2d"), side = canvas.width;
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, side, side);
  if (!card) return paintUnknown(pen, side);
  const cells = card.target.length, small = newCanvas(cells), draw = small.getContext("2d");
  const asked = [...card.target.join("")].map((digit) => Number(digit) / 9), mean = asked.reduce((a, b) => a + b) / asked.length;
  draw.fillStyle = COLOURS[1];
  asked.forEach((value, i) => {
    draw.globalAlpha = 0.65 / (1 + 3 * mean) * value; // what is asked for everywhere is faint
    draw.fillRect(i % cells, cells - 1 - Math.floor(i / cells), 1, 1);
  });
  pen.drawImage(small, 0, 0, side, side);
  paintDrones(canvas, 1, card.drones);
}

function paintUnknown(pen, side) {
  pen.fillStyle = "#767c85";
  pen.font = `${side / 2}px sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText("?", side / 2, side / 2);
}

// Drones of a team, by their places in hundredths of the map.
export function paintDrones(canvas, team, drones) {
  const pen = canvas.getContext("2d"), side = canvas.width, size = side * 0.028;
  pen.fillStyle = COLOURS[team];
  pen.strokeStyle = "#fff";
  pen.lineWidth = size * 0.45;
  for (const [x, y] of drones) {
    pen.beginPath();
    addDrone(pen, team, x / 100 * side, (1 - y / 100) * side, size);
    pen.stroke();
    pen.fill();
  }
}

// Ground where red captures: columns of the board's cells, by row.
export function paintHolds(canvas, rows) {
  const pen = canvas.getContext("2d"), size = canvas.width / CELLS;
  pen.fillStyle = hatch(pen, 0, 1);
  for (const [row, columns] of Object.entries(rows)) {
    for (const column of columns) pen.fillRect(column * size, (CELLS - 1 - Number(row)) * size, size, size);
  }
}

// The picture beside the title: a ring that somebody draws around the opponent, and red drones on it.
export function paintPoster(canvas, card) {
  paintCard(canvas, card);
  paintDrawing(canvas, arc(0.31, -0.4, 4.9), 10);
}

export const TIGHT = arc(0.16), CIRCLE = arc(0.27), CORNER = [[0.78, 0.8], [0.84, 0.86], [0.9, 0.9]];

function arc(radius, from = 0, to = 2 * Math.PI) {
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
  paintDrones(canvas, 0, Array.from({ length: drones }, (_, k) => {
    const [x, y] = points[Math.floor(k * points.length / drones)], aside = 3 * Math.sin(5 * k + 1);
    return [100 * x + aside, 100 * y - aside];
  }));
}
