// Ideas that beat opponents, and the moving picture of one: a game that the engine plays in the page.

import { arc, paintDrones } from "./cards.js";
import { Game } from "./engine/game.js";
import { fieldsOf } from "./engine/observation.js";
import { loadPlayer } from "./engine/players.js";
import { densityOf } from "./engine/strokes.js";
import { drawLine, Ground, look } from "./ground.js";
import { TICKS } from "./words.js";

const PERIOD_S = 12; // after which the picture begins anew
const STILL_S = 6; // the moment that is shown where nothing may move
const WIDTH = 0.1; // of the brush
const SEED = 12; // of the game in the picture, in which the idea soon pays
const upright = (x) => [[x, 0.2], [x, 0.8]];

// Each has a sentence, a script to show it against, and a drawing, or null, for each second: from the mean place of the
// opponents, and from where that was at first.
export const IDEAS = {
  surround: { says: "Draw one big circle, at once, and leave it.", against: "centre", draw: (second) => (second ? null : arc(0.33)) },
  breathe: {
    says: "Draw a wide ring, four seconds later a small one, and so on: their ring is never where yours is.",
    against: "halo", draw: (second) => (second % 4 ? null : arc(second % 8 ? 0.15 : 0.3)),
  },
  sides: {
    says: "Draw a line on the left, four seconds later one on the right, and so on: all of you meet a part of them.",
    against: "runner", draw: (second) => (second % 4 ? null : upright(second % 8 ? 0.75 : 0.25)),
  },
  follow: {
    says: "They wander: every two seconds, draw the ring around them again.",
    against: "pendulum", seed: 1, draw: (second, place) => (second % 2 ? null : arc(0.3, 0, 2 * Math.PI, place)),
  },
  opposite: {
    says: "Every two seconds, draw a dot where they are not: across the middle from them.",
    against: "stroller", draw: (second, place) => (second % 2 ? null : [place.map((value) => 1 - value)]),
  },
  lap: {
    says: "Run around the middle: a short wide stroke every second, six for a round, and begin across from them. Your trails close to a ring.",
    against: "breather", seed: 1, width: 0.3,
    draw(second, _, [x, y]) {
      const middle = Math.atan2(y - 0.5, 0.5 - x) + 2 * Math.PI * second / 6;
      return arc(0.24, middle - 0.4, middle + 0.4);
    },
  },
};

export class IdeaPicture {
  constructor(canvas) {
    this.canvas = canvas;
    this.ground = new Ground(canvas);
    this.isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  }

  // Show an idea until another one is shown, or null.
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

  get width() { return this.idea.width ?? WIDTH; }

  async begin() {
    this.player = await loadPlayer(this.idea.against);
    this.game = new Game({}, this.idea.seed ?? SEED);
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
    const { game } = this, place = meanOf(game, 1);
    if (second === 1) this.first = place;
    const drawn = second ? this.idea.draw(second - 1, place, this.first) : null;
    if (drawn) game.command(0, densityOf([{ brush: "attract", width: this.width, points: drawn }]));
    this.drawn = drawn ?? this.drawn;
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

function placesOf({ positions, teams }, team) {
  return [...teams.keys()].filter((i) => teams[i] === team).map((i) => [positions[2 * i], positions[2 * i + 1]]);
}

function meanOf(game, team) {
  const places = placesOf(game, team);
  return [0, 1].map((axis) => (places.length ? places.reduce((sum, place) => sum + place[axis], 0) / places.length : 0.5));
}
