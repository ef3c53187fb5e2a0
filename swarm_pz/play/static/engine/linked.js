// Games in links: the engine replays a game of the page from its seed and its commands.

import { UNTIMED } from "./recording.js";
import { Room, UNVARIED } from "./room.js";
import { densityOf } from "./strokes.js";
import { SIDES } from "../words.js";

const BRUSHES = ["attract", "repel", "erase"];
const FINE = 1e4; // steps per map width, to which drawings are rounded
const LONGEST = 8000, MOST_BYTES = 2 ** 18; // letters of a link, and bytes of the game in it
const MOST_TICKS = 18_000, MOST_DRONES = 60; // more would take too long to replay

const whole = (value) => Math.round(value * FINE);

// A stroke as a list of whole numbers: brush, width, the first point, and steps from point to point.
function shorten({ brush, width, points }) {
  const steps = points.flatMap((point, i) => point.map((value, axis) => whole(value) - (i ? whole(points[i - 1][axis]) : 0)));
  return [BRUSHES.indexOf(brush), whole(width), ...steps];
}

function lengthen([brush, width, ...steps]) {
  const at = [0, 0], points = [];
  for (let i = 0; i < steps.length; i += 2) points.push([0, 1].map((axis) => (at[axis] += steps[i + axis]) / FINE));
  return { brush: BRUSHES[brush], width: width / FINE, points };
}

function isShort({ red, blue }, lastTick) { return red + blue <= MOST_DRONES && lastTick <= MOST_TICKS; }

// Compress or decompress bytes.
async function through(bytes, stream) { return new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer(); }

// Return a recorded game as text for a link; null if from a server, with factors or too long, or in an old browser.
export async function pack(text) {
  if (!("CompressionStream" in globalThis)) return null;
  const [header, ...lines] = text.trimEnd().split("\n").map((line) => JSON.parse(line)), { table, seed, software } = header;
  const side = SIDES.find((one) => header[one].kind === "person"), other = header[SIDES[1 - SIDES.indexOf(side)]], end = lines.at(-1);
  if (!software.endsWith("in a page") || end.type !== "end" || JSON.stringify(table.factors) !== JSON.stringify([UNVARIED, UNVARIED])) return null;
  const drawings = new Map(), commands = [], [red, blue = red] = [table.game.drones_per_team].flat();
  for (const line of lines.filter(({ seat }) => seat === side)) {
    if (line.type === "command") drawings.set(line.number, line.strokes);
    if (line.type === "in_force") commands.push([line.tick, drawings.get(line.number).map(shorten)]);
  }
  const { time_limit: limit } = table.game, settings = { red, blue, time_limit: limit < UNTIMED ? limit : null, speed: table.speed, majority: Boolean(table.majority) };
  const plain = [side, other.policy || null, seed, settings, table.min_command_interval, commands, end.tick, end.sizes];
  const json = new TextEncoder().encode(JSON.stringify(plain)), bytes = new Uint8Array(await through(json, new CompressionStream("deflate-raw")));
  const packed = btoa(String.fromCharCode(...bytes)).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
  return isShort(settings, end.tick) && packed.length <= LONGEST && json.length <= MOST_BYTES ? packed : null;
}

// Replay a packed game by the table.json of `swarm-pz site`. Return its recording, and whether it ends as it did.
export async function unpack(packed, { rules, commands: form, welcome }) {
  if (packed.length > LONGEST) throw new Error("the link is too long");
  const bytes = Uint8Array.from(atob(packed.replaceAll("-", "+").replaceAll("_", "/")), (letter) => letter.charCodeAt(0));
  const plain = await through(bytes, new DecompressionStream("deflate-raw"));
  const [seat, opponent, seed, settings, interval, commands, lastTick, sizes] = plain.byteLength > MOST_BYTES ? [] : JSON.parse(new TextDecoder().decode(plain));
  if (!settings || !isShort(settings, lastTick)) throw new Error("the game is too long or too large");
  let lines = [];
  const table = {
    factors: [UNVARIED, UNVARIED], interval, kind: "person", rules, commands: form, software: `swarm-pz ${welcome.version}, in a page`,
    client: null, countdown: 0, room: null, say() {}, shelf: { save: async (_, log) => { lines = log; } },
  };
  const room = new Room(table, "LINK", { seat, opponent, seed, settings });
  room.run = () => {}; // no timer: the loop below runs its ticks
  await room.loading;
  room.begin();
  room.start();
  for (let next = 0; room.phase === "playing" && room.game.tick < lastTick;) {
    for (; commands[next]?.[0] <= room.game.tick; next++) {
      const strokes = commands[next][1].map(lengthen);
      room.submit(room.team, { number: next + 1, strokes, density: densityOf(strokes) });
    }
    room.tick();
  }
  if (room.phase === "playing") room.stop("stopped", "left");
  return { text: lines.map((line) => `${JSON.stringify(line)}\n`).join(""), isSame: String(room.game.sizes) === String(sizes) && room.game.tick === lastTick };
}
