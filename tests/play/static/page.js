// A fake browser: the elements of index.html, canvases that record what is painted on them, storage, and a clock.
// It has only what the page's modules use. Time passes only when a test lets it pass.

import { appendFileSync, readFileSync } from "node:fs";
import { SERVER } from "../../../swarm_pz/play/static/link.js";

export const FOLDER = process.env.SWARM_PZ_FIXTURES;
if (!FOLDER) throw new Error("tests/play/test_static.py runs these tests, with fixtures that Python makes");
export const fixtures = JSON.parse(readFileSync(`${FOLDER}/fixtures.json`, "utf8"));
export const bytes = (base64) => Uint8Array.from(Buffer.from(base64, "base64")).buffer;
export const plain = (value) => JSON.parse(JSON.stringify(value, (_, v) => (ArrayBuffer.isView(v) ? [...v] : v)));

// --- time -------------------------------------------------------------------------------------------

export const time = {
  ms: 1000, timers: new Map(), frames: [], count: 0,
  pass(ms) {
    const end = this.ms + ms;
    for (;;) {
      const [next] = [...this.timers].filter(([, { due }]) => due <= end).sort(([, a], [, b]) => a.due - b.due);
      if (!next) break;
      this.timers.delete(next[0]);
      this.ms = Math.max(this.ms, next[1].due);
      next[1].act();
    }
    this.ms = end;
  },
  // Run the callbacks of the next animation frame.
  frame() { for (const act of this.frames.splice(0)) act(this.ms); },
};
performance.now = () => time.ms;
globalThis.setTimeout = (act, ms = 0) => {
  time.timers.set(++time.count, { act, due: time.ms + ms });
  return time.count;
};
globalThis.clearTimeout = (timer) => time.timers.delete(timer);
globalThis.setInterval = () => 0;
globalThis.requestAnimationFrame = (act) => time.frames.push(act);
// Wait until pending promises have settled, dynamic imports included.
export async function settled() { for (let i = 0; i < 5; i++) await new Promise(setImmediate); }

// --- elements ---------------------------------------------------------------------------------------

// Records fills, strokes and images since the canvas was cleared, each with its path and style.
class Context {
  constructor() { Object.assign(this, { done: [], path: [], globalAlpha: 1 }); }

  put(op, style, path = this.path) { this.done.push({ op, style, alpha: this.globalAlpha, width: this.lineWidth, path: [...path] }); }

  beginPath() { this.path = []; }

  fill(of = this) { this.put("fill", this.fillStyle, of.path); }

  stroke(of = this) { this.put("stroke", this.strokeStyle, of.path); }

  fillRect(...box) { this.put("fill", this.fillStyle, [["rect", ...box]]); }

  clearRect() { this.done = []; }

  drawImage(image, ...box) { this.put("image", image, [["rect", ...box]]); }

  createPattern(tile) { return tile.getContext("2d").fillStyle; } // its colour

  createImageData(width, height) { return { data: new Uint8ClampedArray(4 * width * height) }; }
}
for (const part of ["moveTo", "lineTo", "arc", "rect"]) Context.prototype[part] = function (...to) { this.path.push([part, ...to]); };
for (const idle of ["strokeRect", "closePath", "fillText", "putImageData"]) {
  Context.prototype[idle] = () => {};
}

globalThis.Path2D = class extends Context {};

class Element extends EventTarget {
  constructor(tag, attributes = {}) {
    super();
    const { hidden, checked, value = "", min, max, width = 300, height = 150 } = attributes;
    Object.assign(this, {
      tag, attributes, children: [], dataset: {}, className: attributes.class ?? "", onclick: null, onchange: null, type: "", title: "",
      hidden: hidden !== undefined, checked: checked !== undefined, disabled: false, value, min, max, href: "", download: "",
      width: Number(width), height: Number(height), open: false, style: {},
    });
  }

  get id() { return this.attributes.id; }

  get textContent() { return this.children.map((part) => part.textContent ?? part).join(""); }

  set textContent(text) { this.children = text === "" ? [] : [String(text)]; }

  get classList() {
    const names = () => new Set(this.className.split(" ").filter(Boolean));
    return {
      add: (name) => { this.className += ` ${name}`; },
      contains: (name) => names().has(name),
      toggle: (name, on) => {
        const all = names();
        all[on ?? !all.has(name) ? "add" : "delete"](name);
        this.className = [...all].join(" ");
      },
    };
  }

  get options() { return this.children.filter(({ tag }) => tag === "option"); }

  get valueAsNumber() { return Number(this.value); }

  get clientWidth() { return this.width; }

  append(...parts) {
    this.children.push(...parts);
    if (this.tag === "select" && !this.options.some(({ value }) => value === this.value)) this.value = this.options[0]?.value ?? "";
  }

  replaceChildren(...parts) {
    this.children = [];
    this.append(...parts);
  }

  setAttribute(name, value) { this.attributes[name] = String(value); }

  getAttribute(name) { return this.attributes[name] ?? null; }

  toggleAttribute(name, on) {
    if (on) this.attributes[name] = "";
    else delete this.attributes[name];
  }

  // Return all descendants with a tag.
  all(tag) { return this.children.flatMap((part) => (part.tag ? [...(part.tag === tag ? [part] : []), ...part.all(tag)] : [])); }

  click() {
    if (this.disabled) return;
    this.onclick?.({ target: this });
    this.fire("click");
  }

  // Dispatch an event to it.
  fire(type, fields = {}) {
    if (type === "change") this.onchange?.({ target: this });
    this.dispatchEvent(Object.assign(new Event(type, { cancelable: true }), fields));
  }

  closest() { return null; }

  querySelector(name) { return this.all("li").find(({ className }) => `.${className}` === name) ?? null; }

  querySelectorAll(tag) { return this.all(tag); }

  add(option, i) { this.children.splice(i, 0, option); }

  select() {}

  scrollIntoView() {}

  reportValidity() { return true; }

  focus() { document.activeElement = this; }

  checkVisibility() { return !this.hidden; }

  showModal() { this.open = true; }

  close() { this.open = false; }

  setPointerCapture() {}

  getBoundingClientRect() { return { left: 0, top: 0, width: 100, height: 100 }; } // hundredths of the map

  getContext() { return this.context ??= new Context(); }
}

const elements = {};
const PAGE = readFileSync(new URL("../../../swarm_pz/play/static/index.html", import.meta.url), "utf8");
const attributesOf = (text) => Object.fromEntries([...text.matchAll(/([\w-]+)(?:="([^"]*)")?/g)].map(([, name, value = ""]) => [name, value]));
for (const [, tag, written] of PAGE.matchAll(/<(\w+)\s+([^>]*\bid="[^>]*)>/g)) {
  const attributes = attributesOf(written);
  elements[attributes.id] = new Element(tag, attributes);
}
for (const [, id, options] of PAGE.matchAll(/<select id="([\w-]+)"[^>]*>(.*?)<\/select>/gs)) {
  elements[id].append(...[...options.matchAll(/<option value="([^"]*)"/g)].map(([, value]) => new Element("option", { value })));
}
export const at = (id) => elements[id] ?? null; // as in the page: null where there is none
// Reset the page to its state after loading.
const fresh = Object.fromEntries(Object.entries(elements).map(([id, { tag, attributes, children, value }]) => [id, { tag, attributes: { ...attributes }, children, value }]));
export function reload() {
  for (const [id, { tag, attributes, children, value }] of Object.entries(fresh)) {
    elements[id] = new Element(tag, { ...attributes });
    elements[id].append(...children);
    elements[id].value = value;
  }
  document.activeElement = null;
  happenings = new EventTarget();
  time.timers.clear();
  time.frames = [];
}

class Store {
  kept = new Map();

  getItem(name) { return this.kept.get(name) ?? null; }

  setItem(name, value) { this.kept.set(name, String(value)); }

  removeItem(name) { this.kept.delete(name); }
}
let happenings = new EventTarget(); // events of the window
Object.assign(globalThis, {
  window: globalThis, localStorage: new Store(), sessionStorage: new Store(), devicePixelRatio: 1, innerWidth: 390, innerHeight: 844,
  location: { protocol: "http:", host: "table", origin: "http://table", hash: "", pathname: "/", replace: (to) => { location.replaced = to; } },
  history: { pushState: (...what) => go(...what), replaceState: (...what) => go(...what) }, scrollTo() {},
  matchMedia: () => ({ matches: true, addEventListener() {} }), getComputedStyle: () => ({ getPropertyValue: (name) => name }),
  addEventListener: (...what) => happenings.addEventListener(...what), dispatchEvent: (event) => happenings.dispatchEvent(event),
  ResizeObserver: class { observe() {} },
  Option: function (text, value) { return Object.assign(new Element("option", { value: String(value) }), { children: [text] }); },
  document: Object.assign(new EventTarget(), {
    hidden: false, activeElement: null, body: new Element("body"), documentElement: new Element("html"), querySelector: () => null, getElementById: at, createElement: (tag) => new Element(tag),
  }),
});
Object.defineProperty(globalThis, "navigator", { value: {}, configurable: true });

function go(_, __, address) { location.hash = address.startsWith("#") ? address : ""; }

// --- the server -------------------------------------------------------------------------------------

// A connection without a server. It records the messages, which Python later reads as the server does.
export class Line extends EventTarget {
  sent = []; isOpen = true; table = SERVER; seat = null; lastSeat = null; offsetMs = 0; roundTripMs = 0;

  system = "ergodic"; // the control system of its drones

  now() { return time.ms; }

  send(message) {
    this.sent.push(plain(message));
    appendFileSync(`${FOLDER}/said.jsonl`, `${this.system} ${JSON.stringify(message)}\n`);
    return this.isOpen;
  }

  tell(type, detail) { this.dispatchEvent(new CustomEvent(type, { detail })); }

  hear(type, detail) { this.tell(type, detail); }

  last(type) { return this.sent.findLast((message) => message.type === type); }

  count(type) { return this.sent.filter((message) => message.type === type).length; }
}

// A socket whose other end is the test. It records the messages for Python, too.
export class Socket {
  static OPEN = 1;

  static all = [];

  constructor(address, protocol) {
    Object.assign(this, { address, protocol, readyState: 0, line: new Line() });
    Socket.all.push(this);
  }

  static get last() { return Socket.all.at(-1); }

  get sent() { return this.line.sent; }

  send(text) { this.line.send(JSON.parse(text)); }

  hear(...messages) {
    for (const message of messages) this.onmessage({ data: message instanceof ArrayBuffer ? message : JSON.stringify(message) });
  }

  async open() {
    this.readyState = 1;
    this.onopen();
    await settled();
  }

  close() {
    this.readyState = 3;
    this.onclose();
  }
}
globalThis.WebSocket = Socket;
