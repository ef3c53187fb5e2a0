// Progress through the opponents, which unlock one by one; the browser stores it.

import { IDEAS, LEVELS } from "./levels.js";
import { keep, recall } from "./store.js";

export const ROUND = { time_limit: 120, majority: true }; // how a person's games are decided
export const FAST_S = 60; // for a star
const FEW = 10; // drawings for a star
const MOST = 3;

// Return the most drawings that earn a star: ten, or what the idea against this opponent needs in a minute, if more.
export function fewAgainst(opponent) { return Math.max(FEW, FAST_S / (IDEAS[LEVELS[opponent]?.idea]?.every_s ?? FAST_S)); }

// Return the stars of beaten opponents, the games won in a row, and the next opponent: the last one if all are beaten.
export function progress(opponents) {
  const { stars = {}, streak = 0 } = recall("progress") ?? {};
  return { stars, streak, next: opponents.find((name) => !stars[name]) ?? opponents.at(-1) };
}

// Keep the result of a game against an opponent: a star for winning, one for winning fast, one for few drawings.
export function count(opponent, isWon, seconds, drawings) {
  const { stars, streak } = progress([]);
  if (isWon) stars[opponent] = [true, seconds <= FAST_S, drawings <= fewAgainst(opponent)].map((star, i) => star || Boolean(stars[opponent]?.[i]));
  keep("progress", { stars, streak: isWon ? streak + 1 : 0 });
}

export function starsOf(won = []) {
  const count = won.filter(Boolean).length;
  return "★".repeat(count) + "☆".repeat(MOST - count);
}

// Tell if a room's game counts: even sides, a person against a policy, full speed, no lesson.
export function counts({ settings: { red, blue, speed }, once }, opponent, isLesson) {
  return opponent.kind === "policy" && red === blue && speed >= 1 && !once && !isLesson;
}

export function inARow(streak) { return streak > 1 ? `${streak} won in a row.` : ""; }

const DAY_MS = 86_400_000, SPREAD = 2_654_435_761; // puts the seeds of days far apart

// The game of a day, by UTC: the same opponent and the same start for everybody.
export function daily(opponents, day = Math.floor(Date.now() / DAY_MS)) {
  const seed = Math.imul(day, SPREAD) >>> 0;
  return { day, seed, opponent: opponents[seed % opponents.length] };
}

// Return how many days in a row were won, up to a day or the day before it.
export function dayStreak(day) {
  const stored = recall("daily");
  return stored?.day === day || stored?.day === day - 1 ? stored.streak : 0;
}

export function daysInARow(day) { return dayStreak(day) > 1 ? `, ${dayStreak(day)} days in a row` : ""; }

export function isDayWon(day) { return recall("daily")?.day === day; }

// Store that a day's game was won.
export function winDay(day) { if (!isDayWon(day)) keep("daily", { day, streak: dayStreak(day) + 1 }); }

const MOST_OWN = 200; // recorded games

// Store the player's side in a recorded game.
export function keepSide(recording, side) {
  keep("sides", Object.fromEntries([...Object.entries(recall("sides") ?? {}), [recording, side]].slice(-MOST_OWN)));
}

export function sideIn(recording) { return recall("sides")?.[recording] ?? ""; }
