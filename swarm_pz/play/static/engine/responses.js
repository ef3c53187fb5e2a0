// Automatic responses of the visitor's seat, as swarm_pz/play/server/responses.py: the first acts whose condition holds.

import { loadPlayer } from "./players.js";

const STEP = 30, TICKS = 30; // between questions to a policy; in a second

export class Responses {
  constructor(room) {
    this.room = room;
    this.rules = [];
    this.rest();
  }

  async replace(rules) {
    const ready = await Promise.all(rules.map(async ({ when, do: what }) => (what.policy
      ? { when, player: await loadPlayer(what.policy), sender: `auto:${what.policy}` } : { when, density: this.room.densityOf(what), sender: "auto:saved" })));
    this.rest();
    this.rules = ready;
  }

  rest() { this.act(null); }

  act(place) {
    if (place === (this.acting ?? null)) return;
    this.acting = place;
    this.asked = null; // when it commanded last
    this.tell();
  }

  tell() {
    const { acting, rules, room } = this;
    if (rules.length) room.say({ type: "acting", seat: ["red", "blue"][room.team], rule: acting, sender: rules[acting]?.sender ?? "" });
  }

  // Let the first one act whose condition holds: a policy once a command period, a saved drawing once.
  look(game) {
    const { room } = this, place = this.rules.findIndex(({ when }) => this.holds(when, game));
    this.act(place < 0 ? null : place);
    if (place < 0) return;
    const { player, density, sender } = this.rules[place];
    if (this.asked !== null && (!player || game.tick - this.asked < STEP)) return;
    this.asked = game.tick;
    if (player) room.answer(player, room.team, sender);
    else room.give(room.team, density, sender);
  }

  holds({ fewer, nobody_within: within, silent_s: silent }, { sizes, teams, positions, tick }) {
    const { team, sent } = this.room;
    if (fewer) return sizes[team] < fewer;
    if (silent) return tick - sent >= silent * TICKS;
    const [own, others] = [team, 1 - team].map((side) => [...teams.keys()].filter((i) => teams[i] === side));
    return own.every((i) => others.every((j) => Math.hypot(positions[2 * i] - positions[2 * j], positions[2 * i + 1] - positions[2 * j + 1]) > within));
  }
}
