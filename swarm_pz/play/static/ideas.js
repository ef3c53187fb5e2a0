// The moving picture of an idea: a game that the engine plays in the page.

import { arc, paintDrones } from "./cards.js";
import { Game } from "./engine/game.js";
import { fieldsOf } from "./engine/observation.js";
import { loadPlayer } from "./engine/players.js";
import { densityOf } from "./engine/strokes.js";
import { drawLine, Ground, look } from "./ground.js";
import { TICKS } from "./words.js";

const PERIOD_S = 12; // after which the picture begins anew
const STILL_S = 6; // the moment that is shown with reduced motion
const SEED = 12; // of the game in the picture: with it each idea soon succeeds

export class IdeaPicture {
  constructor(canvas) {
    this.canvas = canvas;
    this.ground = new Ground(canvas);
    this.isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  }

  // Show an idea until the next call; null ends it.
  async show(idea) {
    clearInterval(this.clock);
    this.idea = idea;
    if (!idea) return;
    await this.begin();
    if (this.idea !== idea) return;
    if (this.isCalm) this.play(STILL_S * TICKS);
    else this.clock = setInterval(() => { if (this.canvas.checkVisibility()) this.play(1); }, 1000 / TICKS);
    this.paint();
  }

  get width() { return this.idea.width ?? 0.1; }

  async begin() {
    this.player = await loadPlayer(this.idea.against);
    this.game = new Game({}, SEED);
    this.drawn = null;
  }

  play(ticks) {
    const { game } = this;
    for (let i = 0; i < ticks; i++) {
      if (game.tick % TICKS === 0) this.command(game.tick / TICKS);
      game.advance();
    }
    if (game.isOver || game.tick >= PERIOD_S * TICKS) this.begin();
    this.paint();
  }

  command(second) {
    const { game, idea } = this, number = (second - 1) / idea.every_s; // of a drawing; the first comes after a second
    if (number >= 0 && Number.isInteger(number)) {
      this.drawn = drawingOf(idea, number, meanOf(game, 1));
      game.command(0, densityOf([{ brush: "attract", width: this.width, points: this.drawn }]));
    }
    game.command(1, this.player.act(game, 1));
  }

  paint() {
    const { canvas, game, ground } = this, pen = canvas.getContext("2d");
    ground.fields = fieldsOf(game);
    ground.paint();
    pen.globalAlpha = 0.28;
    if (this.drawn) drawLine(pen, this.drawn, this.width, canvas.width, look.asked);
    pen.globalAlpha = 1;
    for (const team of [0, 1]) paintDrones(canvas, team, placesOf(game, team).map((place) => place.map((value) => 100 * value)));
  }
}

// Return a drawing of an idea by its number, as points; `they` is the mean place of the opponents.
export function drawingOf({ radii, centre, length = 360, begins = 0, turn = 0 }, number, they) {
  const middle = begins + turn * number, place = { they, across: they.map((value) => 1 - value) }[centre];
  return arc(radii[number % radii.length], ...[-0.5, 0.5].map((end) => (middle + end * length) * Math.PI / 180), place);
}

function placesOf({ positions, teams }, team) {
  return [...teams.keys()].filter((i) => teams[i] === team).map((i) => [positions[2 * i], positions[2 * i + 1]]);
}

function meanOf(game, team) {
  const places = placesOf(game, team);
  return [0, 1].map((axis) => (places.length ? places.reduce((sum, place) => sum + place[axis], 0) / places.length : 0.5));
}
