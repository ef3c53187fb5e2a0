// A participant's page: it shows one step of the study after the other, as the server sends them.

import { byId, make as makePlain } from "/static/elements.js";
import { keep, recall } from "/static/store.js";

const [, , CODE = ""] = location.pathname.split("/");
const STATE_MS = 2000; // between two requests, which also keep the participant present
const WAIT_MS = 700; // while something is about to begin
const RETRY_MS = 1500;
const SHORT = 11; // points of a scale that are buttons; longer ones are sliders

let shown = ""; // key of the page that is shown: it is not drawn again while somebody writes
let asks = false; // a page of its own is shown until it is answered: the participant does not take part, or may stop
/** @type {any} */
let later = 0;
let words = {}; // the pages' phrases in the study's language
let windowName = recall("window", "session") ?? newWindow();

function newWindow() {
  const name = crypto.getRandomValues(new Uint32Array(2)).join("-");
  keep("window", name, "session");
  return name;
}

// Return a phrase in the study's language, where # stands for a number.
function inWords(text) {
  const numbers = text.match(/\d+/g) ?? [], phrase = words[text.replace(/\d+/g, "#")];
  return phrase ? phrase.replace(/#/g, () => numbers.shift() ?? "") : text;
}

function make(tag, props = {}, ...parts) { return makePlain(tag, props, ...parts.map((part) => (typeof part === "string" ? inWords(part) : part))); }

function button(text, onclick) { return make("button", { type: "button", onclick }, text); }

function tell(text) { byId("told").textContent = inWords(text); }

// --- with the server ------------------------------------------------------------------------------

async function ask(act, more = {}) {
  clearTimeout(later);
  const request = { window: windowName, loaded: performance.timeOrigin, ...more };
  for (;;) {
    try {
      const answer = await fetch(`/study/${CODE}/${act}`, { method: "POST", body: JSON.stringify(request) });
      const state = await answer.json();
      byId("lost").textContent = "";
      show(state);
      return;
    } catch (error) {
      if (!(error instanceof TypeError || error instanceof SyntaxError)) throw error;
      byId("lost").textContent = inWords("The connection is lost; trying again…");
      await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
    }
  }
}

function lookAgain(ms = STATE_MS) {
  clearTimeout(later);
  later = setTimeout(() => ask("state"), ms);
}

// --- what is shown --------------------------------------------------------------------------------

function show(state) {
  if (asks) return;
  if (state.words) ({ words, language: document.documentElement.lang } = state);
  if (state.fault) {
    draw("fault", "This does not go on", [make("p", {}, make("a", { href: "/study", className: "button" }, "Type a code"))]);
    tell(state.fault);
    return;
  }
  byId("where").hidden = false;
  byId("study").textContent = document.title = state.title;
  byId("who").textContent = state.code;
  if (state.elsewhere) return showElsewhere();
  for (const [id, text, is] of [["stop", "Stop", state.may_stop], ["consented", "Your consent", state.consented]]) Object.assign(byId(id), { hidden: !is, textContent: inWords(text) });
  if (state.withdrawn) {
    const content = [paragraph("All that was kept of you is deleted. You can close this page."), ...text(state)];
    return draw("withdrawn", "You have withdrawn", content);
  }
  if (state.may_stop && location.hash === "#stop") return askToStop();
  Object.assign(byId("progress"), { max: state.of, value: state.done });
  const { step, game } = state, hasBegun = step && shown.startsWith(`${step.id} begun`);
  if (!step) return draw("end", "Thank you", [paragraph("That was all. You can close this page."), ...completion(state)]);
  if (game?.phase === "running" || (game?.phase === "ready" && !game.fault && hasBegun)) {
    keep("seat", game.seat, "session");
    location.replace(`/study/${CODE}/game#room=${game.seat.room}`);
    return;
  }
  const about = game ? gameWords(game) : "", begun = hasBegun && ["waiting", "ready"].includes(game?.phase) ? " begun" : "";
  const key = `${step.id}${begun} ${game?.phase ?? ""}${about}`;
  const again = key !== shown && step.attempt > 1 ? "Some answers were not right. Please try once more." : "";
  if (key !== shown) draw(key, step.heading, parts(state, about));
  const notice = state.refused || game?.fault || recall("told", "session") || again;
  if (notice) tell(notice);
  keep("told", "", "session");
  lookAgain(["waiting", "saving"].includes(game?.phase) ? WAIT_MS : STATE_MS);
}

function showElsewhere() {
  draw("elsewhere", "This study is open in another window", [
    paragraph("Go on there, or close that window. You can also go on here; the other window then stops."),
    choices(button("Go on here", () => {
      windowName = newWindow();
      ask("state", { here: true });
    })),
  ]);
  lookAgain();
}

function draw(key, heading, content) {
  const isNew = key.split(" ")[0] !== shown.split(" ")[0];
  shown = key;
  byId("told").textContent = "";
  byId("heading").textContent = inWords(heading);
  byId("asked").replaceChildren(...content);
  if (!isNew) return;
  scrollTo(0, 0);
  byId("heading").focus({ preventScroll: true });
}

// The server's own rendering of a text.
function text({ html }) { return html ? [make("div", { className: "text", innerHTML: html })] : []; }

function completion({ completion: codeOrLink }) {
  if (!codeOrLink) return [];
  if (/^https:/.test(codeOrLink)) return [choices(make("a", { href: codeOrLink, className: "button" }, "Go on"))];
  return [paragraph("This code shows that you have taken part:"), make("p", { id: "completion" }, codeOrLink)];
}

// Show a page of its own, with ways on: what buttons say, and what they then send.
function drawAside(key, heading, text, ways) {
  asks = true;
  clearTimeout(later);
  draw(key, heading, [paragraph(text), choices(...ways.map(([label, act, more]) => button(label, () => {
    asks = false;
    history.replaceState(null, "", location.pathname);
    ask(act, more);
  })))]);
}

// Ask if the participant wants to stop, and what becomes of what they have done.
function askToStop() {
  const text = "You need not say why, and you cannot come back. What you have done so far can be kept for the study, or deleted.";
  drawAside("stop", "Do you want to stop?", text, [
    ["Go back to the study", "state"], ["Stop, and keep it", "stop"], ["Stop, and delete it", "stop", { delete: true }],
  ]);
}

function parts({ step, game }, about) {
  switch (step.kind) {
    case "consent": return [...text(step), consent(step)];
    case "form": return [...text(step), form(step)];
    case "break": return [rest(step)];
    case "text": return [...text(step), choices(button("Go on", () => ask("done", { step: step.id })))];
    default: return [paragraph(about), ...(game.phase === "before" || game.fault || game.phase === "ready" ? [begin(step)] : [])];
  }
}

function gameWords({ phase, until, of_two: ofTwo, again }) {
  if (phase === "waiting") return "You are ready. The game begins when the other participant is, too.";
  if (phase === "saving") return "The game is over. The server is saving it.";
  if (again) return "This game was broken off. You play it again from the start.";
  if (until) return `These games do not count. You play them ${until}.`;
  return ofTwo ? "You play against another participant." : "It begins with a short countdown.";
}

function begin(step) {
  return choices(button("Begin", () => {
    shown = `${step.id} begun`;
    ask("play", { step: step.id });
  }));
}

function rest(step) {
  const ends = performance.now() + 1000 * step.seconds, timer = make("p", { id: "timer", role: "timer" });
  const goOn = button("Go on", () => ask("done", { step: step.id }));
  const count = () => {
    const left = Math.max(Math.ceil((ends - performance.now()) / 1000), 0);
    timer.textContent = `${Math.floor(left / 60)}:${String(left % 60).padStart(2, "0")}`;
    goOn.disabled = left > 0;
    if (left === 0) clearInterval(ticking);
  };
  const ticking = setInterval(count, 250);
  count();
  return make("div", {}, paragraph("Stretch, or look out of the window. You can go on when the time is up, or later."), timer, choices(goOn));
}

// --- questions ------------------------------------------------------------------------------------

// A form that is checked here: `check` is called when it is to be sent.
function ownForm(check, ...content) {
  return make("form", {
    noValidate: true,
    onsubmit: (event) => {
      event.preventDefault();
      check();
    },
  }, ...content);
}

function consent(step) {
  const agree = make("input", { type: "checkbox", name: "agree" });
  const label = make("label", { className: "agree" }, agree, "I have read this, and I agree to take part.");
  const text = "Nothing was written down about you. You can close this page.";
  const refuse = button("I do not want to take part", () => drawAside("declined", "Thank you for reading this", text, [["Back", "state"]]));
  return ownForm(() => {
    if (agree.checked) ask("done", { step: step.id });
    else complain("To take part, tick that you agree.", label, agree);
  }, label, choices(submit(), refuse));
}

function form(step) {
  const draft = `draft.${CODE}.${step.id}`, items = step.items.map((item) => ({ item, ...question(item) }));
  const saved = recall(draft, "session") ?? {};
  for (const { item, put } of items) if (saved[item.id] !== undefined && saved[item.id] !== null) put(saved[item.id]);
  const answers = () => Object.fromEntries(items.map(({ item, get }) => [item.id, get()]));
  const element = ownForm(() => {
    for (const { block } of items) block.classList.remove("wrong");
    const open = items.find(({ item, get }) => get() === null && !item.optional);
    const wrong = open ?? items.find(({ field }) => field && !field.checkValidity());
    if (!wrong) return ask("done", { step: step.id, answers: answers() });
    const { least, most } = wrong.item;
    complain(open ? "Please answer this question." : `Please give a number from ${least} to ${most}.`, wrong.block, wrong.block.querySelector("input, textarea"));
  }, ...items.map(({ block }) => block), choices(submit()));
  element.addEventListener("input", () => keep(draft, answers(), "session"));
  return element;
}

function complain(text, block, field) {
  block.classList.add("wrong");
  byId("told").textContent = "";
  tell(text);
  field.setAttribute("aria-describedby", "told");
  field.focus();
  block.scrollIntoView({ block: "center" });
}

// Return a question's block, functions that get and put the answer, and the field that can check it.
function question(item) {
  if (item.kind === "text" || item.kind === "number") return written(item);
  if (item.kind === "scale" && (item.most - item.least) / item.step + 1 > SHORT) return slider(item);
  return chosen(item);
}

function labelOf({ text, optional }) { return text + (optional ? ` ${inWords("(if you like)")}` : ""); }

function written(item) {
  const isNumber = item.kind === "number", required = !item.optional;
  const field = isNumber
    ? make("input", { id: item.id, type: "number", min: item.least, max: item.most, step: "any", inputMode: "decimal", required })
    : make("textarea", { id: item.id, maxLength: 4000, required });
  return {
    block: make("div", { className: "item" }, make("label", { htmlFor: item.id }, labelOf(item)), field),
    get: () => (field.value.trim() === "" && !field.validity.badInput ? null : isNumber ? field.valueAsNumber : field.value),
    put: (value) => { field.value = value; },
    field: isNumber ? field : null,
  };
}

function chosen(item) {
  const isScale = item.kind === "scale", values = isScale ? range(item) : item.choices;
  const fields = values.map((_, place) => make("input", { type: "radio", name: item.id, value: String(place) }));
  if (isScale && item.low) fields[0].setAttribute("aria-label", `${values[0]}, ${item.low}`);
  if (isScale && item.high) fields.at(-1).setAttribute("aria-label", `${values.at(-1)}, ${item.high}`);
  const answers = fields.map((field, place) => make("label", {}, field, String(values[place])));
  return {
    block: make(
      "fieldset", { className: "item" }, make("legend", {}, labelOf(item)),
      make("div", { className: `answers ${isScale ? "points" : "words"}` }, ...answers), ...(item.low || item.high ? [ends(item)] : []),
    ),
    get: () => values[fields.findIndex((field) => field.checked)] ?? null,
    put: (value) => { if (values.includes(value)) fields[values.indexOf(value)].checked = true; },
  };
}

function slider(item) {
  const hint = `${item.id}-hint`, output = make("output", { htmlFor: item.id });
  const field = make("input", { id: item.id, type: "range", min: item.least, max: item.most, step: item.step, "aria-describedby": hint });
  let isSet = false;
  const tell = () => {
    output.textContent = isSet ? field.value : inWords("not answered yet");
    field.setAttribute("aria-valuetext", output.textContent);
    field.classList.toggle("unset", !isSet);
  };
  const touch = () => {
    isSet = true;
    tell();
  };
  for (const type of ["input", "change", "click"]) field.addEventListener(type, touch);
  field.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    touch();
    field.dispatchEvent(new Event("input", { bubbles: true }));
  });
  tell();
  return {
    block: make("div", { className: "item" }, make("label", { htmlFor: item.id }, item.text), field, ends(item, { id: hint }, output)),
    get: () => (isSet ? field.valueAsNumber : null),
    put: (value) => {
      field.value = value;
      touch();
    },
  };
}

function range({ least, most, step }) {
  return Array.from({ length: Math.floor((most - least) / step) + 1 }, (_, place) => least + place * step);
}

function ends({ low, high }, props = {}, ...between) {
  return make("p", { className: "ends", ...props }, make("span", {}, low), ...between, make("span", {}, high));
}

function paragraph(text) { return make("p", {}, text); }

function submit() { return make("button", { type: "submit" }, "Go on"); }

function choices(first, ...others) {
  first.classList.add("primary");
  return make("div", { className: "choices" }, first, ...others);
}

// --- the beginning --------------------------------------------------------------------------------

function askForCode() {
  const field = make("input", { id: "participant", autocomplete: "off", autocapitalize: "characters", spellcheck: false, maxLength: 32 });
  const block = make("div", { className: "item" }, make("label", { htmlFor: "participant" }, "Your code"), field);
  draw("code", "Welcome", [ownForm(() => {
    const code = field.value.trim();
    if (/^[A-Za-z0-9][A-Za-z0-9_-]{0,31}$/.test(code)) location.assign(`/study/${code}`);
    else complain("A code is made of letters, digits, _ and -.", block, field);
  }, block, choices(submit()))]);
  field.focus();
}

byId("stop").onclick = askToStop;
byId("consented").href = `/study/${CODE}/consent`;
if (CODE === "monitor") import("./monitor.js");
else if (CODE) ask("state");
else askForCode();
