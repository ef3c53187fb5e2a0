// Automatic responses: while a condition holds, a policy or a saved drawing commands in one's place.

import { called } from "./cards.js";
import { at, button, make } from "./elements.js";
import { read } from "./link.js";

const MOST = 8, STORE = "swarm-pz.rules";
// What each condition asks, and the number that it begins with.
const CONDITIONS = {
  fewer: { words: (n) => `fewer than ${n} drones`, value: 4, min: 1, max: 400, step: 1 },
  nobody_within: { words: (d) => `nobody within ${d}`, value: 0.2, min: 0.01, max: 1.5, step: 0.01 },
  silent_s: { words: (t) => `nothing sent for ${t} s`, value: 5, min: 0.5, max: 3600, step: 0.5 },
};

export class Responses {
  // policies: gives those that may answer; saved: gives the drawings that can be sent here; say: what the protocol has for one.
  constructor(link, { policies, saved, say }) {
    Object.assign(this, { link, policies, saved, say });
    link.addEventListener("seated", () => this.begin());
    link.addEventListener("refused", ({ detail }) => { if (detail.about === "rules") at("rules-fault").textContent = detail.reason; });
    at("rule-when").addEventListener("change", () => this.ask());
    at("rule").addEventListener("submit", (event) => {
      event.preventDefault();
      this.add();
    });
    at("acting-stop").addEventListener("click", () => this.remove(this.acting));
    this.ask();
    this.begin();
  }

  // Go on with a seat's own: a page that was loaded anew shows what still acts.
  begin() {
    const kept = read("sessionStorage", STORE);
    this.rules = kept && kept.token === this.link.seat?.token ? kept.rules : [];
    this.act({ rule: null });
    if (this.rules.length) this.tell();
    else this.show();
  }

  ask() {
    const { value, min, max, step } = CONDITIONS[at("rule-when").value];
    Object.assign(at("rule-number"), { min, max, step, value });
  }

  // Who can answer: policies, and what is saved.
  show() {
    const drawings = this.saved().map(({ name }, i) => new Option(name, i)), chosen = at("rule-do").value;
    at("rule-do").replaceChildren(...drawings, ...this.policies().map(({ name }) => new Option(called(name), name)));
    if ([...at("rule-do").options].some(({ value }) => value === chosen)) at("rule-do").value = chosen;
    at("rules").replaceChildren(...this.rules.map(({ name, when }, i) => {
      const words = this.words({ name, when });
      return make("li", {}, words, button("Remove", () => this.remove(i), { "aria-label": `Remove: ${words}` }));
    }));
    at("rule-add").disabled = this.rules.length === MOST;
  }

  words({ name, when }) { return Object.entries(when).map(([kind, value]) => `${CONDITIONS[kind].words(value)}: ${name}`)[0]; }

  add() {
    const chosen = at("rule-do").value, drawing = this.saved()[chosen];
    this.rules.push({
      name: drawing?.name ?? called(chosen), when: { [at("rule-when").value]: at("rule-number").valueAsNumber },
      do: drawing ? this.say(drawing.strokes) : { policy: chosen },
    });
    this.tell();
  }

  remove(i) {
    this.rules.splice(i, 1);
    this.tell();
    (at("tools").open ? at("close-tools") : at("arena")).focus();
  }

  tell() {
    at("rules-fault").textContent = "";
    this.show();
    try {
      sessionStorage.setItem(STORE, JSON.stringify({ token: this.link.seat?.token, rules: this.rules }));
    } catch { /* then a page that is loaded anew switches them off */ }
    this.link.send({ type: "rules", rules: this.rules.map(({ when, do: what }) => ({ when, do: what })) });
  }

  // Show which one acts, to be switched off.
  act({ rule }) {
    this.acting = rule;
    at("acting").hidden = rule === null || !this.rules[rule];
    at("acting-text").textContent = at("acting").hidden ? "" : `${this.rules[rule].name} acts for you`;
  }
}
