// A participant's page: one step of the study after the other, as the server says which comes next.

const at = (id) => document.getElementById(id);
const [, , CODE = ""] = location.pathname.split("/");
const STATE_MS = 2000; // between two looks, which also say that one is still here
const WAIT_MS = 700; // while something is about to begin
const RETRY_MS = 1500;
const SHORT = 11; // points of a scale that are buttons; longer ones are sliders

let shown = ""; // what is shown now, so that it is not drawn anew while somebody writes
let takesOver = false;
let declined = false; // who does not take part is asked nothing more
let later = 0;

const stored = {
  get: (name) => { try { return sessionStorage.getItem(`swarm-pz.${name}`); } catch { return null; } },
  set: (name, value) => { try { sessionStorage.setItem(`swarm-pz.${name}`, value); } catch { /* only a reload forgets it */ } },
};
let own = stored.get("window");
if (!own) newWindow();

function newWindow() {
  own = [...crypto.getRandomValues(new Uint8Array(8))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  stored.set("window", own);
  return own;
}

// --- with the server ------------------------------------------------------------------------------

async function ask(act, more = {}) {
  clearTimeout(later);
  const said = { window: own, loaded: performance.timeOrigin, ...(takesOver ? { here: true } : {}), ...more };
  for (;;) {
    try {
      const answer = await fetch(`/study/${CODE}/${act}`, { method: "POST", body: JSON.stringify(said) });
      const state = await answer.json();
      at("lost").textContent = "";
      takesOver = false;
      show(state);
      return;
    } catch (error) {
      if (!(error instanceof TypeError || error instanceof SyntaxError)) throw error;
      at("lost").textContent = "The connection is lost; trying again…";
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
  if (declined) return;
  if (state.fault) {
    draw("fault", "This does not go on", [link("Type a code", "/study")]);
    at("told").textContent = state.fault;
    return;
  }
  at("where").hidden = false;
  at("study").textContent = document.title = state.title;
  at("who").textContent = state.code;
  if (state.elsewhere) {
    draw("elsewhere", "This study is open in another window", [
      paragraph("Go on there, or close that window. You can also go on in this one; the other one stops then."),
      choices(button("Go on here", () => {
        newWindow();
        takesOver = true;
        ask("state");
      })),
    ]);
    lookAgain();
    return;
  }
  Object.assign(at("progress"), { max: state.of, value: state.done });
  const { step, game } = state;
  if (!step) {
    draw("end", "Thank you", [paragraph("That was all. You can close this page.")]);
    return;
  }
  if (game?.phase === "running") {
    play(game.seat);
    return;
  }
  if (game?.phase === "ready" && !game.fault && shown.startsWith(`${step.id} begun`)) {
    play(game.seat);
    return;
  }
  const what = game ? gameWords(game) : "";
  const begun = shown.startsWith(`${step.id} begun`) && (game?.phase === "waiting" || game?.phase === "ready");
  const key = `${step.id}${begun ? " begun" : ""} ${game?.phase ?? ""}${what}`;
  if (key !== shown) draw(key, step.heading, parts(state, what));
  const told = state.refused || game?.fault || stored.get("told");
  if (told) at("told").textContent = told;
  stored.set("told", "");
  lookAgain(["waiting", "saving"].includes(game?.phase) ? WAIT_MS : STATE_MS);
}

function draw(key, heading, content) {
  const isNew = key.split(" ")[0] !== shown.split(" ")[0];
  shown = key;
  at("told").textContent = "";
  at("heading").textContent = heading;
  at("asked").replaceChildren(...content);
  if (isNew) {
    scrollTo(0, 0);
    at("heading").focus({ preventScroll: true });
  }
}

function parts({ step, game }, words) {
  const text = step.html ? [prose(step.html)] : [];
  switch (step.kind) {
    case "consent": return [...text, consent(step)];
    case "form": return [form(step)];
    case "break": return [rest(step)];
    case "text": return [...text, choices(button("Go on", () => ask("done", { step: step.id })))];
    default: return [paragraph(words), ...(game.phase === "before" || game.fault || game.phase === "ready" ? [begin(step)] : [])];
  }
}

// --- games ----------------------------------------------------------------------------------------

function gameWords({ phase, until, of_two: ofTwo, again }) {
  if (phase === "waiting") return "You are ready. The game begins when the other participant is, too.";
  if (phase === "saving") return "The game is over; it is being written down.";
  if (again) return "This game was broken off: you play it once more, from its beginning.";
  if (until) return `These games do not count; you play them ${until}.`;
  return ofTwo ? "You play against another participant." : "It begins with a short countdown.";
}

function begin(step) {
  return choices(button("Begin", () => {
    shown = `${step.id} begun`;
    ask("play", { step: step.id });
  }));
}

function play(seat) {
  stored.set("seat", JSON.stringify(seat));
  location.replace(`/study/${CODE}/game#room=${seat.room}`);
}

// --- breaks ---------------------------------------------------------------------------------------

function rest(step) {
  const ends = performance.now() + 1000 * step.seconds, block = element("div"), timer = element("p", { id: "timer", role: "timer" });
  const goOn = button("Go on", () => ask("done", { step: step.id }));
  const count = () => {
    const left = Math.max(Math.ceil((ends - performance.now()) / 1000), 0);
    timer.textContent = `${Math.floor(left / 60)}:${String(left % 60).padStart(2, "0")}`;
    goOn.disabled = left > 0;
  };
  block.append(paragraph("Stretch, look out of the window. You can go on when the time is up, or later."), timer, choices(goOn));
  count();
  const ticking = setInterval(() => {
    count();
    if (!goOn.disabled || !timer.isConnected) clearInterval(ticking);
  }, 250);
  return block;
}

// --- questions ------------------------------------------------------------------------------------

function consent(step) {
  const form = element("form", { noValidate: true }), agree = element("input", { type: "checkbox", name: "agree" });
  const label = element("label", { className: "agree" });
  label.append(agree, "I have read this, and I agree to take part.");
  const refuse = button("I do not want to take part", () => {
    declined = true;
    clearTimeout(later);
    draw("declined", "Thank you for reading this", [
      paragraph("Nothing was written down about you. You can close this page."),
      choices(button("Back", () => {
        declined = false;
        ask("state");
      })),
    ]);
  });
  form.append(label, choices(submit("Go on"), refuse));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    if (agree.checked) ask("done", { step: step.id });
    else complain("To take part, tick that you agree.", label, agree);
  });
  return form;
}

function form(step) {
  const form = element("form", { noValidate: true }), draft = `draft.${CODE}.${step.id}`;
  const items = step.items.map((item) => ({ item, ...question(item) }));
  form.append(...items.map(({ block }) => block), choices(submit("Go on")));
  const before = JSON.parse(stored.get(draft) ?? "{}");
  for (const { item, put } of items) if (before[item.id] !== undefined && before[item.id] !== null) put(before[item.id]);
  const answers = () => Object.fromEntries(items.map(({ item, get }) => [item.id, get()]));
  form.addEventListener("input", () => stored.set(draft, JSON.stringify(answers())));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    for (const { block } of items) block.classList.remove("wrong");
    const open = items.find(({ item, get }) => get() === null && !item.optional);
    const wrong = open ?? items.find(({ field }) => field && !field.checkValidity());
    if (wrong) {
      const { least, most } = wrong.item;
      complain(open ? "Please answer this question." : `Please give a number from ${least} to ${most}.`, wrong.block, wrong.block.querySelector("input, textarea"));
    } else ask("done", { step: step.id, answers: answers() });
  });
  return form;
}

function complain(text, block, field) {
  block.classList.add("wrong");
  at("told").textContent = "";
  at("told").textContent = text;
  field.setAttribute("aria-describedby", "told");
  field.focus();
  block.scrollIntoView({ block: "center" });
}

// A question: its block, what reads and sets the answer, and the field that knows whether that can be.
function question(item) {
  if (item.kind === "text" || item.kind === "number") return written(item);
  if (item.kind === "scale" && (item.most - item.least) / item.step + 1 > SHORT) return slider(item);
  return chosen(item);
}

function written(item) {
  const isNumber = item.kind === "number", block = element("div", { className: "item" });
  const label = element("label", { htmlFor: item.id, textContent: item.text + (item.optional ? " (if you like)" : "") });
  const field = isNumber
    ? element("input", { id: item.id, type: "number", min: item.least, max: item.most, step: "any", inputMode: "decimal", required: !item.optional })
    : element("textarea", { id: item.id, maxLength: 4000, required: !item.optional });
  block.append(label, field);
  const get = () => (field.value.trim() === "" && !field.validity.badInput ? null : isNumber ? field.valueAsNumber : field.value);
  return { block, get, put: (value) => { field.value = value; }, field: isNumber ? field : null };
}

function chosen(item) {
  const block = element("fieldset", { className: "item" }), isScale = item.kind === "scale";
  const values = isScale ? range(item) : item.choices;
  block.append(element("legend", { textContent: item.text + (item.optional ? " (if you like)" : "") }));
  const row = element("div", { className: `answers ${isScale ? "points" : "words"}` });
  const fields = values.map((value, place) => {
    const field = element("input", { type: "radio", name: item.id, value: String(place) }), label = element("label");
    const end = isScale && place === 0 ? item.low : isScale && place === values.length - 1 ? item.high : "";
    if (end) field.setAttribute("aria-label", `${value}, ${end}`);
    label.append(field, String(value));
    row.append(label);
    return field;
  });
  block.append(row, ...(item.low || item.high ? [ends(item)] : []));
  return {
    block,
    get: () => values[fields.findIndex((field) => field.checked)] ?? null,
    put: (value) => { const field = fields[values.indexOf(value)]; if (field) field.checked = true; },
  };
}

function slider(item) {
  const block = element("div", { className: "item" }), hint = `${item.id}-hint`;
  const label = element("label", { htmlFor: item.id, textContent: item.text });
  const field = element("input", { id: item.id, type: "range", min: item.least, max: item.most, step: item.step, className: "unset" });
  const output = element("output", { htmlFor: item.id });
  let isSet = false;
  const tell = () => {
    output.textContent = isSet ? field.value : "not answered yet";
    field.setAttribute("aria-valuetext", output.textContent);
    field.classList.toggle("unset", !isSet);
  };
  const touch = () => { isSet = true; tell(); };
  field.setAttribute("aria-describedby", hint);
  for (const type of ["input", "change", "click"]) field.addEventListener(type, touch);
  field.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      touch();
      field.dispatchEvent(new Event("input", { bubbles: true }));
    }
  });
  const line = ends(item);
  line.id = hint;
  line.insertBefore(output, line.lastChild);
  block.append(label, field, line);
  tell();
  return { block, get: () => (isSet ? field.valueAsNumber : null), put: (value) => { field.value = value; touch(); } };
}

function range({ least, most, step }) {
  return Array.from({ length: Math.floor((most - least) / step) + 1 }, (_, place) => least + place * step);
}

function ends({ low, high }) {
  const line = element("p", { className: "ends" });
  line.append(element("span", { textContent: low }), element("span", { textContent: high }));
  return line;
}

// --- elements -------------------------------------------------------------------------------------

function element(name, properties = {}) {
  const made = document.createElement(name), { role, htmlFor, ...rest } = properties;
  Object.assign(made, rest);
  if (role) made.setAttribute("role", role);
  if (htmlFor) made.setAttribute("for", htmlFor);
  return made;
}

function paragraph(text) { return element("p", { textContent: text }); }

// The server's own rendering of the study's text; see texts.py.
function prose(html) { return element("div", { className: "text", innerHTML: html }); }

function link(text, href) {
  const block = element("p");
  block.append(element("a", { textContent: text, href, className: "button" }));
  return block;
}

function button(text, act) {
  const made = element("button", { type: "button", textContent: text });
  made.addEventListener("click", act);
  return made;
}

function submit(text) { return element("button", { type: "submit", textContent: text }); }

function choices(first, ...others) {
  const block = element("div", { className: "choices" });
  first.classList.add("primary");
  block.append(first, ...others);
  return block;
}

// --- the beginning --------------------------------------------------------------------------------

function askForCode() {
  const form = element("form", { noValidate: true }), block = element("div", { className: "item" });
  const field = element("input", { id: "participant", autocomplete: "off", autocapitalize: "characters", spellcheck: false, maxLength: 32 });
  block.append(element("label", { htmlFor: "participant", textContent: "Your code" }), field);
  form.append(block, choices(submit("Go on")));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const code = field.value.trim();
    if (/^[A-Za-z0-9][A-Za-z0-9_-]{0,31}$/.test(code)) location.assign(`/study/${code}`);
    else complain("A code is made of letters, digits, _ and -.", block, field);
  });
  draw("code", "Welcome", [form]);
  field.focus();
}

if (CODE) ask("state");
else askForCode();
