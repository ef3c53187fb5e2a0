// The start page: opponents and the lesson.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, fixtures, Line, reload } from "./page.js";
import { opponentCards } from "../../../swarm_pz/play/static/cards.js";
import { Game } from "../../../swarm_pz/play/static/engine/game.js";
import { densityOf } from "../../../swarm_pz/play/static/engine/strokes.js";
import { drawingOf } from "../../../swarm_pz/play/static/ideas.js";
import { IDEAS } from "../../../swarm_pz/play/static/levels.js";
import { count, counts, fewAgainst, progress } from "../../../swarm_pz/play/static/progress.js";
import { Lesson } from "../../../swarm_pz/play/static/lesson.js";

beforeEach(reload);

test("opponents unlock one by one, stars add up over games, and a game counts where the sides are even and it is no lesson", () => {
  const opponents = ["corners", "centre", "halo"], policies = opponents.map((name) => ({ name, card: null })), chosen = [];
  const buttons = () => opponentCards(policies, opponents, progress(opponents), (name) => chosen.push(name)).flatMap((item) => item.all("button"));
  const menu = () => buttons().map(({ disabled, children }) => [disabled, children.at(-1).all("small")[0].textContent]);
  assert.deepEqual(menu(), [[false, "next"], [true, "after corners"], [true, "after centre"]]);
  count("corners", true, 50, 11);
  assert.deepEqual(menu(), [[false, "★★☆"], [false, "next"], [true, "after centre"]]);
  count("corners", true, 90, 10);
  assert.deepEqual(progress(opponents), { stars: { corners: [true, true, true] }, streak: 2, next: "centre" });
  count("centre", false, 10, 1);
  for (const button of buttons()) button.click();
  assert.deepEqual([chosen, progress(opponents).streak], [["corners", "centre"], 0]);
  localStorage.setItem("swarm-pz.progress", '{"stars": {"centre": [true]}}');
  assert.equal(menu()[2][1], "after corners", "what is beaten already opens nothing");
  for (const name of opponents) count(name, true, 90, 20);
  assert.equal(progress(opponents).next, "halo", "the last one again");
  const policy = { kind: "policy" }, game = { settings: { red: 10, blue: 10, speed: 1 } }, uneven = { settings: { red: 20, blue: 10, speed: 1 } };
  assert.deepEqual([counts(game, policy, false), counts(uneven, policy, false), counts(game, { kind: "person" }, false), counts(game, policy, true)],
    [true, false, false, false]);
});

test("the picture of an idea draws what was measured, and the star for few drawings leaves as many as the idea needs in a minute", () => {
  const names = Object.keys(IDEAS), drawn = names.flatMap((name) => drawingOf(IDEAS[name], 1, [0.3, 0.6]).flat());
  const measured = names.flatMap((name) => fixtures.ideas[name].flat());
  assert.ok(drawn.length > 0 && drawn.every((value, i) => Math.abs(value - measured[i]) < 1e-9));
  assert.deepEqual(["corners", "lasso", "tide", "hunter", "some_policy"].map(fewAgainst), [10, 15, 30, 60, 10]);
});

// --- the lesson -------------------------------------------------------------------------------------

const scene = (tick, ...places) => ({ tick, teams: Uint8Array.from(places.map(([team]) => team)), positions: Float32Array.from(places.flatMap(([, x, y]) => [x, y])) });

function learn(begin = () => true) {
  const line = new Line(), lesson = new Lesson(line, { begin, home() {}, next: () => "halo" });
  return { lesson, line };
}

test("a step is done once a drawing of one's own has had an effect: drones are in the corner, or a small ring has lost", () => {
  const { lesson } = learn();
  const reached = (step, ...drones) => {
    Object.assign(lesson, { step, held: false, isDrawn: false, drawnTick: null });
    const steps = [10, 100].map((tick) => {
      lesson.watch(scene(tick, ...drones), 0);
      return lesson.step;
    });
    lesson.sent([{ points: [[0.9, 0.9]] }]);
    for (const tick of [110, 130, 140]) steps.push((lesson.watch(scene(tick, ...drones), 0), lesson.step));
    return steps.map((at) => at - step);
  };
  assert.deepEqual(reached(0, [0, 0.9, 0.9], [0, 0.9, 0.3], [0, 0.3, 0.3]), [0, 0, 0, 0, 0]);
  assert.deepEqual(reached(0, [0, 0.9, 0.9], [0, 0.8, 0.8], [0, 0.3, 0.3]), [0, 0, 0, 0, 1]);
  assert.deepEqual(reached(2, [1, 0.5, 0.5], [1, 0.5, 0.5]), [0, 0, 0, 0, 0], "the loss is seen to its end");
  lesson.over(false);
  assert.equal(at("step-title").textContent, "That is the game");
});

test("drones that are asked into the corner do the first step within seconds", () => {
  const { lesson } = learn(), game = new Game({ blue: 0 }, 1), strokes = [{ brush: "attract", width: 0.1, points: [[0.85, 0.85], [0.95, 0.95]] }];
  Object.assign(lesson, { step: 0, held: false });
  lesson.sent(strokes);
  game.command(0, densityOf(strokes));
  while (lesson.step === 0 && game.tick < 300) {
    game.advance();
    lesson.watch(game, 0);
  }
  assert.deepEqual([lesson.step, lesson.held, document.activeElement], [1, true, at("lesson-next")]);
});

test("each step has a room of its own, such as the server opens, waits on where it gets none, shows where to draw, and may be skipped", () => {
  let answers = false;
  const { lesson, line } = learn((message) => line.send({ type: "create", ...message }) && answers), states = [];
  const act = () => {
    lesson.act();
    states.push([lesson.held, line.count("create")]);
  };
  lesson.start();
  act();
  answers = true;
  act();
  line.hear("refused", { about: "create" });
  states.push([lesson.held, line.count("create")]);
  act();
  assert.deepEqual(states, [[true, 1], [false, 2], [true, 2], [false, 3]]);
  lesson.over(false);
  assert.deepEqual([lesson.held, at("step-title").textContent, line.last("create").lesson], [true, "Once more", true]);
  lesson.act();
  lesson.watch(scene(0, [0, 0.5, 0.5]), 0);
  assert.deepEqual([...["cx", "cy", "r"].map((name) => Math.round(at("goal-circle").getAttribute(name))), at("lesson-task").textContent.slice(0, 13)], [100, 0, 35, "1 of 3: Draw "]);
  document.documentElement.dataset.keys = "";
  lesson.ask();
  delete document.documentElement.dataset.keys;
  assert.match(at("lesson-task").textContent, /Space draws/, "for keys");
  for (let step = 0; step < 3; step++) at("lesson-skip").click();
  act();
  assert.deepEqual([line.last("create").opponent, line.last("create").lesson, lesson.running], ["halo", undefined, false]);
});
