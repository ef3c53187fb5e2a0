// Names and times as people read them.

export const SIDES = ["red", "blue"];
export const NAMES = ["Red", "Blue"];
export const SIGNS = ["●", "◆"];
export const TICKS = 30; // per second

// Experiments hide opponents' names and all ways out of the game.
export function isStudy() { return document.body.classList.contains("study"); }

// A policy's or a control system's name.
export function called(name) { return isStudy() ? "the opponent" : name.replaceAll("_", " "); }

// The player of a seat.
export function playerOf({ kind, name, policy = name, label }, free = "nobody") {
  return { free, policy: called(policy), person: label || "a person", program: label || "a program" }[kind];
}

export function clock(tick) {
  const seconds = Math.floor(tick / TICKS);
  return `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}
