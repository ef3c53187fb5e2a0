// The dialog of signs and keys. The board's own code paints its pictures.

import { Arena } from "./arena.js";
import { byId } from "./elements.js";
import { CELLS } from "./frames.js";
import { newCanvas, onLook } from "./ground.js";

const SIDE = 1100; // of a board of which a picture shows a part
const MIDDLE = 25; // the cell in the middle of every picture, along both axes
const HOLDS = [[-1, 0], [0, 0], [1, 0], [0, 1]]; // cells that capture, from there

// The scene of each sign: drones (team, cells from the middle), the team that captures there, and an event.
const SCENES = {
  drones: { drones: [[0, -2, 0.2], [1, 2, 0.2]], flown: true },
  red: { holds: 0, drones: [[1, -3.2, -0.5]] },
  blue: { holds: 1, drones: [[0, -3.2, -0.5]] },
  danger: { holds: 1, drones: [[0, -2.4, 0.2]], speed: 0.12 },
  captured: { drones: [[0, 0, 0]], was: 1 },
  target: { target: true, drones: [] },
};

function paintSigns() { for (const canvas of byId("legend").querySelectorAll("canvas")) paintSign(canvas, SCENES[canvas.dataset.sign]); }
paintSigns();
onLook(paintSigns);

export function explain() {
  byId("keys-placed").hidden = byId("placing").hidden;
  byId("keys-drawn").hidden = !byId("placing").hidden;
  byId("legend").showModal();
  byId("legend").scrollTop = 0;
}

// Paint a part of a board on which a scene stands.
function paintSign(canvas, { holds = null, drones, was = null, flown = false, speed = 0, target = false }) {
  const ground = newCanvas(SIDE), board = newCanvas(SIDE), arena = new Arena(ground, board, () => 0);
  const frame = (tick, shift, teams) => ({
    tick, teams: Uint8Array.from(teams), fields: [0, 1].map((team) => field(team === holds ? HOLDS : [])),
    positions: Float32Array.from(drones.flatMap(([, x, y]) => [place(x - shift), place(y - 0.4 * shift * shift)])),
    velocities: Float32Array.from(drones.flatMap(() => [speed, 0])),
  });
  const teams = drones.map(([team]) => team);
  for (let k = 9; k > 0 && flown; k--) arena.take(frame(100 - 7 * k, k / 3, teams));
  if (was !== null) arena.take(frame(97, 0, teams.map(() => was)));
  arena.take(frame(100, 0, teams));
  if (target) {
    const picture = new Uint8Array(CELLS * CELLS).map((_, i) => {
      const x = i % CELLS - MIDDLE, y = Math.floor(i / CELLS) - MIDDLE;
      return 255 * Math.exp(-(x * x / 14 + y * y / 4));
    });
    arena.ground.setTarget({ cells: CELLS, picture });
  }
  arena.paint();
  const pen = canvas.getContext("2d"), { width, height } = canvas, centre = place(0) * SIDE;
  for (const layer of [ground, board]) {
    pen.drawImage(layer, centre - width / 2, SIDE - centre - height / 2, width, height, 0, 0, width, height);
  }
}

function place(cells) { return (MIDDLE + 0.5 + cells) / CELLS; }

function field(cells) {
  const values = new Uint8Array(CELLS * CELLS);
  for (const [x, y] of cells) values[(MIDDLE + y) * CELLS + MIDDLE + x] = 255;
  return values;
}
