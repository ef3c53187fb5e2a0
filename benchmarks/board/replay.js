"use strict";
// Shows a recorded game: moments of drones' places, and who took which drone when.
const game = JSON.parse(document.getElementById("game").textContent);
const drones = game.begin.length;
const bytes = Uint8Array.from(atob(game.positions), (sign) => sign.charCodeAt(0));
const view = new DataView(bytes.buffer);
const moments = bytes.length / (4 * drones);
const place = (moment, drone, axis) => view.getUint16(4 * (moment * drones + drone) + 2 * axis, true) / 65535;
const [canvas, play, seek, speed, told] = ["arena", "play", "seek", "speed", "told"].map((id) => document.getElementById(id));
const TRAIL = 25;
let now = 0;
let playing = false;
let before = 0;

function teamsAt(moment) {
  const teams = [...game.begin];
  for (const [when, drone, team] of game.captures) if (when <= moment) teams[drone] = team;
  return teams;
}

function draw() {
  const pen = canvas.getContext("2d");
  const side = canvas.width;
  const style = getComputedStyle(document.documentElement);
  const colours = [style.getPropertyValue("--red"), style.getPropertyValue("--blue")];
  const moment = Math.min(Math.floor(now), moments - 1);
  const next = Math.min(moment + 1, moments - 1);
  const teams = teamsAt(moment);
  pen.clearRect(0, 0, side, side);
  const at = (when, drone) => [place(when, drone, 0) * side, (1 - place(when, drone, 1)) * side];
  for (let drone = 0; drone < drones; drone += 1) {
    const [x, y] = [0, 1].map((axis) => {
      const from = at(moment, drone)[axis];
      return from + (at(next, drone)[axis] - from) * (now - moment);
    });
    pen.strokeStyle = pen.fillStyle = colours[teams[drone]];
    pen.globalAlpha = 0.35;
    pen.lineWidth = side / 300;
    pen.beginPath();
    for (let when = Math.max(0, moment - TRAIL); when <= moment; when += 1) pen.lineTo(...at(when, drone));
    pen.lineTo(x, y);
    pen.stroke();
    pen.globalAlpha = 1;
    pen.beginPath();
    const size = side / 70;
    if (teams[drone] === 0) pen.arc(x, y, size * 0.9, 0, 7);
    else [[0, -1.2], [1.2, 0], [0, 1.2], [-1.2, 0]].forEach(([dx, dy]) => pen.lineTo(x + dx * size, y + dy * size));
    pen.fill();
  }
  const blue = teams.reduce((sum, team) => sum + team, 0);
  told.textContent = `${(moment * game.every_s).toFixed(1)} s: ${told.dataset.red} (red) ${drones - blue}, ${told.dataset.blue} (blue) ${blue}`;
  seek.value = moment;
  seek.setAttribute("aria-valuetext", told.textContent);
}

function go(stamp) {
  if (!playing) return;
  now += (Math.max(0, stamp - before) / 1000 / game.every_s) * Number(speed.value);
  before = stamp;
  if (now >= moments - 1) {
    now = moments - 1;
    stop();
  } else requestAnimationFrame(go);
  draw();
}

function stop() {
  playing = false;
  play.textContent = "Play";
}

play.addEventListener("click", () => {
  if (playing) return stop();
  if (now >= moments - 1) now = 0;
  playing = true;
  play.textContent = "Pause";
  before = performance.now();
  requestAnimationFrame(go);
});
seek.max = moments - 1;
seek.addEventListener("input", () => {
  now = Number(seek.value);
  draw();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
document.getElementById("player").hidden = false;
draw();
