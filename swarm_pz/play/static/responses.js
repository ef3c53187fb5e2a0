// Automatic responses: while a condition holds, a policy or a saved drawing commands in one's place.

import { button, byId, hear, make, on } from "./elements.js";
import { keep, recall } from "./store.js";
import { called } from "./words.js";

const MOST = 8, STORE = "rules";
// Each condition's text, and its number at first, with bounds.
const CONDITIONS = {
  fewer: { words: (n) => `fewer than ${n} drones`, value: 4, min: 1, max: 400, step: 1 },
  nobody_within: { words: (d) => `nobody within ${d}`, value: 0.2, min: 0.01, max: 1.5, step: 0.01 },
  silent_s: { words: (t) => `nothing sent for ${t} s`, value: 5, min: 0.5, max: 3600, step: 0.5 },
};

export class Responses {
  // policies returns those that may answer, saved the drawings that can be sent here, say the part of a message for one.
  constructor(link, { policies, saved, say }) {
    this.link = link;
    this.policies = policies;
    this.saved = saved;
    this.say = say;
    hear(link, {
      seated: () => this.begin(),
      refused: ({ about, reason }) => { if (about === "rules") byId("rules-fault").textContent = reason; },
    });
    on("change", { "rule-when": () => this.ask() });
    on("submit", { rule: () => this.add() });
    on("click", { "acting-stop": () => this.remove(this.acting) });
    this.ask();
    this.begin();
  }

  // Show the responses of a seat, also after a reload.
  begin() {
    const kept = recall(STORE, "session");
    this.rules = kept && kept.token === this.link.seat?.token ? kept.rules : [];
    this.act({ rule: null });
    if (this.rules.length) this.tell();
    else this.show();
  }

  ask() {
    const { value, min, max, step } = CONDITIONS[byId("rule-when").value];
    Object.assign(byId("rule-number"), { min, max, step, value });
  }

  // List policies and saved drawings that can answer.
  show() {
    const drawings = this.saved().map(({ name }, i) => new Option(name, i)), chosen = byId("rule-do").value;
    byId("rule-do").replaceChildren(...drawings, ...this.policies().map(({ name }) => new Option(called(name), name)));
    if ([...byId("rule-do").options].some(({ value }) => value === chosen)) byId("rule-do").value = chosen;
    byId("rules").replaceChildren(...this.rules.map(({ name, when }, i) => {
      const [words] = Object.entries(when).map(([kind, value]) => `${CONDITIONS[kind].words(value)}: ${name}`);
      return make("li", {}, words, button("Remove", () => this.remove(i), { "aria-label": `Remove: ${words}` }));
    }));
    byId("rule-add").disabled = this.rules.length === MOST;
  }

  add() {
    const chosen = byId("rule-do").value, drawing = this.saved()[chosen];
    this.rules.push({
      name: drawing?.name ?? called(chosen), when: { [byId("rule-when").value]: byId("rule-number").valueAsNumber },
      do: drawing ? this.say(drawing.strokes) : { policy: chosen },
    });
    this.tell();
  }

  remove(i) {
    this.rules.splice(i, 1);
    this.tell();
    (byId("tools").open ? byId("close-tools") : byId("arena")).focus();
  }

  tell() {
    byId("rules-fault").textContent = "";
    this.show();
    keep(STORE, { token: this.link.seat?.token, rules: this.rules }, "session");
    this.link.send({ type: "rules", rules: this.rules.map(({ when, do: what }) => ({ when, do: what })) });
  }

  // Show the response that acts, with a button to stop it.
  act({ rule }) {
    this.acting = rule;
    byId("acting").hidden = rule === null || !this.rules[rule];
    byId("acting-text").textContent = byId("acting").hidden ? "" : `${this.rules[rule].name} acts for you`;
  }
}
