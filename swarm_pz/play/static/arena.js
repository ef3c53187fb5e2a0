// The arena: the ground, drones with trails, rings around drones in danger, and captures.

import { addDrone, disc, Ground, look, newCanvas, onLook } from "./ground.js";
import { Trails } from "./trails.js";

const FULL_RATE = 30; // of frames; with fewer, each is shown as it is until the next
const OLDEST_MS = 250; // frames that took this much longer than the link does are not shown
const AHEAD_MS = 100; // how far a frame is carried on by its velocities at most
const FLASH_MS = 700, PULSE_MS = 400;
const SPARKS = 7; // of a capture
const JUMP_TICKS = 30; // frames farther apart begin another motion
const WARNING_S = 0.4; // a drone is marked this long before it reaches ground that nearly captures it
const MANY = 60; // drones that are painted smaller

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
    onLook(() => { this.sprites = null; });
    this.forget();
  }

  // Begin with another game.
  forget() {
    this.frame = null;
    this.ground.forget();
    this.forgetMotion();
  }

  forgetMotion() {
    this.trails.forget();
    this.flashes = [];
  }

  // Show the target of a side, and danger for the drones of the guarded teams.
  look(own, guarded = [own]) {
    if (own !== this.ground.own) this.ground.setTarget(null);
    this.ground.own = own;
    this.ground.dirty = true;
    this.guarded = guarded;
  }

  get own() { return this.ground.own; }

  // Take a frame in; returns the drones that changed sides.
  take(frame) {
    const last = this.frame, changed = [];
    if (last && (frame.tick < last.tick || frame.tick > last.tick + JUMP_TICKS)) {
      this.forgetMotion();
    } else if (last?.teams.length === frame.teams.length) {
      frame.teams.forEach((team, drone) => {
        if (team === last.teams[drone]) return;
        changed.push(drone);
        this.flashes.push({ drone, team, tick: frame.tick, began: performance.now() });
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
    const { drone } = this.flashes.findLast((flash) => flash.team === team) ?? {};
    return drone === undefined ? [0.5, 0.5] : this.frame.positions.slice(2 * drone, 2 * drone + 2);
  }

  // Paint, and return the frame that is shown, or null if it is too old to show.
  paint() {
    if (this.ground.dirty) {
      this.ground.paint();
      this.shownTarget = this.ground.target?.number;
    }
    const { frame } = this, isWhole = this.rate === FULL_RATE;
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
    // Where drones are by now: a frame carried on by its velocities.
    const places = this.places = positions.map((place, i) => Math.min(Math.max(place + ahead * velocities[i], 0), 1));
    const size = side * (teams.length > MANY ? 0.008 : 0.0125);
    pen.clearRect(0, 0, side, side);
    if (this.hasTrails) this.trails.paint(pen, frame, places, side);
    const sprites = this.spritesOf(size), [{ width: reach }] = sprites;
    for (let i = 0; i < teams.length; i++) {
      pen.drawImage(sprites[teams[i]], places[2 * i] * side - reach / 2, (1 - places[2 * i + 1]) * side - reach / 2);
    }
    this.paintDanger(pen, frame, places, side, size);
    this.paintFlashes(pen, places, side, size);
  }

  // Return a picture of a drone of each team, with a rim: hundreds of them are copied in less time than paths are filled.
  spritesOf(size) {
    if (this.sprites?.size === size) return this.sprites;
    this.sprites = Object.assign([0, 1].map((team) => {
      const side = 2 * Math.ceil(2 * size), canvas = newCanvas(side), pen = canvas.getContext("2d");
      for (const [colour, reach] of [[look.ground, 1.45], [look.teams[team], 1]]) {
        pen.fillStyle = colour;
        pen.beginPath();
        addDrone(pen, team, side / 2, side / 2, size * reach);
        pen.fill();
      }
      return canvas;
    }), { size });
    return this.sprites;
  }

  // A drone is in danger on ground where the other team captures or nearly does, and shortly before it gets there.
  isInDanger({ teams, velocities }, places, i) {
    const x = places[2 * i], y = places[2 * i + 1];
    return [0, WARNING_S].some((ahead) => (
      this.ground.nears(1 - teams[i], x + ahead * velocities[2 * i], y + ahead * velocities[2 * i + 1])));
  }

  paintDanger(pen, frame, places, side, size) {
    const pulse = this.isCalm ? 1 : 1 + 0.25 * Math.sin(performance.now() / PULSE_MS * 2 * Math.PI);
    pen.beginPath();
    for (let i = 0; i < frame.teams.length; i++) {
      if (!this.guarded.includes(frame.teams[i]) || !this.isInDanger(frame, places, i)) continue;
      addDrone(pen, 0, places[2 * i] * side, (1 - places[2 * i + 1]) * side, 2.1 * size * pulse); // a ring
    }
    for (const [colour, width] of /** @type {[string, number][]} */ ([[look.ground, 0.009], [look.ink, 0.0045]])) {
      pen.strokeStyle = colour;
      pen.lineWidth = side * width;
      pen.stroke();
    }
  }

  paintFlashes(pen, places, side, size) {
    const time = performance.now();
    this.flashes = this.flashes.filter(({ tick, began }) => time - began < FLASH_MS && this.frame.tick <= tick + JUMP_TICKS); // not of a moment before a jump
    for (const { drone, team, began } of this.flashes) {
      const grown = (time - began) / FLASH_MS, x = places[2 * drone] * side, y = (1 - places[2 * drone + 1]) * side;
      pen.globalAlpha = 1 - grown;
      pen.strokeStyle = pen.fillStyle = look.teams[team];
      pen.lineWidth = 0.6 * size;
      pen.beginPath();
      pen.arc(x, y, size * (1.6 + 3.2 * grown), 0, 7);
      pen.stroke();
      for (let k = 0; k < SPARKS && !this.isCalm; k++) {
        const angle = drone + 2 * Math.PI * k / SPARKS, reach = size * (2 + 6 * Math.sqrt(grown));
        disc(pen, x + reach * Math.cos(angle), y + reach * Math.sin(angle), 0.5 * size * (1 - grown));
      }
    }
    pen.globalAlpha = 1;
  }
}
