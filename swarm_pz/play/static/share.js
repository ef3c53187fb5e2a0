// Share a finished game: a picture, a text, a link to the same start, and one to the whole game.

import { untilTheEnd } from "./chart.js";
import { byId, copy, download, on } from "./elements.js";
import { rowOf } from "./embed.js";
import { look } from "./ground.js";
import { SERVER } from "./link.js";
import { daily, daysInARow } from "./progress.js";
import { called, clock, playerOf, SIDES, TICKS } from "./words.js";

const WIDTH = 1200, HEIGHT = 630, BOARD = 590, MARGIN = 20; // of the picture, in pixels
let shared = null; // texts and links of the game that is shared

on("click", {
  "copy-challenge": () => copy(byId("sharing-text"), byId("copy-challenge")),
  "copy-game": () => {
    byId("sharing-text").value = `${shared.words} Watch it: ${shared.game}`;
    copy(byId("sharing-text"), byId("copy-game"));
  },
  "save-picture": async () => download(await picture(), "swarm-pz.png"),
  "send-game": async () => {
    const files = [new File([await picture()], "swarm-pz.png", { type: "image/png" })], text = byId("sharing-text").value;
    await navigator.share(navigator.canShare?.({ files }) ? { text, files } : { text }).catch(() => {}); // not sent after all
  },
});

function picture() { return new Promise((resolve) => { byId("sharing-picture").toBlob(resolve, "image/png"); }); }

// Open the dialog for a room whose game is over; seat is the player's.
export async function share(table, room, seat, opponents) {
  const answer = await table.fetch(`recordings/${room.recording}`), text = answer?.ok ? await answer.text() : null;
  const facts = factsOf(room, seat, text), { seed, words } = facts, other = room[SIDES[1 - seat]];
  const base = table === SERVER ? byId("address").value : `${location.origin}${location.pathname}`;
  const challenge = opponents.includes(other.name) && seed !== null ? `#play=${other.name}@${seed}` : "", today = daily(opponents);
  const packed = text && table !== SERVER ? await (await import("./engine/linked.js")).pack(text) : null;
  const game = packed ?? (table === SERVER ? room.recording : null), prefix = seed === today.seed ? `Game of the day${daysInARow(today.day)}: ` : "";
  shared = { words: `swarm-pz: ${prefix}${words}.`, game: `${base}#replay=${game}` };
  byId("sharing-text").value = `${shared.words} ${challenge ? "The same start for you" : "Play it"}: ${base}${challenge}`;
  byId("copy-game").hidden = game === null;
  byId("send-game").hidden = !navigator.share;
  byId("copy-challenge").textContent = "Copy text and link";
  byId("copy-game").textContent = "Copy a link to watch it";
  paint(facts);
  byId("sharing").showModal();
}

// Return the result in words, and the seed; `text` is the recording, or null.
function factsOf(room, seat, text) {
  const row = text ? rowOf(room.recording, text, SIDES[seat]) : { seconds: room.sizes.length - 1, commands: 0, seed: null };
  const sizes = untilTheEnd(room), [red, blue] = sizes.at(-1), score = seat ? `${blue}–${red}` : `${red}–${blue}`, { commands, seed } = row;
  const against = `against ${playerOf(room[SIDES[1 - seat]])}`, drawings = ["", ", one drawing"][commands] ?? `, ${commands} drawings`;
  const cost = `in ${clock(TICKS * row.seconds)}${drawings}`;
  return { score, against, cost, words: `${score} ${against} ${cost}`, seed, isWon: room.outcome === SIDES[seat], seat, sizes };
}

// Paint the board's last moment, the result, and the sizes over time.
function paint({ score, against, cost, isWon, seat, sizes }) {
  const canvas = byId("sharing-picture"), pen = canvas.getContext("2d"), left = BOARD + 3 * MARGIN, right = WIDTH - MARGIN;
  pen.fillStyle = look.ground;
  pen.fillRect(0, 0, WIDTH, HEIGHT);
  for (const id of ["ground", "drones"]) pen.drawImage(byId(id), MARGIN, MARGIN, BOARD, BOARD);
  pen.strokeStyle = look.line;
  pen.strokeRect(MARGIN, MARGIN, BOARD, BOARD);
  const write = (words, size, y, colour = look.ink) => {
    pen.font = `${size > 50 ? "bold " : ""}${size}px system-ui, sans-serif`;
    pen.fillStyle = colour;
    pen.fillText(words, left, y, right - left);
  };
  write("swarm-pz: fight a swarm by drawing", 28, 60);
  write(score, 150, 230, look.teams[isWon ? seat : 1 - seat]);
  write(called(against), 52, 310);
  write(cost, 40, 370);
  sizes.forEach(([red, blue], i) => {
    const step = (right - left) / sizes.length, parts = [[look.teams[1], blue], [look.teams[0], red]];
    for (const [k, [colour, count]] of parts.entries()) {
      pen.fillStyle = colour;
      pen.fillRect(left + i * step, 440 + k * 150 * blue / (red + blue), step + 1, 150 * count / (red + blue));
    }
  });
  canvas.setAttribute("aria-label", `${score} ${against} ${cost}`);
}
