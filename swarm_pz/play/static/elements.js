// Elements of the page: found by their ids, and made.

/** @returns {any} whatever element it is */
export function byId(id) { return document.getElementById(id); }

// Make an element with properties (or attributes, where it has no such property) and parts.
/** @returns {any} */
export function make(tag, props = {}, ...parts) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...parts);
  return element;
}

export function button(words, onclick, props = {}) { return make("button", { type: "button", onclick, ...props }, ...[words].flat()); }

// Put an element at a place of the board, in map widths.
export function putAt(id, place) { Object.assign(byId(id).style, { left: `${100 * place[0]}%`, top: `${100 * (1 - place[1])}%` }); }

// Copy a field's text, and say so on a button.
export async function copy(field, trigger) {
  try {
    await navigator.clipboard.writeText(field.value);
  } catch { // the clipboard needs HTTPS or localhost
    field.select();
    if (!document.execCommand("copy")) return;
  }
  trigger.textContent = "Copied";
}

// Download a blob as a file.
export function download(blob, name) {
  const href = URL.createObjectURL(blob);
  make("a", { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 1000);
}

// Listen to events of elements, by their ids. A submitted form does not reload the page.
export function on(type, acts) {
  for (const [id, act] of Object.entries(acts)) {
    byId(id).addEventListener(type, (event) => {
      if (type === "submit") event.preventDefault();
      act(event);
    });
  }
}

// Listen to messages of a link, by their types.
export function hear(link, acts) {
  for (const [type, act] of Object.entries(acts)) link.addEventListener(type, ({ detail }) => act(detail));
}

// Set a text only if it changes: else screen readers would read it again.
export function say(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}
