// How far one has come: the table's opponents in their order, which unlock one by one. This browser keeps it.

import { keep, recall } from "./store.js";

export const ROUND = { time_limit: 120, majority: true }; // how a person's games are decided

// Whom one has beaten, how many games one has won in a row, to whom one lost the latest two, and whom one meets next: the last
// one again, once all are beaten.
export function progress(opponents) {
  const kept = recall("progress"), beaten = Array.isArray(kept?.beaten) ? kept.beaten : [], streak = Number(kept?.streak) || 0;
  const next = opponents.find((name) => !beaten.includes(name)) ?? opponents.at(-1), lost = Array.isArray(kept?.lost) ? kept.lost : [];
  return { beaten, streak, lost, next };
}

// A game against an opponent is over.
export function count(opponent, isWon, isLost = !isWon) {
  const { beaten, streak, lost } = progress([]), known = isWon ? [...new Set([...beaten, opponent])] : beaten;
  keep("progress", { beaten: known, streak: isWon ? streak + 1 : 0, lost: isLost ? [...lost, opponent].slice(-2) : [] });
}

// Whether a room's game counts: even sides, which a person and a policy lead, and no lesson.
export function counts({ settings: { red, blue, speed }, once }, opponent, isLesson) {
  return opponent.kind === "policy" && red === blue && speed >= 1 && !once && !isLesson;
}

// What wins most games against an opponent, if it is drawn at once and left; nothing of that kind does against others.
const RING = "one ring around the middle, half as wide as the board,", LINE = "one line up the board, a fifth of it from the left edge,";
const WINS = { corners: RING, centre: RING, blind_ring: RING, wavefront: RING, uniform: RING, ring: `${RING} with a wide brush`, hunter: LINE };

// Helps who has lost two games in a row to an opponent.
export function helpAgainst(opponent, lost) {
  const isStuck = lost.length === 2 && lost.every((name) => name === opponent);
  return isStuck && WINS[opponent] ? `Draw ${WINS[opponent]} at once, and leave it: that wins most games here.` : "";
}

export function inARow(streak) { return streak > 1 ? `${streak} won in a row.` : ""; }
