// Progress through the opponents, which unlock one by one; the browser stores it.

import { keep, recall } from "./store.js";

export const ROUND = { time_limit: 120, majority: true }; // how a person's games are decided

// Return the opponents that were beaten, the games won in a row, and the next opponent: the last one again, once all are beaten.
export function progress(opponents) {
  const kept = recall("progress"), beaten = Array.isArray(kept?.beaten) ? kept.beaten : [];
  return { beaten, streak: Number(kept?.streak) || 0, next: opponents.find((name) => !beaten.includes(name)) ?? opponents.at(-1) };
}

// Keep the result of a game against an opponent.
export function count(opponent, isWon) {
  const { beaten, streak } = progress([]);
  keep("progress", { beaten: isWon ? [...new Set([...beaten, opponent])] : beaten, streak: isWon ? streak + 1 : 0 });
}

// Tell if a room's game counts: even sides, a person against a policy, full speed, no lesson.
export function counts({ settings: { red, blue, speed }, once }, opponent, isLesson) {
  return opponent.kind === "policy" && red === blue && speed >= 1 && !once && !isLesson;
}

export function inARow(streak) { return streak > 1 ? `${streak} won in a row.` : ""; }

const MOST_OWN = 200; // recorded games

// Keep the side that one had in a recorded game.
export function keepSide(recording, side) {
  keep("sides", Object.fromEntries([...Object.entries(recall("sides") ?? {}), [recording, side]].slice(-MOST_OWN)));
}

export function sideIn(recording) { return recall("sides")?.[recording] ?? ""; }
