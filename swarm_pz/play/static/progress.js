// How far one has come: the table's opponents in their order, which unlock one by one. This browser keeps it.

import { keep, recall } from "./store.js";

export const ROUND = { time_limit: 120, majority: true }; // how a person's games are decided

// Whom one has beaten, whom one meets next (the last one again, once all are beaten), and how many games one has won in a row.
export function progress(rungs) {
  const kept = recall("progress"), beaten = Array.isArray(kept?.beaten) ? kept.beaten : [], streak = Number(kept?.streak) || 0;
  const next = rungs.find((name) => !beaten.includes(name)) ?? rungs.at(-1);
  return { beaten, streak, next };
}

// A game against an opponent is over.
export function count(opponent, isWon) {
  const { beaten, streak } = progress([]);
  keep("progress", isWon ? { beaten: [...new Set([...beaten, opponent])], streak: streak + 1 } : { beaten, streak: 0 });
}

// Whether a room's game counts: even sides, which a person and a policy lead, and no lesson.
export function counts({ settings: { red, blue, speed }, once }, opponent, isLesson) {
  return opponent.kind === "policy" && red === blue && speed >= 1 && !once && !isLesson;
}

export function inARow(streak) { return streak > 1 ? `${streak} won in a row.` : ""; }
