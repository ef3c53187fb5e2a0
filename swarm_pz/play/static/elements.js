// Elements of the page: found by their ids, and made.

export const at = (id) => document.getElementById(id);

// An element with its properties, or attributes where it has no such property, and what it holds.
export function make(tag, has, ...parts) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(has)) {
    if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...parts);
  return element;
}

// A button of some words.
export function button(words, onclick, has = {}) { return make("button", { type: "button", onclick, ...has }, ...[words].flat()); }
