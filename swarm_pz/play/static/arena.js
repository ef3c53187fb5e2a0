// The arena as it is seen: the ground, drones with trails, who is in danger, and captures as they happen.

import { COLOURS, Ground } from "./ground.js";
import { Trails } from "./trails.js";

const FULL_RATE = 30; // of frames; with fewer, each is shown as it is until the next
const OLDEST_MS = 250; // frames that took this much longer than the link does are not shown
const AHEAD_MS = 100; // how far a frame is carried on by its velocities at most
const FLASH_MS = 700, PULSE_MS = 400;
const JUMP_TICKS = 30; // frames farther apart are not of one motion
const WARNING_S = 0.4; // how long before it flies into ground that captures it a drone is marked

export class Arena {
  constructor(ground, drones, now, onTheWay = () => 0) {
    this.ground = new Ground(ground);
    this.trails = new Trails();
    this.drones = drones;
    this.now = now; // the server's clock
    this.onTheWay = onTheWay; // how old frames are when they come, in milliseconds: a slow link is no stall
    this.speed = 1; // seconds of game a second
    this.rate = FULL_RATE; // moments that are shown a second
    this.hasTrails = true;
    this.guarded = [0, 1]; // teams whose drones are marked when they are in danger
    this.isLive = false;
    this.isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.places = new Float32Array(0); // where drones are shown
    this.shadow = softDisc(); // painted once, since a picture is put down sooner than a path is filled
    this.forget();
  }

  // Begin with another game.
  forget() {
    this.frame = this.altitudes = null;
    this.ground.forget();
    this.forgetMotion();
  }

  forgetMotion() {
    this.trails.forget();
    this.flashes = [];
  }

  // See the game from a side: its target is shown, and its drones' danger unless one only watches.
  look(own, guarded = [own]) {
    if (own !== this.ground.own) this.ground.setTarget(null);
    this.ground.own = own;
    this.ground.dirty = true;
    this.guarded = guarded;
  }

  get own() { return this.ground.own; }

  // Take a frame in; returns the drones that changed sides.
  take(frame) {
    const last = this.frame;
    const changed = [];
    if (last && (frame.tick < last.tick || frame.tick > last.tick + JUMP_TICKS)) {
      this.forgetMotion();
    } else if (last && last.teams.length === frame.teams.length) {
      for (let i = 0; i < frame.teams.length; i++) {
        if (frame.teams[i] !== last.teams[i]) {
          changed.push(i);
          this.flashes.push({ drone: i, team: frame.teams[i], began: performance.now() });
        }
      }
    }
    this.trails.take(frame);
    this.altitudes = frame.altitudes ?? this.altitudes;
    if (frame.fields) {
      this.ground.fields = frame.fields;
      this.ground.dirty = true;
    }
    this.frame = frame;
    return changed;
  }

  // Paint, and return the frame that is shown, or null if it is too old to show.
  paint() {
    if (this.ground.dirty) {
      this.ground.paint();
      this.shownTarget = this.ground.target?.number;
    }
    const { frame } = this;
    if (!frame) {
      this.drones.getContext("2d").clearRect(0, 0, this.drones.width, this.drones.width);
      return null;
    }
    const age = this.isLive ? this.now() - frame.serverMs : 0;
    if (age > OLDEST_MS + this.onTheWay() + (this.rate < FULL_RATE ? 1000 / this.rate : 0)) return null;
    const ahead = this.rate < FULL_RATE ? 0 : AHEAD_MS;
    this.paintDrones(frame, age > 0 ? Math.min(age, ahead) / 1000 * this.speed : 0);
    return frame;
  }

  // Where drones are by now: a frame carried on by its velocities.
  carry(frame, ahead) {
    const { positions, velocities } = frame;
    if (this.places.length !== positions.length) this.places = new Float32Array(positions.length);
    for (let i = 0; i < positions.length; i++) {
      this.places[i] = Math.min(Math.max(positions[i] + ahead * velocities[i], 0), 1);
    }
    return this.places;
  }

  paintDrones(frame, ahead) {
    const canvas = this.drones, side = canvas.width, pen = canvas.getContext("2d"), { teams } = frame;
    const places = this.carry(frame, ahead), size = side * (teams.length > 60 ? 0.008 : 0.0125);
    pen.clearRect(0, 0, side, side);
    if (this.hasTrails) this.trails.paint(pen, frame, places, side);
    this.paintShadows(pen, places, side, size);
    for (const [reach, white] of [[1.45, true], [1, false]]) {
      for (const team of [0, 1]) {
        pen.fillStyle = white ? "#fff" : COLOURS[team];
        pen.beginPath();
        for (let i = 0; i < teams.length; i++) {
          if (teams[i] === team) shape(pen, team, places[2 * i] * side, (1 - places[2 * i + 1]) * side, size * reach);
        }
        pen.fill();
      }
    }
    this.paintDanger(pen, frame, places, side, size);
    this.paintFlashes(pen, places, side, size);
  }

  // Shadows tell altitudes, as light from the upper left casts them: the higher, the farther off and the larger.
  paintShadows(pen, places, side, size) {
    if (this.altitudes?.length !== places.length / 2) return;
    for (let i = 0; i < this.altitudes.length; i++) {
      const height = this.altitudes[i] / 255, reach = size * (1.5 + 0.4 * height), away = size * (0.4 + 1.2 * height);
      const x = places[2 * i] * side + away - reach, y = (1 - places[2 * i + 1]) * side + away - reach;
      pen.drawImage(this.shadow, x, y, 2 * reach, 2 * reach);
    }
  }

  // Whether a drone is, or will be at once, where the other team captures it.
  isInDanger(frame, places, i) {
    const other = 1 - frame.teams[i], x = places[2 * i], y = places[2 * i + 1];
    return this.ground.captures(other, x, y)
      || this.ground.captures(other, x + WARNING_S * frame.velocities[2 * i], y + WARNING_S * frame.velocities[2 * i + 1]);
  }

  paintDanger(pen, frame, places, side, size) {
    this.endangered = 0;
    const pulse = this.isCalm ? 1 : 1 + 0.25 * Math.sin(performance.now() / PULSE_MS * 2 * Math.PI);
    pen.beginPath();
    for (let i = 0; i < frame.teams.length; i++) {
      if (!this.guarded.includes(frame.teams[i]) || !this.isInDanger(frame, places, i)) continue;
      const x = places[2 * i] * side, y = (1 - places[2 * i + 1]) * side, reach = 2.1 * size * pulse;
      pen.moveTo(x + reach, y);
      pen.arc(x, y, reach, 0, 7);
      this.endangered++;
    }
    for (const [colour, width] of [["#fff", 0.009], ["#111", 0.0045]]) {
      pen.strokeStyle = colour;
      pen.lineWidth = side * width;
      pen.stroke();
    }
  }

  paintFlashes(pen, places, side, size) {
    const time = performance.now();
    while (this.flashes.length && time - this.flashes[0].began >= FLASH_MS) this.flashes.shift();
    for (const { drone, team, began } of this.flashes) {
      const grown = (time - began) / FLASH_MS;
      pen.globalAlpha = 1 - grown;
      pen.strokeStyle = COLOURS[team];
      pen.lineWidth = 0.6 * size;
      pen.beginPath();
      pen.arc(places[2 * drone] * side, (1 - places[2 * drone + 1]) * side, size * (1.6 + 3.2 * grown), 0, 7);
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }
}

function softDisc() {
  const disc = document.createElement("canvas"), half = 32;
  disc.width = disc.height = 2 * half;
  const pen = disc.getContext("2d"), shade = pen.createRadialGradient(half, half, 0.45 * half, half, half, half);
  shade.addColorStop(0, "rgb(33 37 41 / 35%)");
  shade.addColorStop(1, "rgb(33 37 41 / 0%)");
  pen.fillStyle = shade;
  pen.fillRect(0, 0, 2 * half, 2 * half);
  return disc;
}

function shape(pen, team, x, y, size) {
  if (team === 0) {
    pen.moveTo(x + size, y);
    pen.arc(x, y, size, 0, 7);
  } else {
    const reach = 1.25 * size;
    pen.moveTo(x - reach, y);
    pen.lineTo(x, y - reach);
    pen.lineTo(x + reach, y);
    pen.lineTo(x, y + reach);
    pen.closePath();
  }
}
