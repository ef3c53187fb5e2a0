// Practice while a room waits: a game in the page itself, against drones that spread out evenly.

import { Game } from "./engine/game.js";
import { fieldsOf } from "./engine/observation.js";
import { densityOf, targetOf } from "./engine/strokes.js";
import { momentOf } from "./frames.js";
import { SIDES, TICKS } from "./words.js";

const FIELD_TICKS = 3; // between two updates of the ground

export class Practice {
  // team is the player's. Frames and targets come as events of the link, as from a server.
  constructor(link, team) {
    this.link = link;
    this.team = team;
    this.begin();
    this.clock = setInterval(() => this.step(), 1000 / TICKS);
  }

  begin() { this.game = new Game({}, crypto.getRandomValues(new Uint32Array(1))[0]); }

  stop() { clearInterval(this.clock); }

  step() {
    if (this.game.isOver) this.begin();
    const { game } = this;
    game.advance();
    this.link.tell("frame", momentOf(game, this.link.now(), game.tick % FIELD_TICKS === 0 || game.isOver ? fieldsOf(game) : null));
  }

  // Follow a drawing, as the server does. Always return true: it was sent.
  send({ number, strokes }) {
    const density = densityOf(strokes ?? []), { team } = this;
    this.game.command(team, density);
    this.link.tell("target", { team, number, picture: targetOf(density) });
    this.link.tell("in_force", { seat: SIDES[team], number, sender: "" });
    return true;
  }
}
