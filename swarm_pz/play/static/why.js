// Why a game turned: the one loss after which the winner led for good, and who had made the ground where it happened.

import { SWING_S, turningPoint, untilTheEnd } from "./chart.js";
import { cellOf, limitsOf, placeOf, TRAIL } from "./engine/ground.js";
import { CELLS } from "./frames.js";
import { NAMES, SIDES, TICKS } from "./words.js";

const MOST_OF_IT = 0.75; // of the ground's value: the counted drones made at least this
const CIRCLED = 20; // of the last 150 ticks: a circling drone is close by for at least so many
const SUDDEN = 6, LONG = 30; // ticks

// Return the loss that turned a recorded game: its tick, place and a sentence; null without one. Moves the playback.
export function whyOf(playback) {
  const { room, hasFields } = playback, sizes = untilTheEnd(room), turn = turningPoint(sizes), winner = SIDES.indexOf(room.outcome);
  const loss = turn === null || winner < 0 || !hasFields ? null : lossAt(playback, sizes, turn, winner);
  if (!loss) return null;
  const { tick, drone } = loss, { positions } = playback.motionAt(tick), place = [positions[2 * drone], positions[2 * drone + 1]];
  const cell = cellOf(place[0], place[1]), held = [[], []]; // whether the cell captured for red and for blue, tick by tick
  for (let at = Math.max(tick - TRAIL, 0); at < tick; at++) {
    playback.goTo(at);
    playback.ground.fields.forEach((field, team) => held[team].push(field[placeOf(cell)] > limitsOf(field).limit));
  }
  return { tick, place, text: `${NAMES[1 - winner]} lost a drone ${making(playback, cell, winner)} ${timing(held, winner)}`.trim() };
}

// Return the capture with which the winner took the lead; if it led all along, the first of its greatest gain.
function lossAt({ captures }, sizes, turn, winner) {
  const leadAt = (second) => sizes[second][winner] - sizes[second][1 - winner], isTaken = turn > 0 && leadAt(turn - 1) <= 0;
  const within = captures.filter(({ tick }) => tick > TICKS * (turn - (isTaken ? 1 : SWING_S)) && tick <= TICKS * turn);
  const isOwn = ({ seat }) => seat === SIDES[winner];
  if (!isTaken) return within.find(isOwn) ?? null;
  let lead = leadAt(turn - 1);
  return within.filter((capture) => (lead += isOwn(capture) ? 2 : -2) > 0 && lead <= 2 && isOwn(capture)).at(-1) ?? null;
}

// Say how many drones made the ground of a cell in the last five seconds, and if they circled there.
function making({ ground: { trails }, teams }, cell, winner) {
  const makers = Array.from(teams, () => ({ ticks: 0, sides: new Set() })), row = Math.floor(cell / CELLS), column = cell % CELLS;
  trails.forEach((at, i) => {
    const right = at % CELLS - column, up = Math.floor(at / CELLS) - row, maker = makers[i % teams.length];
    if (at < 0 || Math.max(Math.abs(right), Math.abs(up)) !== 2 || teams[i % teams.length] !== winner) return;
    maker.ticks++;
    if (Math.abs(right) === 2) maker.sides.add(right > 0 ? "right" : "left");
    if (Math.abs(up) === 2) maker.sides.add(up > 0 ? "above" : "below");
  });
  const most = makers.sort((a, b) => b.ticks - a.ticks), enough = MOST_OF_IT * most.reduce((sum, { ticks }) => sum + ticks, 0);
  let count = 0, sum = 0;
  do sum += most[count++].ticks; while (sum < enough);
  const haveCircled = most.slice(0, count).every(({ ticks, sides }) => ticks >= CIRCLED && sides.size === 4);
  const size = teams.filter((team) => team === winner).length, manner = haveCircled ? ", circling close around it" : "";
  return `on ground that ${count} of ${SIDES[winner]}’s ${size} drones had made${manner}.`;
}

// Say when the loser last held a cell; else for how long the winner had, if that is long or very short.
function timing(held, winner) {
  const { length } = held[winner], since = length - 1 - held[winner].lastIndexOf(false), own = held[1 - winner].lastIndexOf(true);
  const seconds = (ticks) => (ticks / TICKS).toFixed(1);
  if (own === length - 1) return `${NAMES[1 - winner]} held it, too.`;
  if (own >= 0) return `${NAMES[1 - winner]} itself had held it, until ${seconds(length - own)} s before.`;
  if (since <= SUDDEN) return held[winner].slice(0, length - since).includes(true) ? "" : `It became ${SIDES[winner]}’s only then.`;
  return since >= LONG ? `It had been ${SIDES[winner]}’s for ${seconds(since)} s.` : "";
}
