// Opponents as cards: a picture of a game with a face, a sentence, and the stars won.

import { button, make } from "./elements.js";
import { addDrone, drawLine, look, newCanvas } from "./ground.js";
import { LEVELS } from "./levels.js";
import { starsOf } from "./progress.js";
import { called } from "./words.js";

// Return opponents, which unlock one by one, as items of a list; a click calls play(name).
export function opponentCards(policies, opponents, { stars, next }, play) {
  return opponents.map((name, i) => {
    const won = stars[name], isOpen = won || name === next, { card } = policies.find((policy) => policy.name === name);
    const canvas = make("canvas", { width: 144, height: 144, "aria-hidden": "true" });
    paintCard(canvas, card);
    const state = won ? starsOf(won) : isOpen ? "next" : `after ${called(opponents.slice(0, i).findLast((other) => !stars[other]))}`;
    const label = won ? `${won.filter(Boolean).length} of ${won.length} stars` : state;
    const text = make("span", {}, make("strong", {}, called(name)), make("span", {}, LEVELS[name].says), make("small", { "aria-label": label }, state));
    return make("li", {}, button([canvas, faceOf(LEVELS[name].face), text], () => play(name), { className: "card", "data-opponent": name, disabled: !isOpen }));
  });
}

// Paint a policy's command and its drones at one moment of a game as blue.
export function paintCard(canvas, card) {
  const pen = canvas.getContext("2d"), side = canvas.width;
  pen.fillStyle = look.ground;
  pen.fillRect(0, 0, side, side);
  if (!card) return;
  const cells = card.target.length, small = newCanvas(cells), draw = small.getContext("2d");
  const target = [...card.target.join("")].map((digit) => Number(digit) / 9), mean = target.reduce((a, b) => a + b) / target.length;
  draw.fillStyle = look.teams[1];
  target.forEach((value, i) => {
    draw.globalAlpha = 0.65 / (1 + 3 * mean) * value; // even commands are faint
    draw.fillRect(i % cells, cells - 1 - Math.floor(i / cells), 1, 1);
  });
  pen.drawImage(small, 0, 0, side, side);
  paintDrones(canvas, 1, card.drones);
}

// Return a face: a large drone with eyes, sloping brows and a bent mouth.
function faceOf([eyes, slope, bend]) {
  const places = Array.from({ length: eyes }, (_, eye) => 4 * eye - 2 * (eyes - 1)), tilt = (x) => 1.2 * slope * (Math.sign(x) || 1);
  const brows = [...new Set([places[0], places.at(-1)])].map((x) => `M${x - 1.6} ${tilt(x) - 4}L${x + 1.6} ${-tilt(x) - 4}`);
  const lines = `${brows.join("")}M-3 ${4 - 1.2 * bend}L0 ${4 + 1.2 * bend}L3 ${4 - 1.2 * bend}`, eyed = places.map((x) => `<circle cx="${x}" cy="-1.5" r="1.3"/>`);
  const drawn = `<path class="drone" d="M-12.5 0L0-12.5L12.5 0L0 12.5Z"/>${eyed.join("")}<path d="${lines}"/>`;
  return make("span", { className: "face", "aria-hidden": true, innerHTML: `<svg viewBox="-13 -13 26 26">${drawn}</svg>` });
}

// Paint drones of a team at places in hundredths of the map.
export function paintDrones(canvas, team, drones) {
  const pen = canvas.getContext("2d"), side = canvas.width, size = side * 0.028;
  pen.fillStyle = look.teams[team];
  pen.strokeStyle = look.ground;
  pen.lineWidth = size * 0.45;
  for (const [x, y] of drones) {
    pen.beginPath();
    addDrone(pen, team, x / 100 * side, (1 - y / 100) * side, size);
    pen.stroke();
    pen.fill();
  }
}

// Paint the picture beside the title: a half-drawn ring around the opponent, and red drones on it.
export function paintPoster(canvas, card) {
  paintCard(canvas, card);
  paintDrawing(canvas, arc(0.31, -0.4, 4.9), 10);
}

const TIGHT = arc(0.1), CIRCLE = arc(0.25), CORNER = [[0.78, 0.8], [0.84, 0.86], [0.9, 0.9]];
// Pictures of the rules: a drawing, the number of red drones on it, and the radius of the circle of blue drones.
export const PICTURES = [{ shows: CORNER, drones: 3, blue: 0 }, { shows: CIRCLE, drones: 9, blue: 0.05 }, { shows: TIGHT, drones: 9, blue: 0.27 }];

export function paintPicture(canvas, { shows, drones, blue }) {
  paintCard(canvas, { target: ["0"], drones: [] });
  paintDrawing(canvas, shows, drones);
  if (blue) paintDrones(canvas, 1, arc(blue).filter((_, k) => k % 8 === 3).map((place) => place.map((value) => 100 * value)));
}

export function arc(radius, from = 0, to = 2 * Math.PI, [x, y] = [0.5, 0.5]) {
  return Array.from({ length: 60 }, (_, k) => {
    const angle = from + (to - from) * k / 59;
    return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
  });
}

// Paint a drawing, its points in map widths, and red drones that have followed it.
function paintDrawing(canvas, points, drones) {
  const pen = canvas.getContext("2d");
  pen.globalAlpha = 0.28;
  drawLine(pen, points, 0.1, canvas.width, look.asked);
  pen.globalAlpha = 1;
  paintDrones(canvas, 0, Array.from({ length: drones }, (_, k) => {
    const [x, y] = points[Math.floor(k * points.length / drones)], aside = 3 * Math.sin(5 * k + 1);
    return [100 * x + aside, 100 * y - aside];
  }));
}
