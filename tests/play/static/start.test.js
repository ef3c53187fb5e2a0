// The start: levels, recorded games, rooms that wait; and the lesson.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

import { at, fixtures, Line, reload, time } from "./page.js";
import { opponentCards } from "../../../swarm_pz/play/static/cards.js";
import { Cover } from "../../../swarm_pz/play/static/cover.js";
import { listGames } from "../../../swarm_pz/play/static/games.js";
import { count, counts, progress } from "../../../swarm_pz/play/static/progress.js";
import { Lesson } from "../../../swarm_pz/play/static/lesson.js";
import { SERVER } from "../../../swarm_pz/play/static/link.js";
import { Story } from "../../../swarm_pz/play/static/story.js";
import { Waiting } from "../../../swarm_pz/play/static/waiting.js";

beforeEach(reload);

test("opponents unlock one by one, and a game that is won counts where the sides are even and it is no lesson", () => {
  const opponents = ["a", "b", "c"], policies = opponents.map((name) => ({ name, about: "", card: null })), chosen = [];
  const buttons = () => opponentCards(policies, opponents, progress(opponents), (name) => chosen.push(name)).flatMap((item) => item.all("button"));
  const told = () => buttons().map(({ disabled, children }) => [disabled, children[1].all("small")[0].textContent]);
  assert.deepEqual(told(), [[false, "next"], [true, "after a"], [true, "after b"]]);
  count("a", true);
  count("a", true);
  assert.deepEqual([told(), progress(opponents)], [[[false, "✓ beaten"], [false, "next"], [true, "after b"]], { beaten: ["a"], streak: 2, lost: [], next: "b" }]);
  count("b", false);
  for (const button of buttons()) button.click();
  assert.deepEqual([chosen, progress(opponents).streak], [["a", "b"], 0]);
  localStorage.setItem("swarm-pz.progress", '{"beaten": ["b"]}');
  assert.equal(told()[2][1], "after a", "what is beaten already opens nothing");
  for (const name of ["a", "b", "c"]) count(name, true);
  assert.equal(progress(opponents).next, "c", "the last one again");
  for (const nonsense of ["5", "null", '{"beaten": 5, "streak": {}, "lost": 5}']) {
    localStorage.setItem("swarm-pz.progress", nonsense);
    assert.deepEqual(progress(opponents), { beaten: [], streak: 0, lost: [], next: "a" });
  }
  const policy = { kind: "policy" }, game = { settings: { red: 10, blue: 10, speed: 1 } }, uneven = { settings: { red: 20, blue: 10, speed: 1 } };
  assert.deepEqual([counts(game, policy, false), counts(uneven, policy, false), counts(game, { kind: "person" }, false), counts(game, policy, true)],
    [true, false, false, false]);
});

// --- recorded games ---------------------------------------------------------------------------------

const POLICY = { kind: "policy", policy: "blind_ring" };
const GAMES = [
  { red: { kind: "person", label: "P3" }, blue: POLICY, outcome: "red" },
  { red: { kind: "program" }, blue: { kind: "person" }, outcome: "draw", ended_by: "left" },
  { red: { kind: "person" }, blue: { kind: "free" }, lesson: true, outcome: "stopped" },
  { red: { kind: "person" }, blue: { kind: "policy", policy: "ring" }, outcome: null },
  { red: null, blue: null, outcome: null },
].map((game) => ({ name: "20260101T120000Z-ABCD-1.jsonl", seconds: 75.7, sizes: [12, 8], ...game }));

test("recorded games tell who played, and how it ended, and lessons are none", async (context) => {
  context.mock.method(globalThis, "fetch", async () => ({ ok: true, json: async () => GAMES }));
  assert.equal(await listGames(SERVER, at("games")), 4);
  const links = at("games").all("a");
  assert.deepEqual(links.map(({ textContent }) => textContent.replace(/\S* ?\S* ?\S* ?\S* ?\S* ?room ABCD, game 1 /, "|").split("|")[0].replace(/ [A-Z][a-z]{2} 1,?.*/, "").trim()), [
    "P3 (red) against blind ring (blue) red won after 1:15",
    "program (red) against person (blue) a draw, 12 to 8, after 1:15, somebody had left",
    "person (red) against ring (blue) not finished",
    "not finished",
  ]);
  assert.ok(links.every(({ textContent, href }) => textContent.includes("room ABCD, game 1") && href === `#replay=${GAMES[0].name}`));
});

test("of a room its own games are listed, and without a server none", async (context) => {
  const answer = context.mock.method(globalThis, "fetch", async () => ({ ok: true, json: async () => GAMES }));
  assert.equal(await listGames(SERVER, at("games"), "WXYZ"), 0);
  answer.mock.mockImplementation(async () => { throw new Error("gone"); });
  assert.equal(await listGames(SERVER, at("games")), 0);
  assert.equal(at("games").textContent, "None so far.");
});

// --- rooms that wait --------------------------------------------------------------------------------

const room = (has = {}) => ({ ...fixtures.room, phase: "waiting", ...has });

test("who waits for a policy alone keeps the board in view, and is told one true thing", () => {
  const cover = new Cover(new Line(), () => {}, new Story()), blue = { ...fixtures.room.blue, ready: false, policy_state: "loading" };
  const told = [];
  for (const seat of [0, null]) {
    cover.show(room({ blue }), seat, null);
    time.frame();
    told.push([at("waiting").hidden, at("cover-text").textContent, at("blue-seat").textContent, at("table").dataset.phase]);
  }
  const words = ["blind ring is getting ready.", "blue: blind ring, getting ready"];
  assert.deepEqual(told, [[true, ...words, "before"], [false, ...words, "waiting"]]);
});

test("every address of the machine can be chosen for the link, with its picture", () => {
  const waiting = new Waiting(new Line());
  waiting.setAddresses(["http://table/", "https://other/"]);
  waiting.show(room({ blue: { ...fixtures.room.blue, kind: "free" } }), 0);
  assert.deepEqual([at("invitation-link").value, at("address-choice").hidden], ["http://table/#room=ABCD", false]);
  at("address").selectedIndex = 1;
  at("address").fire("change");
  assert.equal(at("invitation-link").value, "https://other/#room=ABCD");
  assert.equal(at("invitation-code").src, "/invitations/ABCD.svg?at=https%3A%2F%2Fother%2F");
  waiting.setAddresses([]);
  assert.equal(at("address-choice").hidden, true);
});

test("a result tells who won and why, leads to the turn and to who comes next", () => {
  const begun = [], line = new Line(), story = new Story(), cover = new Cover(line, (message) => begun.push(message), story);
  const over = (has) => {
    cover.show(room({ phase: "over", outcome: "red", sizes: [[10, 10], [8, 12], [15, 5]], recording: "a.jsonl", ...has }), 0, 75);
    time.frame();
    return [at("cover-text").textContent, at("turning").textContent];
  };
  assert.deepEqual(over(), ["You won after 0:02.", "The turn, at 0:01: red 15, blue 5."]);
  const told = over({ settings: { ...fixtures.room.settings, time_limit: 2, majority: true } });
  assert.equal(told[0], "You won: red 15, blue 5 when time was up.");
  story.take([], scene(3, [1, 0.2, 0.2]));
  story.take([0], scene(31, [0, 0.5, 0.5], [1, 0.55, 0.55], [1, 0.5, 0.42], [1, 0.9, 0.9], [0, 0.5, 0.5]));
  assert.equal(over()[1], "The turn, at 0:01: 3 of blue’s 4 drones stood within a fifth of the board’s width; you had flown around them, and gained 1 drone in 2 seconds.");
  assert.deepEqual([at("see").href, at("recording").href, at("next-game").hidden], ["#replay=a.jsonl@0", "#replay=a.jsonl", true]);
  line.hear("welcome", { opponents: ["blind_ring", "halo"], addresses: [] });
  count("blind_ring", true);
  over();
  assert.deepEqual([at("next-game").hidden, at("next-game").textContent], [false, "Next: halo"]);
  at("next-game").click();
  assert.deepEqual(begun.map(({ seat, opponent }) => [seat, opponent]), [["red", "halo"]]);
  const helps = ["halo", "blind_ring", "blind_ring"].map((opponent) => {
    count(opponent, false);
    over({ outcome: "blue" });
    return at("streak").textContent.replace(/ring.*/, "ring");
  });
  assert.deepEqual(helps, ["", "", "Draw one ring"]);
  count("blind_ring", false, false);
  over({ outcome: "draw" });
  assert.equal(at("streak").textContent, "", "not two in a row any more");
});

test("why drones were lost is told of what was seen, and of nothing else", () => {
  const story = new Story(), lost = (tick, ...places) => story.take([0], scene(tick, [1, 0.5, 0.5], ...places.map((place) => [0, ...place])));
  const far = [[0.9, 0.9], [0.1, 0.9], [0.9, 0.1], [0.1, 0.1]];
  story.take([], scene(0));
  lost(29, ...far);
  assert.match(story.why(1, 1, 0), /^Blue gained 1 drone in a second, on ground that blue had flown around\.$/);
  assert.deepEqual([story.why(0, 1, 0), story.why(1, 9, 0), story.why(-1, 1, 0)], ["", "", ""]);
  lost(45, [0.5, 0.55], [0.45, 0.5], ...far.slice(2));
  assert.match(story.why(1, 2, 1), /^3 of red’s 5 drones stood within a fifth of the board’s width; you had flown around them, and gained 2 drones in/);
  story.take([0], scene(58, [1, 0.5, 0.5], [0, 0.9, 0.9]));
  assert.match(story.why(1, 2, 0), /gained 3 drones in 2 seconds/, "not in more than there were");
  story.take([1, 2, 3, 4], scene(59, [1, 0.5, 0.5], ...far.map((place) => [0, ...place])));
  story.take([0], scene(62, [1, 0.5, 0.5], ...far.map((place) => [0, ...place])));
  assert.match(story.why(1, 3, 0), /^Blue gained 1 drone in a second/, "of the five the one that was a gain");
  story.take([], scene(300));
  assert.equal(story.why(1, 10, 0), "", "what came between was not seen");
  story.forget();
  story.take([], scene(0));
  lost(29, [0.5, 0.55], [0.45, 0.5], ...far, ...far.slice(2));
  assert.match(story.why(1, 1, 0), /^3 of your 9 drones stood within/, "a third of them is a crowd");
});

// --- the lesson -------------------------------------------------------------------------------------

const scene = (tick, ...places) => ({ tick, teams: Uint8Array.from(places.map(([team]) => team)), positions: Float32Array.from(places.flatMap(([, x, y]) => [x, y])) });

function learn(begin = () => true) {
  const line = new Line(), lesson = new Lesson(line, { begin, home() {}, next: () => "halo" });
  return { lesson, line };
}

test("a step is done once a drawing of one's own has had an effect: drones are in the corner, or a small ring has lost them", () => {
  const { lesson } = learn(), crowd = Array(7).fill([1, 0.5, 0.5]);
  const reached = (step, ...drones) => {
    Object.assign(lesson, { step, held: false, isDrawn: false, drawnTick: null });
    const looked = [10, 100].map((tick) => {
      lesson.watch(scene(tick, ...drones), 0);
      return lesson.step;
    });
    lesson.sent([{ points: [[0.9, 0.9]] }]);
    for (const tick of [110, 130, 140]) looked.push((lesson.watch(scene(tick, ...drones), 0), lesson.step));
    return looked.map((at) => at - step);
  };
  assert.deepEqual(reached(0, [0, 0.9, 0.9], [0, 0.9, 0.3], [0, 0.3, 0.3]), [0, 0, 0, 0, 0]);
  assert.deepEqual(reached(0, [0, 0.9, 0.9], [0, 0.8, 0.8], [0, 0.3, 0.3]), [0, 0, 0, 0, 1]);
  assert.deepEqual(reached(2, [0, 0.5, 0.5], [0, 0.5, 0.5], [0, 0.5, 0.5], ...crowd), [0, 0, 0, 0, 1]);
  assert.deepEqual(reached(2, [0, 0.5, 0.5], [0, 0.5, 0.5], [0, 0.5, 0.5], ...crowd.slice(3)), [0, 0, 0, 0, 0]);
});

test("the second step is a game that one wins, the third goes on however its game ends, and who drew nothing tries again", () => {
  const { lesson } = learn(), ended = (step, draws, isWon) => {
    Object.assign(lesson, { step, held: false, isDrawn: false, drawnTick: null });
    if (draws) lesson.sent([{ points: [[0.5, 0.5]] }]);
    lesson.over(isWon);
    return lesson.step;
  };
  assert.deepEqual([ended(1, true, true), ended(2, true, false)], [2, 3]);
  assert.doesNotMatch(at("lesson-text").textContent, /lucky/);
  assert.equal(ended(2, true, true), 3);
  assert.match(at("lesson-text").textContent, /^You were lucky: most games with a small ring are lost. Begin with a big ring/);
  assert.deepEqual([ended(1, true, false), ended(1, false, true), ended(2, false, false)], [1, 1, 2]);
});

test("each step has a room of its own, such as the server opens, waits on where it gets none, shows where to draw, and may be skipped", () => {
  let answers = false;
  const { lesson, line } = learn((message) => line.send({ type: "create", ...message }) && answers), seen = [];
  const act = () => {
    lesson.act();
    seen.push([lesson.held, line.count("create")]);
  };
  lesson.start();
  act();
  answers = true;
  act();
  line.hear("refused", { about: "create" });
  seen.push([lesson.held, line.count("create")]);
  act();
  assert.deepEqual(seen, [[true, 1], [false, 2], [true, 2], [false, 3]]);
  lesson.over(false);
  assert.deepEqual([lesson.held, at("step-title").textContent, line.last("create").lesson], [true, "Once more", true]);
  lesson.act();
  lesson.watch(scene(0, [0, 0.5, 0.5]), 0);
  assert.deepEqual([...["cx", "cy", "r"].map((name) => Math.round(at("goal-circle").getAttribute(name))), at("lesson-task").textContent.slice(0, 13)], [100, 0, 35, "1 of 3: Draw "]);
  for (let step = 0; step < 3; step++) at("lesson-skip").click();
  act();
  assert.deepEqual([line.last("create").opponent, line.last("create").lesson, lesson.running], ["halo", undefined, false]);
});
