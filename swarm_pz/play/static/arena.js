// The arena: the ground, drones with trails, rings around drones in danger, and captures.

import { addDrone, disc, Ground, look, newCanvas, onLook } from "./ground.js";
import { Trails } from "./trails.js";

const FULL_RATE = 30; // frames a second; at lower rates, frames are not extrapolated
const OLDEST_MS = 250; // frames older than the link's delay by more than this are not shown
const AHEAD_MS = 100; // longest extrapolation of a frame by its velocities
const FLASH_MS = 700, FLASH_STEPS = 24, PULSE_MS = 400;
const SPARKS = 7; // of a capture
const JUMP_TICKS = 30; // after a longer gap, trails and flashes begin anew
const WARNING_S = 0.4; // a drone is marked this long before it reaches ground that nearly captures it
const MANY = 60; // more drones are painted smaller and at whole pixels

export class Arena {
  constructor(ground, drones, now, onTheWay = () => 0) {
    this.ground = new Ground(ground);
    this.trails = new Trails();
    this.drones = drones;
    this.now = now; // the server's clock
    this.onTheWay = onTheWay; // age of frames on arrival, in milliseconds: a slow link is no stall
    this.speed = 1; // game seconds per second
    this.rate = FULL_RATE; // moments that are shown a second
    this.hasTrails = true;
    this.guarded = [0, 1]; // teams whose drones are marked when they are in danger
    this.isLive = false;
    this.isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    onLook(() => { this.sprites = {}; });
    this.sprites = {}; // of a size, by their names
    this.forget();
  }

  // Reset for another game.
  forget() {
    this.frame = this.painted = null;
    this.ground.forget();
    this.forgetMotion();
  }

  forgetMotion() {
    this.trails.forget();
    this.flashes = new Map(); // by their drones, the newest at the end
  }

  // Show the target of a side, and danger for the drones of the guarded teams.
  look(own, guarded = [own]) {
    if (own !== this.ground.own) this.ground.setTarget(null);
    this.ground.own = own;
    this.ground.dirty = true;
    this.guarded = guarded;
  }

  // Take a frame; return the drones that changed sides.
  take(frame) {
    const last = this.frame, changed = [];
    if (last && (frame.tick < last.tick || frame.tick > last.tick + JUMP_TICKS)) {
      this.forgetMotion();
    } else if (last?.teams.length === frame.teams.length) {
      frame.teams.forEach((team, drone) => {
        if (team === last.teams[drone]) return;
        changed.push(drone);
        this.flashes.delete(drone);
        this.flashes.set(drone, { team, tick: frame.tick, began: performance.now() });
      });
    }
    this.trails.take(frame);
    if (frame.fields) {
      this.ground.fields = frame.fields;
      this.ground.dirty = true;
    }
    this.frame = frame;
    return changed;
  }

  // Where a team captured last; the middle if that was long ago.
  lastCapture(team) {
    const [drone] = [...this.flashes].findLast(([, flash]) => flash.team === team) ?? [];
    return drone === undefined ? [0.5, 0.5] : this.frame.positions.slice(2 * drone, 2 * drone + 2);
  }

  // Paint, and return the frame that is shown, or null if it is too old to show.
  paint() {
    const { frame } = this, isWhole = this.rate === FULL_RATE;
    if (frame === this.painted && !this.isLive && !this.flashes.size && !this.ground.dirty) return frame; // a board at rest
    this.painted = this.isLive ? null : frame;
    if (this.ground.dirty) {
      this.ground.paint();
      this.shownTarget = this.ground.target?.number;
    }
    if (!frame) {
      this.drones.getContext("2d").clearRect(0, 0, this.drones.width, this.drones.width);
      return null;
    }
    const age = this.isLive ? this.now() - frame.serverMs : 0;
    if (age > OLDEST_MS + this.onTheWay() + (isWhole ? 0 : 1000 / this.rate)) return null;
    this.paintDrones(frame, age > 0 && isWhole ? Math.min(age, AHEAD_MS) / 1000 * this.speed : 0);
    return frame;
  }

  paintDrones(frame, ahead) {
    const canvas = this.drones, side = canvas.width, pen = canvas.getContext("2d"), { teams, positions, velocities } = frame;
    // Where drones are by now, extrapolated by their velocities.
    const places = this.places = positions.map((place, i) => Math.min(Math.max(place + ahead * velocities[i], 0), 1));
    const isMany = teams.length > MANY, size = side * (isMany ? 0.008 : 0.0125), snap = isMany ? Math.round : (value) => value;
    const copy = (sprite, i) => {
      const reach = sprite.width / 2;
      pen.drawImage(sprite, snap(places[2 * i] * side - reach), snap((1 - places[2 * i + 1]) * side - reach));
    };
    if (this.sprites.size !== size) this.sprites = { size };
    pen.clearRect(0, 0, side, side);
    if (this.hasTrails) this.trails.paint(pen, frame, places, side);
    teams.forEach((team, i) => copy(this.droneOf(team, size), i));
    const endangered = [...teams.keys()].filter((i) => this.guarded.includes(teams[i]) && this.isInDanger(frame, places, i));
    for (const rim of [true, false]) for (const i of endangered) copy(this.ringOf(rim, size, side), i);
    for (const [i, { team, tick, began }] of this.flashes) {
      const step = Math.floor((performance.now() - began) / FLASH_MS * FLASH_STEPS);
      if (step >= FLASH_STEPS || frame.tick > tick + JUMP_TICKS) this.flashes.delete(i); // the latter after a jump
      else copy(this.flashOf(team, step / FLASH_STEPS, size), i);
    }
  }

  // A drone is in danger on ground where the other team captures or nearly does, and shortly before it gets there.
  isInDanger({ teams, velocities }, places, i) {
    const x = places[2 * i], y = places[2 * i + 1];
    return [0, WARNING_S].some((ahead) => (
      this.ground.nears(1 - teams[i], x + ahead * velocities[2 * i], y + ahead * velocities[2 * i + 1])));
  }

  // Return a small picture, which is painted once: hundreds of copies take less time than paths.
  sprite(name, reach, paint) {
    if (this.sprites[name]) return this.sprites[name];
    const canvas = this.sprites[name] = newCanvas(2 * Math.ceil(reach));
    paint(canvas.getContext("2d"), canvas.width / 2);
    return canvas;
  }

  // A drone, with a rim.
  droneOf(team, size) {
    return this.sprite(`drone ${team}`, 2 * size, (pen, middle) => {
      for (const [colour, reach] of [[look.ground, 1.45], [look.teams[team], 1]]) {
        pen.fillStyle = colour;
        pen.beginPath();
        addDrone(pen, team, middle, middle, size * reach);
        pen.fill();
      }
    });
  }

  // A ring around a drone in danger, or its rim.
  ringOf(isRim, size, side) {
    const pulse = this.isCalm ? 1 : 1 + 0.25 * Math.sin(performance.now() / PULSE_MS * 2 * Math.PI), radius = Math.round(4.2 * size * pulse) / 2;
    return this.sprite(`ring ${isRim} ${radius}`, radius + 0.005 * side, (pen, middle) => {
      pen.strokeStyle = isRim ? look.ground : look.ink;
      pen.lineWidth = side * (isRim ? 0.009 : 0.0045);
      pen.beginPath();
      addDrone(pen, 0, middle, middle, radius);
      pen.stroke();
    });
  }

  // A capture's flash; `grown` goes from 0 to 1.
  flashOf(team, grown, size) {
    return this.sprite(`flash ${team} ${grown}`, 8.5 * size, (pen, middle) => {
      pen.globalAlpha = 1 - grown;
      pen.strokeStyle = pen.fillStyle = look.teams[team];
      pen.lineWidth = 0.6 * size;
      pen.beginPath();
      pen.arc(middle, middle, size * (1.6 + 3.2 * grown), 0, 7);
      pen.stroke();
      for (let k = 0; k < SPARKS && !this.isCalm; k++) {
        const angle = 2 * Math.PI * k / SPARKS, reach = size * (2 + 6 * Math.sqrt(grown));
        disc(pen, middle + reach * Math.cos(angle), middle + reach * Math.sin(angle), 0.5 * size * (1 - grown));
      }
    });
  }
}
